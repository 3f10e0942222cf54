"""Reads AMASS clips, SMPL-H and SMPL-X poses in npz files."""

from pathlib import Path

import numpy as np

from hemline.errors import BadMotion
from hemline.files import Unreadable, npz_arrays, read_bytes

from .motion import FRAMES_MAX, JOINT_COUNT, Motion, check_rate
from .quaternions import continuous, from_axis_angle, multiply, rotate

_JOINTS = 22
_Z_UP_TO_Y_UP = np.array([np.sqrt(0.5), -np.sqrt(0.5), 0, 0])
_PELVIS = np.array([0.0, -0.22, 0.03])
_MEAN_LEG = 0.81
_SPLIT = ("root_orient", "pose_body")
"""Arrays that newer files have in place of `poses`."""
_RATES = ("mocap_framerate", "mocap_frame_rate")
_BYTES_MAX = 2**30
_FRAMES_UNCHECKED = 10_000
"""Number of frames up to which the size of the file is not checked."""
_FRAME_BYTES = 20
"""Least number of bytes in the file for each further frame: even compressed, recordings have 100."""
_LICENCE = "AMASS: see amass.is.tue.mpg.de; non-commercial unless licensed"


def read_amass(path: str | Path) -> Motion:
    """Reads an AMASS npz: 22 body joints, hands at rest, turned from z up to y up.

    AMASS turns the body about its own pelvis, which lies at J0(betas) from its origin, and adds `trans`. So the pelvis
    is at `trans` + J0. J0 and the leg length are those of the mean SMPL body, since the betas mean nothing without it.

    Raises:
        BadMotion: The file is missing or damaged, holds objects (pickles), lacks a key, has wrong shapes or an
            implausible rate, more than 432,000 frames, or more than a file of its size can hold.

    Source: Mahmood et al., "AMASS: Archive of motion capture as surface shapes", 2019.
        Differs: shape and soft-tissue coefficients are not used.
    """
    path = Path(path)
    arrays = _arrays(path)
    rotvecs, translations = _rotation_vectors(arrays, path), arrays["trans"].astype(np.float64)
    fps = check_rate(float(next(arrays[name] for name in _RATES if name in arrays).item()), path)
    if translations.shape != (len(rotvecs), 3):
        what = f"trans of {path} must be {(len(rotvecs), 3)}"
        raise BadMotion(what, translations.shape, "make poses and trans agree")
    if not (np.isfinite(rotvecs).all() and np.isfinite(translations).all()):
        raise BadMotion(f"{path} must hold finite numbers", "NaN or infinity", "cut or mend those frames")
    rotations = np.zeros((len(rotvecs), JOINT_COUNT, 4))
    rotations[..., 0] = 1
    rotations[:, :_JOINTS] = from_axis_angle(rotvecs)
    rotations[:, 0] = multiply(_Z_UP_TO_Y_UP, rotations[:, 0])
    return Motion(
        rotations=continuous(rotations),
        translations=rotate(_Z_UP_TO_Y_UP, translations + _PELVIS),
        fps=fps,
        leg_length=_MEAN_LEG,
        name=path.stem,
        source=f"AMASS {path.name}",
        licence=_LICENCE,
        notes=(
            "z up turned to y up",
            f"the mean SMPL body is assumed: legs of {_MEAN_LEG} m; betas are not used",
            "hands and fingers are left at rest",
        ),
    )


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """Returns the arrays that are used, after checking that those that are needed are there."""
    content = read_bytes(path, _BYTES_MAX, error=BadMotion, cure="name an AMASS npz file")
    try:
        arrays = npz_arrays(content, ("poses", *_SPLIT, "trans", *_RATES))
    except Unreadable as reason:
        cure = "copy it again; files that hold pickled objects are not read"
        raise BadMotion(f"{path} is damaged or no AMASS clip", reason, cure) from reason
    needed = (*(() if "poses" in arrays else _SPLIT), "trans")
    missing = [name for name in needed if name not in arrays]
    missing += [] if any(name in arrays for name in _RATES) else [_RATES[0]]
    if missing:
        raise BadMotion(f"{path} is no AMASS clip", f"no array '{missing[0]}'", "name a file with poses and trans")
    for name in _RATES:
        if name in arrays and arrays[name].size != 1:
            raise BadMotion(f"{name} of {path} must be one number", arrays[name].shape, "give frames a second")
    _refuse_too_many_frames(arrays, path, len(content))
    return arrays


def _refuse_too_many_frames(arrays: dict[str, np.ndarray], path: Path, size: int) -> None:
    """Refuses what would take far more memory than the size of the file: equal frames compress to next to nothing."""
    frames = max((len(array) for name, array in arrays.items() if name not in _RATES and array.ndim), default=0)
    if frames > FRAMES_MAX:
        raise BadMotion(f"{path} may have {FRAMES_MAX} frames, an hour at 120 a second", frames, "cut it into clips")
    if frames > _FRAMES_UNCHECKED + size // _FRAME_BYTES:
        got = f"{frames} in {size} bytes"
        raise BadMotion(f"{path} has more frames than a recording of its size has", got, "save it without compression")


def _rotation_vectors(arrays: dict[str, np.ndarray], path: Path) -> np.ndarray:
    if "poses" in arrays:
        poses = arrays["poses"]
    else:
        first, others = (arrays[name] for name in _SPLIT)
        if not (first.ndim == others.ndim == 2 and len(first) == len(others)):
            got = f"{first.shape} and {others.shape}"
            raise BadMotion(f"{' and '.join(_SPLIT)} of {path} must have as many frames", got, "copy it again")
        poses = np.concatenate([first, others], axis=1)
    if poses.ndim != 2 or poses.shape[1] < 3 * _JOINTS or poses.shape[1] % 3 or len(poses) < 1:
        cure = f"give at least {_JOINTS} rotation vectors in each of one or more frames"
        raise BadMotion(f"poses of {path} must be (frames, 156), (frames, 165) or the like", poses.shape, cure)
    return poses[:, : 3 * _JOINTS].reshape(-1, _JOINTS, 3).astype(np.float64)

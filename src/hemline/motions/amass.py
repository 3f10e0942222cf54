"""Reads poses of the SMPL family in npz files: AMASS, and what trackers and generators of motion write."""

import warnings
from pathlib import Path

import numpy as np
from jaxtyping import Float

from hemline.errors import BadMotion, HemlineWarning

from .figure import pose_figure
from .motion import JOINT_COUNT, JOINT_NAMES, Motion
from .quaternions import continuous, multiply, rotate
from .rigs.upright import AXES, BodyPlaces, find_up, turn_to_y
from .smpl_arrays import JOINTS, read_smpl_arrays

_PELVIS = np.array([0.0, -0.22, 0.03])
_MEAN_LEG = 0.81
_FASTEST = 20.0
"""A pelvis that is faster than this in most steps moves in another unit [m/s]."""
_HIGHEST = 40.0
"""A person higher above the ground than this is in another unit, or in an aeroplane [m]."""
_LOOKED_AT = 400
_LICENCE = "AMASS: see amass.is.tue.mpg.de; non-commercial unless licensed"


def read_amass(path: str | Path, *, up: str | None = None) -> Motion:
    """Reads an npz with poses of SMPL, SMPL-H or SMPL-X: 22 body joints, hands at rest, turned to y up.

    The world of AMASS has z up, those of most trackers have y up, and camera coordinates have y down: it is seen from
    the body, unless `up` names it. SMPL turns the body about its own pelvis, which lies at J0(betas) from its origin,
    and adds `trans`. So the pelvis is at `trans` + J0. J0 and the leg length are those of the mean SMPL body, since
    the betas mean nothing without it.

    Args:
        path: The file.
        up: The axis that is up in it: `x`, `y`, `z`, `-x`, `-y` or `-z`; None: found.

    Raises:
        BadMotion: The file is missing or damaged, holds objects (pickles), lacks poses, has wrong shapes, no rotation
            vectors, an implausible rate or speed, more than 432,000 frames, or more than a file of its size can hold.

    Warns:
        HemlineWarning: The body lies in nearly all frames, or is far above the ground.

    Source: Mahmood et al., "AMASS: Archive of motion capture as surface shapes", 2019.
        Differs: shape and soft-tissue coefficients are not used.
    """
    path = Path(path)
    arrays = read_smpl_arrays(path)
    rotations = np.zeros((len(arrays.rotations), JOINT_COUNT, 4))
    rotations[..., 0] = 1
    rotations[:, :JOINTS] = arrays.rotations
    pelvis = arrays.translations + _PELVIS
    _refuse_other_units(pelvis, arrays.fps, path)
    upright = find_up(_body_points(rotations, pelvis), "z" if arrays.amass else "y", up, str(path))
    if upright.doubt:
        warnings.warn(HemlineWarning(*upright.doubt), stacklevel=2)
    turn = turn_to_y(np.array(AXES[upright.axis]))
    rotations[:, 0] = multiply(turn, rotations[:, 0])
    translations = rotate(turn, pelvis)
    if np.median(np.abs(translations[:, 1])) > _HIGHEST:
        got = f"{np.median(translations[:, 1]):.3g} m"
        cure = "divide trans by 100 if it is in centimetres, by 1000 if in millimetres"
        warnings.warn(HemlineWarning(f"the body of {path} is high above the ground", got, cure), stacklevel=2)
    notes = (
        f"{upright.axis} up turned to y up" if upright.axis != "y" else "",
        upright.note,
        *arrays.notes,
        f"the mean SMPL body is assumed: legs of {_MEAN_LEG} m; betas are not used",
        "hands and fingers are left at rest",
    )
    return Motion(
        rotations=continuous(rotations),
        translations=translations,
        fps=arrays.fps,
        leg_length=_MEAN_LEG,
        name=path.stem,
        source=f"AMASS {path.name}" if arrays.amass else path.name,
        licence=_LICENCE if arrays.amass else "",
        notes=tuple(note for note in notes if note),
    )


def _body_points(rotations: Float[np.ndarray, "frames joints 4"], pelvis: Float[np.ndarray, "frames 3"]) -> BodyPlaces:
    every = slice(None, None, -(-len(pelvis) // _LOOKED_AT))
    joints = pose_figure(rotations[every], pelvis[every], _MEAN_LEG)
    at = {name: joints[:, index] for index, name in enumerate(JOINT_NAMES)}
    return BodyPlaces(
        pelvis=0.5 * (at["left_hip"] + at["right_hip"]),
        head=at["head"],
        ankles=0.5 * (at["left_ankle"] + at["right_ankle"]),
        joints=joints,
        leg=_MEAN_LEG,
    )


def _refuse_other_units(pelvis: Float[np.ndarray, "frames 3"], fps: float, path: Path) -> None:
    """Refuses translations that are no metres, where nobody moves so fast."""
    if len(pelvis) < 2:
        return
    speed = float(np.median(np.linalg.norm(np.diff(pelvis, axis=0), axis=1))) * fps
    if speed > _FASTEST:
        cure = "divide trans by 100 if it is in centimetres, by 1000 if in millimetres, and see that the rate is right"
        raise BadMotion(f"trans of {path} must be metres", f"a pelvis that moves at {speed:.3g} m/s", cure)

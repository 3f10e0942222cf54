"""Finds poses, translations and rate in npz files of the SMPL family, by the names that common trackers use."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from hemline.errors import BadMotion, list_names
from hemline.files import Unreadable, npz_arrays, npz_names, read_bytes

from .motion import FRAMES_MAX, check_rate
from .quaternions import Quaternion, from_axis_angle, from_matrix

WHOLE = ("poses", "smpl_poses", "fullpose", "full_pose", "smpl_thetas", "thetas", "pose")
"""Names of the rotations of all joints."""
ROOT, BODY = ("root_orient", "global_orient"), ("pose_body", "body_pose")
"""Names of the rotation of the pelvis, and of those of all other joints."""
TRANSLATION = ("trans", "transl", "smpl_trans", "translation", "root_trans")
RATE = ("mocap_framerate", "mocap_frame_rate", "fps", "framerate", "frame_rate", "mocap_fps")
SCALING = "smpl_scaling"
"""Number by which translations are divided, as in AIST++."""

JOINTS = 22
"""Number of joints that are read; hands and faces are left at rest."""

_COUNTS = (22, 24, 52, 53, 54, 55)
"""Numbers of joints of SMPL, SMPL-H and SMPL-X, with or without hands, jaw and eyes."""
_FORMS = {6: "6D rotations", 9: "rotation matrices", 4: "quaternions"}
_USUAL_RATE = 30.0
_TURN = 1.05 * 2 * np.pi
_ODD_SHARE = 0.05
_BYTES_MAX = 2**30
_FRAMES_UNCHECKED = 10_000
"""Number of frames up to which the size of the file is not checked."""
_FRAME_BYTES = 20
"""Least number of bytes in the file for each further frame: even compressed, recordings have 100."""
_VECTORS = "give rotation vectors, axis times angle in radians"


@dataclass(frozen=True, eq=False)
class SmplArrays:
    """Rotations and way of a body, in the file's own world.

    Attributes:
        rotations: Local rotations of the 22 joints.
        translations: The file's translation of the body, not of its pelvis [m].
        fps: Frames a second.
        amass: Whether the arrays have the names of AMASS, whose world has z up.
        notes: What was assumed, one sentence each.
    """

    rotations: Float[np.ndarray, "frames joints 4"]
    translations: Float[np.ndarray, "frames 3"]
    fps: float
    amass: bool
    notes: tuple[str, ...]


def read_smpl_arrays(path: Path) -> SmplArrays:
    """Reads the arrays of an npz file.

    Raises:
        BadMotion: The file is missing or damaged, holds objects (pickles), has no poses, other forms of rotations than
            vectors and matrices, shapes that contradict each other, or far too many frames.
    """
    content = read_bytes(path, _BYTES_MAX, error=BadMotion, cure="name an AMASS npz file")
    try:
        there = npz_names(content)
        wanted = (*WHOLE, *ROOT, *BODY, *TRANSLATION, SCALING)
        arrays = npz_arrays(content, wanted)
    except Unreadable as reason:
        cure = "copy it again; files that hold pickled objects are not read"
        raise BadMotion(f"{path} is damaged or no AMASS clip", reason, cure) from reason
    _refuse_too_many_frames(arrays, path, len(content))
    rotations, named = _rotations(arrays, there, path)
    translations, way_note = _translations(arrays, len(rotations), path)
    fps, rate_note = _rate(content, there, path)
    notes = (way_note, rate_note)
    amass = named in (WHOLE[0], ROOT[0]) and not any(name in there for name in TRANSLATION[1:])
    return SmplArrays(rotations, translations, fps, amass, tuple(note for note in notes if note))


def _refuse_too_many_frames(arrays: Mapping[str, np.ndarray], path: Path, size: int) -> None:
    """Refuses what would take far more memory than the size of the file: equal frames compress to next to nothing."""
    frames = max((len(array) for array in arrays.values() if array.ndim), default=0)
    if frames > FRAMES_MAX:
        raise BadMotion(f"{path} may have {FRAMES_MAX} frames, an hour at 120 a second", frames, "cut it into clips")
    if frames > _FRAMES_UNCHECKED + size // _FRAME_BYTES:
        got = f"{frames} in {size} bytes"
        raise BadMotion(f"{path} has more frames than a recording of its size has", got, "save it without compression")


def _rotations(arrays: Mapping[str, np.ndarray], there: tuple[str, ...], path: Path) -> tuple[Quaternion, str]:
    """Returns the rotations, and the name of the array that they begin in."""
    whole = next((name for name in WHOLE if name in arrays), None)
    if whole is not None:
        return _as_quaternions(arrays[whole], whole, _COUNTS, path)[:, :JOINTS], whole
    root, body = (next((name for name in names if name in arrays), None) for names in (ROOT, BODY))
    if root is None or body is None:
        got = f"the arrays {list_names(there)}" if there else "no array"
        cure = "name a file with poses and trans, or global_orient, body_pose and transl"
        raise BadMotion(f"{path} has no poses of SMPL", got, cure)
    first = _as_quaternions(arrays[root], root, (1,), path)
    others = _as_quaternions(arrays[body], body, tuple(count - 1 for count in _COUNTS), path)
    if len(first) != len(others):
        got = f"{len(first)} and {len(others)}"
        raise BadMotion(f"{root} and {body} of {path} must have as many frames", got, "copy it again")
    return np.concatenate([first, others], axis=1)[:, :JOINTS], root


def _as_quaternions(array: np.ndarray, name: str, counts: tuple[int, ...], path: Path) -> Quaternion:
    """Returns rotations, given as vectors (frames, 3 joints), (frames, joints, 3), or matrices (frames, joints, 3, 3).

    Raises:
        BadMotion: They have another form, or are no rotations.
    """
    shown = "x".join(str(size) for size in array.shape)
    if array.ndim >= 3 and array.shape[0] == 1 and array.shape[-2:] != (3, 3) and array.shape[1] not in counts:
        array = array[0]
    matrices = array.ndim >= 3 and array.shape[-2:] == (3, 3) and (array.ndim == 4 or counts == (1,))
    frames, width = len(array), int(np.prod(array.shape[1:]))
    each = 9 if matrices else 3
    if array.ndim not in (2, 3, 4) or width not in {each * count for count in counts} or not frames:
        for numbers, form in _FORMS.items():
            if width in {numbers * count for count in counts}:
                what = f"{name} of {path} must be rotation vectors"
                raise BadMotion(what, f"{shown}, {width // numbers} joints as {form}?", _VECTORS)
        widths = ", ".join(str(3 * count) for count in counts)
        what = f"{name} of {path} must have {widths} numbers a frame, 3 a joint"
        raise BadMotion(what, shown, f"{_VECTORS}, of the pelvis and of all other joints")
    numbers = array.reshape(frames, -1, 3, 3) if matrices else array.reshape(frames, -1, 3)
    numbers = _finite(numbers.astype(np.float64), name, path)
    if matrices:
        off = np.abs(numbers @ numbers.swapaxes(-1, -2) - np.eye(3)).max()
        if off > 0.01 or (np.linalg.det(numbers) < 0).any():
            raise BadMotion(f"{name} of {path} must be rotation matrices", f"some {off:.2g} off", _VECTORS)
        return from_matrix(numbers)
    odd = float((np.linalg.norm(numbers, axis=-1) > _TURN).any(axis=1).mean())
    if odd > _ODD_SHARE:
        got = f"more than a whole turn in {100 * odd:.0f} % of the frames"
        raise BadMotion(f"{name} of {path} must be rotation vectors", got, f"are they in degrees? {_VECTORS}")
    return from_axis_angle(numbers)


def _finite(numbers: np.ndarray, name: str, path: Path) -> np.ndarray:
    odd = ~np.isfinite(numbers.reshape(len(numbers), -1)).all(axis=1)
    if odd.any():
        got = f"NaN or infinity in frame {int(np.argmax(odd))}"
        raise BadMotion(f"{name} of {path} must hold finite numbers", got, "cut or mend those frames")
    return numbers


def _translations(arrays: Mapping[str, np.ndarray], frames: int, path: Path) -> tuple[np.ndarray, str]:
    name = next((each for each in TRANSLATION if each in arrays), None)
    if name is None:
        return np.zeros((frames, 3)), "the file has no trans: the body stays where it is"
    way = arrays[name]
    if way.size == 3 * frames and (way.shape[0] == frames or frames == 1 or way.shape[0] == 1):
        way = way.reshape(frames, 3)
    if way.shape != (frames, 3):
        what = f"{name} of {path} must be {(frames, 3)}"
        raise BadMotion(what, way.shape, "make poses and trans agree")
    way = _finite(way.astype(np.float64), name, path)
    if SCALING in arrays and arrays[SCALING].size == 1 and float(arrays[SCALING].item()) > 0:
        scaling = float(arrays[SCALING].item())
        return way / scaling, f"trans divided by {SCALING}, {scaling:.4g}"
    return way, ""


def _rate(content: bytes, there: tuple[str, ...], path: Path) -> tuple[float, str]:
    name = next((each for each in RATE if each in there), None)
    if name is None:
        return _USUAL_RATE, f"the file has no rate: {_USUAL_RATE:g} frames a second are assumed"
    try:
        rate = npz_arrays(content, (name,))[name]
    except Unreadable as reason:
        raise BadMotion(f"{name} of {path} must be a number", reason, "save frames a second as a number") from reason
    if rate.size != 1:
        raise BadMotion(f"{name} of {path} must be one number", rate.shape, "give frames a second")
    return check_rate(float(rate.item()), path), ""

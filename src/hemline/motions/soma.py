"""Reads clips of NVIDIA's SOMA skeleton, which Kimodo writes as npz with the global rotation of each joint."""

from pathlib import Path

import numpy as np

from hemline.errors import BadMotion
from hemline.files import Unreadable, npz_arrays, npz_names, read_bytes

from .bvh import Bvh, BvhSkeleton
from .quaternions import from_matrix, inverse, multiply

_ARRAYS = ("posed_joints", "global_rot_mats")
_BYTES_MAX = 2**30
_RATE = 30.0
_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")


def _chain(*names: str, on: str) -> dict[str, str]:
    return dict(zip(names, (on, *names), strict=False))


def _skeleton(fingers: bool) -> dict[str, str]:
    """Returns the parent of each joint, in SOMA's order; that of 30 joints has no fingers."""
    parents = {"Hips": ""} | _chain("Spine1", "Spine2", "Chest", "Neck1", "Neck2", "Head", on="Hips")
    parents |= {"HeadEnd": "Head"} if fingers else {}
    parents |= dict.fromkeys(("Jaw", "LeftEye", "RightEye"), "Head")
    for side in ("Left", "Right"):
        parents |= _chain(*(f"{side}{part}" for part in ("Shoulder", "Arm", "ForeArm", "Hand")), on="Chest")
        for finger in _FINGERS if fingers else ("Thumb", "Middle"):
            bones = ("1", "2", "3", "End") if finger == "Thumb" else ("1", "2", "3", "4", "End")
            bones = bones if fingers else ("End",)
            parents |= _chain(*(f"{side}Hand{finger}{bone}" for bone in bones), on=f"{side}Hand")
    for side in ("Left", "Right"):
        bones = ("Leg", "Shin", "Foot", "ToeBase", *(("ToeEnd",) if fingers else ()))
        parents |= _chain(*(f"{side}{bone}" for bone in bones), on="Hips")
    return parents


SKELETONS = {len(parents): parents for parents in (_skeleton(False), _skeleton(True))}
"""Parent of each joint by name, by the number of joints: 30 and 77."""


def is_soma(path: str | Path) -> bool:
    """Whether a file is an npz with the arrays that Kimodo writes.

    Raises:
        BadMotion: The file cannot be read.
    """
    if Path(path).suffix.lower() != ".npz":
        return False
    content = read_bytes(path, _BYTES_MAX, error=BadMotion, cure="name an npz file")
    try:
        return set(_ARRAYS) <= set(npz_names(content))
    except Unreadable:
        return False


def read_soma(path: str | Path) -> Bvh:
    """Reads a clip of Kimodo as a skeleton and its rotations.

    Raises:
        BadMotion: The file is damaged, its arrays do not fit together, or it has another number of joints.
    """
    content = read_bytes(path, _BYTES_MAX, error=BadMotion, cure="name an npz file")
    try:
        arrays = npz_arrays(content, _ARRAYS)
    except Unreadable as reason:
        raise BadMotion(f"{path} is damaged", reason, "copy it again") from reason
    places, matrices = (np.asarray(arrays[name], np.float64) for name in _ARRAYS)
    joints = places.shape[1] if places.ndim == 3 else 0
    if joints not in SKELETONS:
        got = f"{joints} joints" if joints else f"posed_joints of shape {places.shape}"
        raise BadMotion(f"{path} must be a clip of SOMA's 30 or 77 joints", got, "export it as .bvh")
    if matrices.shape != (*places.shape, 3) or not (np.isfinite(places).all() and np.isfinite(matrices).all()):
        what = f"global_rot_mats of {path} must be finite and {(*places.shape, 3)}"
        raise BadMotion(what, matrices.shape, "save it again")
    names = tuple(SKELETONS[joints])
    parents = tuple(names.index(parent) if parent else -1 for parent in SKELETONS[joints].values())
    turned = from_matrix(matrices)
    local, offsets = turned.copy(), np.zeros((joints, 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            local[:, joint] = multiply(inverse(turned[:, parent]), turned[:, joint])
            bones = np.einsum("fij,fi->fj", matrices[:, parent], places[:, joint] - places[:, parent])
            offsets[joint] = bones.mean(axis=0)
    skeleton = BvhSkeleton(names, parents, offsets, {}, ((),) * joints)
    note = f"the file has no rate: {_RATE:g} frames a second are assumed, those of Kimodo"
    return Bvh(skeleton, local, {0: places[:, 0]}, _RATE, (note,))

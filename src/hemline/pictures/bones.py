"""Meshes of skeletons, for pictures."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Faces, Joints, Vertices

_SIDES = 6
_THICK = 0.18
"""Place of the thickest ring of a bone, as a fraction of its length."""


def bone_mesh(places: Joints, parents: Sequence[int], radius: float = 0.014) -> tuple[Vertices, Faces]:
    """Returns a mesh of a skeleton: a bone from each joint's parent to it, thick at the parent.

    Args:
        places: Position of each joint [m].
        parents: Parent of each joint; -1: none.
        radius: Radius of a bone where it is thickest [m].
    """
    vertices: list[np.ndarray] = [np.zeros((0, 3))]
    faces: list[np.ndarray] = [np.zeros((0, 3), np.int32)]
    count = 0
    for joint, parent in enumerate(parents):
        if parent < 0 or not (length := np.linalg.norm(places[joint] - places[parent])) > 1e-4:
            continue
        along = (places[joint] - places[parent]) / length
        side = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
        side /= np.linalg.norm(side)
        turns = 2 * np.pi * np.arange(_SIDES) / _SIDES
        ring = np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * np.cross(along, side)
        thick = min(radius, 0.25 * length)
        vertices.append(
            np.concatenate([[places[parent]], places[parent] + _THICK * length * along + thick * ring, [places[joint]]])
        )
        one, other = np.arange(_SIDES) + 1, np.roll(np.arange(_SIDES), -1) + 1
        start, end = np.zeros(_SIDES, np.int32), np.full(_SIDES, _SIDES + 1)
        faces.append(count + np.concatenate([np.stack([start, other, one], 1), np.stack([end, one, other], 1)]))
        count += _SIDES + 2
    return np.concatenate(vertices).astype(np.float32), np.concatenate(faces).astype(np.int32)

"""Mirrors features: with left and right exchanged, a garment and its motion are another garment and another motion."""

import numpy as np

from hemline.animators.coarse.proxy_on_body import BODY_PARTS, DYNAMIC_COUNT, FEATURE_JOINTS, STATIC_COUNT, TRAIL_COUNT
from hemline.arrays import Float, Int
from hemline.motions import JOINT_NAMES

VECTOR = np.array([-1, 1, 1], np.float32)
"""Signs of a vector in a mirrored frame."""


def _swap_sides(names: list[str]) -> Int[np.ndarray, " names"]:
    other = {"left": "right", "right": "left"}
    mirrored = [" ".join(other.get(part, part) for part in name.replace("_", " ").split()) for name in names]
    plain = [name.replace("_", " ") for name in names]
    return np.array([plain.index(name) for name in mirrored])


def dynamic_mirror() -> tuple[Int[np.ndarray, " dynamic"], Float[np.ndarray, " dynamic"]]:
    """Returns order and signs of mirrored features that change: mirrored = features[..., order] * signs."""
    vectors = 2 * TRAIL_COUNT // 3 + 2
    order = [*range(3 * vectors)]
    signs = [*np.tile(VECTOR, vectors)]
    for _ in range(2):
        first = len(order)
        for part in _swap_sides(list(BODY_PARTS)):
            order += [first + 4 * int(part) + k for k in range(4)]
            signs += [1, *VECTOR]
    first = len(order)
    for point in _swap_sides([JOINT_NAMES[joint] for joint in FEATURE_JOINTS]):
        order += [first + 3 * int(point) + k for k in range(3)]
        signs += [*VECTOR]
    order += range(len(order), DYNAMIC_COUNT)
    signs += [*VECTOR, 1]
    assert len(order) == len(signs) == DYNAMIC_COUNT
    return np.array(order), np.array(signs, np.float32)


def static_mirror() -> tuple[Int[np.ndarray, " static"], Float[np.ndarray, " static"]]:
    """Returns order and signs of mirrored features that do not change."""
    order, signs = [*range(13)], [*VECTOR, 1, *VECTOR, 1, 1, 1, *VECTOR]
    order += [13 + int(joint) for joint in _swap_sides(list(JOINT_NAMES))]
    signs += [1] * len(JOINT_NAMES)
    assert len(order) == STATIC_COUNT
    return np.array(order), np.array(signs, np.float32)

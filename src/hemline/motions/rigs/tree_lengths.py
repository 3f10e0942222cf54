"""Finds limbs and head of a rig without known names by the lengths of its bones, which no pose changes."""

from collections.abc import Callable

import numpy as np

from hemline.arrays import Float
from hemline.motions.bvh import Bvh
from hemline.motions.quaternions import Quaternion, Vector, rotate

from .posing import pose_joints
from .tree_shape import Tree

_UNEQUAL = 0.08
"""Largest difference between the bones of the two limbs of a pair, as a fraction of the longer one."""
_LEAST_BONE = 0.07
"""Least length of the two bones of an arm or leg, as a fraction of the longest way from the root to an end."""
_FRAMES = 60
"""Number of frames that are looked at."""


def joints_by_lengths(bvh: Bvh) -> dict[str, int] | None:
    """Returns hips, knees, ankles, shoulders, elbows, wrists, head (and toes); None if the rig is not a humanoid.

    Candidates are pairs of siblings whose two longest consecutive bones have the same lengths. The legs are the pair
    whose parent carries that of the arms; of several, the longest pairs are taken. The longest other chain from the
    parent of the arms is neck and head. Knees bend forward, toes point forward and elbows point back: this tells left
    from right in the frames of the clip.

    Args:
        bvh: The clip; its zero pose may be any.
    """
    places = np.asarray(bvh.skeleton.zero_positions, np.float64)
    if len(places) < 11 or not np.isfinite(places).all():
        return None
    tree = Tree(bvh.skeleton, places)
    size = tree.reach[tree.roots[0]]
    pairs = _pairs(tree, size)
    best = max(
        (
            (legs, arms)
            for legs, arms in ((a, b) for a in pairs for b in pairs if a is not b)
            if arms[0] in tree.below(legs[0]) and not _under(tree, legs) & {arms[0], *arms[1]} and arms[0] != legs[0]
        ),
        key=lambda both: sum(tree.reach[joint] for pair in both for joint in pair[1]),
        default=None,
    )
    if best is None:
        return None
    legs, arms = best
    others = [child for child in tree.children[arms[0]] if child not in arms[1]]
    if not others:
        return None
    neck = max(others, key=lambda child: tree.reach[child] + tree.bones[child])
    above = [child for child in tree.children[neck] if tree.bones[child] > 0]
    head = max(above, key=lambda child: tree.reach[child] + tree.bones[child]) if above else neck
    legs_limbs, arms_limbs = ([tree.limb(joint) or [] for joint in pair[1]] for pair in (legs, arms))
    every = slice(None, None, -(-len(bvh.rotations) // _FRAMES))
    sample = Bvh(bvh.skeleton, bvh.rotations[every], {0: bvh.positions[0][every]}, bvh.fps)
    left = _side_test(tree, *pose_joints(sample, (0,)), legs_limbs, arms_limbs, arms[0])
    joints = {"head": head}
    for names, limbs in ((("hip", "knee", "ankle"), legs_limbs), (("shoulder", "elbow", "wrist"), arms_limbs)):
        for side, limb in zip(("left", "right") if left(limbs) else ("right", "left"), limbs, strict=True):
            joints |= {f"{side}_{name}": joint for name, joint in zip(names, limb, strict=True)}
    for side in ("left", "right"):
        if after := tree.chain(joints[f"{side}_ankle"])[1:]:
            joints[f"{side}_foot"] = after[0]
    return joints


def _under(tree: Tree, pair: tuple[int, tuple[int, int]]) -> set[int]:
    return {joint for child in pair[1] for joint in tree.below(child)}


def _pairs(tree: Tree, size: float) -> list[tuple[int, tuple[int, int]]]:
    """Returns each joint with two of its children that carry limbs of the same lengths."""
    found = []
    for parent, one, other in tree.pairs():
        limbs = [limb for limb in (tree.limb(one), tree.limb(other)) if limb is not None]
        if len(limbs) < 2:
            continue
        bones = np.linalg.norm(np.diff(tree.places[np.array(limbs)], axis=1), axis=2)
        if bones.min() >= _LEAST_BONE * size and (np.abs(bones[0] - bones[1]) <= _UNEQUAL * bones.max(axis=0)).all():
            found.append((parent, (one, other)))
    return found


def _side_test(
    tree: Tree, rotations: Quaternion, positions: Vector, legs: list[list[int]], arms: list[list[int]], chest: int
) -> Callable[[list[list[int]]], bool]:
    """Returns a function that says whether the first of two limbs is the left one."""
    hips, knees, ankles = (positions[:, [leg[joint] for leg in legs]] for joint in range(3))
    shoulders, elbows, wrists = (positions[:, [arm[joint] for arm in arms]] for joint in range(3))
    toes = np.stack([_tip(tree, leg[2], rotations, positions) for leg in legs], axis=1) - ankles
    ahead = toes + knees - 0.5 * (hips + ankles) - elbows + 0.5 * (shoulders + wrists)
    up = positions[:, chest] - hips.mean(axis=1)
    left = np.cross(up, ahead.mean(axis=1))

    def is_left(limbs: list[list[int]]) -> bool:
        line = positions[:, limbs[0][0]] - positions[:, limbs[1][0]]
        return float(np.sum(line * left)) > 0

    return is_left


def _tip(tree: Tree, ankle: int, rotations: Quaternion, positions: Vector) -> Float[np.ndarray, "frames 3"]:
    """Returns the end of the chain below an ankle in each frame."""
    last = tree.chain(ankle)[-1]
    return positions[:, last] + rotate(rotations[:, last], tree.ends.get(last, np.zeros(3)))

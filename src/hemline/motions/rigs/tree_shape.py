"""Limbs and head of a rig whose names say nothing, by their places in the tree of joints."""

import itertools

import numpy as np

from hemline.arrays import Float
from hemline.motions.bvh import Skeleton

_MIRRORED = 0.12
"""Two joints are mirror images where they are so far from it, as a share of the rig's size, at most."""
_LIMB = 0.08
"""Each of the two bones of an arm or leg has this share of the rig's size at least."""
_JUDGED = 5000
"""Pairs of siblings that are looked at, at most."""


def joints_by_shape(skeleton: Skeleton) -> dict[str, int] | None:
    """Hips, knees, ankles, shoulders, elbows, wrists, head (and toes) of a humanoid; None where it is none.

    Two siblings whose chains are mirror images across a plane, one pair the lowest of all, are the legs; one whose
    chains reach out widest, above, are the arms; what goes up from between the arms is the neck and head. In a chain
    the two longest bones after each other are thigh and shank, or upper arm and forearm. The toes tell where the front
    is; without toes it is +z where y is up, and -y where z is up.

    Args:
        skeleton: The rig, its zero pose standing or in a T-pose; y or z is up.
    """
    places = np.asarray(skeleton.zero_positions, np.float64)
    if len(places) < 11 or not np.isfinite(places).all():
        return None
    size = float(np.ptp(places, axis=0).max())
    if not size > 0:
        return None
    tree = _Tree(skeleton, places)
    found = [_standing(tree, size, up, across) for up, across in ((1, 0), (2, 0), (1, 2), (2, 1))]
    return next((each for each in found if each is not None), None)


class _Tree:
    """Children, and the chain down from each joint to the end that is farthest along the bones."""

    def __init__(self, skeleton: Skeleton, places: Float[np.ndarray, "joints 3"]) -> None:
        self.places, self.ends = places, skeleton.ends
        self.children: list[list[int]] = [[] for _ in skeleton.names]
        self.roots = [joint for joint, parent in enumerate(skeleton.parents) if parent < 0]
        for joint, parent in enumerate(skeleton.parents):
            if parent >= 0:
                self.children[parent].append(joint)
        above = [max(parent, 0) for parent in skeleton.parents]
        bones = np.linalg.norm(places - places[above], axis=1).tolist()
        reach, self._after = [0.0] * len(places), [-1] * len(places)
        for joint in reversed(range(len(places))):
            farthest = max(self.children[joint], key=lambda child: bones[child] + reach[child], default=-1)
            if farthest >= 0:
                self._after[joint], reach[joint] = farthest, bones[farthest] + reach[farthest]
        self._limbs: dict[int, list[int] | None] = {}

    def chain(self, joint: int) -> list[int]:
        """From a joint down to the farthest end."""
        line = [joint]
        while (after := self._after[line[-1]]) >= 0:
            line.append(after)
        return line

    def limb(self, joint: int) -> list[int] | None:
        """The three joints of that chain whose two bones are the longest."""
        if joint not in self._limbs:
            self._limbs[joint] = _longest_two(self.places, self.chain(joint))
        return self._limbs[joint]

    def below(self, joint: int) -> list[int]:
        """A joint and all that hang from it."""
        found = [joint]
        for each in found:
            found += self.children[each]
        return found

    def pairs(self) -> list[tuple[int, int, int]]:
        """Each joint with two of its children."""
        each = ((p, a, b) for p, below in enumerate(self.children) for a, b in itertools.combinations(below, 2))
        return list(itertools.islice(each, _JUDGED))


def _standing(tree: _Tree, size: float, up: int, across: int) -> dict[str, int] | None:
    """The joints, if this axis is up and that one points from side to side."""
    places = tree.places
    mirrored = []
    for parent, one, other in tree.pairs():
        limbs = [limb for limb in (tree.limb(one), tree.limb(other)) if limb is not None]
        if len(limbs) < 2 or _apart(places, limbs[0], limbs[1], across) > _MIRRORED * size:
            continue
        bones = np.linalg.norm(np.diff(places[np.array(limbs)], axis=1), axis=2)
        if bones.min() >= _LIMB * size:
            mirrored.append((parent, (tree.chain(one), tree.chain(other)), limbs))
    if len(mirrored) < 2:
        return None
    legs = min(mirrored, key=lambda pair: max(places[limb[2], up] for limb in pair[2]))
    below = {joint for chain in legs[1] for joint in tree.below(chain[0])}
    above = [each for each in mirrored if each is not legs and not below & {each[1][0][0], each[1][1][0], each[0]}]
    if not above:
        return None
    arms = max(above, key=lambda pair: abs(places[pair[2][0][2], across] - places[pair[2][1][2], across]))
    if places[arms[0], up] <= places[legs[0], up] or not _hangs(places, legs[2], up):
        return None
    head = _head(tree, arms, up)
    if head is None or places[head, up] <= places[arms[0], up]:
        return None
    return _sided(tree, legs, arms, head, up, across)


def _longest_two(places: np.ndarray, chain: list[int]) -> list[int] | None:
    """Three joints after each other in a chain whose two bones are the longest."""
    if len(chain) < 3:
        return None
    bones = np.linalg.norm(np.diff(places[chain], axis=0), axis=1)
    first = int(np.argmax(np.minimum(bones[:-1], bones[1:])))
    return chain[first : first + 3]


def _apart(places: np.ndarray, one: list[int], other: list[int], across: int) -> float:
    """How far two limbs are from being mirror images across the plane between them."""
    mirrored = places[other].copy()
    middle = (places[one, across] + places[other, across]).mean() / 2
    mirrored[:, across] = 2 * middle - mirrored[:, across]
    return float(np.linalg.norm(places[one] - mirrored, axis=1).max())


def _hangs(places: np.ndarray, limbs: list[list[int]], up: int) -> bool:
    """Whether legs point down."""
    return all(places[hip, up] - places[ankle, up] > 0.5 * abs(_length(places, hip, ankle)) for hip, _, ankle in limbs)


def _length(places: np.ndarray, start: int, end: int) -> float:
    return float(np.linalg.norm(places[end] - places[start]))


def _head(tree: _Tree, arms: tuple, up: int) -> int | None:
    """The end of what goes up from between the arms, or the joint below it where that is a mere tip."""
    others = [child for child in tree.children[arms[0]] if child not in (arms[1][0][0], arms[1][1][0])]
    if not others:
        return None
    neck = max(others, key=lambda child: max(tree.places[each, up] for each in tree.below(child)))
    line = [neck]
    while len(tree.children[line[-1]]) == 1 and len(line) < 3:
        line.append(tree.children[line[-1]][0])
    return line[min(1, len(line) - 1)]


def _sided(tree: _Tree, legs: tuple, arms: tuple, head: int, up: int, across: int) -> dict[str, int]:
    """Left and right told apart by where the toes point."""
    places = tree.places
    ahead = 3 - up - across
    toes = [_tip(tree, chain, limb) - places[limb[2]] for chain, limb in zip(legs[1], legs[2], strict=True)]
    forward = float(sum(tip[ahead] for tip in toes))
    if abs(forward) < 1e-3 * _length(places, legs[2][0][0], legs[2][0][2]):
        forward = 1.0 if up == 1 else -1.0
    axis = np.cross(np.eye(3)[up], np.sign(forward) * np.eye(3)[ahead])
    joints = {"head": head}
    for names, pair in ((("hip", "knee", "ankle"), legs), (("shoulder", "elbow", "wrist"), arms)):
        swapped = places[pair[2][0][0]] @ axis < places[pair[2][1][0]] @ axis
        for side, limb in zip(("right", "left") if swapped else ("left", "right"), pair[2], strict=True):
            joints |= {f"{side}_{name}": joint for name, joint in zip(names, limb, strict=True)}
    for side in ("left", "right"):
        after = tree.chain(joints[f"{side}_ankle"])[1:]
        if after and abs(places[after[0], ahead] - places[joints[f"{side}_ankle"], ahead]) > 0:
            joints[f"{side}_foot"] = after[0]
    return joints


def _tip(tree: _Tree, chain: list[int], limb: list[int]) -> np.ndarray:
    last = chain[-1]
    return tree.places[last] + tree.ends.get(last, np.zeros(3)) if last != limb[2] else tree.places[last]

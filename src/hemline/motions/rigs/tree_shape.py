"""Finds limbs and head of a rig without known names, by their places in the tree of joints."""

import itertools

import numpy as np

from hemline.arrays import Float
from hemline.motions.bvh import BvhSkeleton

_MIRROR_TOLERANCE = 0.12
"""Largest distance of two joints from being mirror images, as a fraction of the rig's size."""
_LEAST_BONE = 0.08
"""Least length of the two bones of an arm or leg, as a fraction of the rig's size."""
_PAIRS_MAX = 5000
"""Largest number of pairs of siblings that are considered."""


def joints_by_shape(skeleton: BvhSkeleton) -> dict[str, int] | None:
    """Returns hips, knees, ankles, shoulders, elbows, wrists, head (and toes); None if the rig is not a humanoid.

    Candidates are pairs of siblings whose chains are mirror images across a plane. The lowest pair are the legs. Of
    those above, the pair that reaches out farthest are the arms. The chain that goes up between the arms is neck and
    head. In a chain, the two longest consecutive bones are thigh and shank, or upper arm and forearm. The toes point to
    the front; without toes it is +z if y is up, and -y if z is up.

    Args:
        skeleton: The rig, its zero pose standing or in a T-pose; y or z is up.
    """
    places = np.asarray(skeleton.zero_positions, np.float64)
    if len(places) < 11 or not np.isfinite(places).all():
        return None
    size = float(np.ptp(places, axis=0).max())
    if not size > 0:
        return None
    tree = Tree(skeleton, places)
    candidates = [_standing(tree, size, up, across) for up, across in ((1, 0), (2, 0), (1, 2), (2, 1))]
    return next((each for each in candidates if each is not None), None)


class Tree:
    """Children of the joints, and the chain from each joint down to the end that is farthest along the bones."""

    def __init__(self, skeleton: BvhSkeleton, places: Float[np.ndarray, "joints 3"]) -> None:
        self.places, self.ends = places, skeleton.ends
        self.children: list[list[int]] = [[] for _ in skeleton.names]
        self.roots = [joint for joint, parent in enumerate(skeleton.parents) if parent < 0]
        for joint, parent in enumerate(skeleton.parents):
            if parent >= 0:
                self.children[parent].append(joint)
        above = [max(parent, 0) for parent in skeleton.parents]
        self.bones = bones = np.linalg.norm(places - places[above], axis=1).tolist()
        self.reach = reach = [0.0] * len(places)
        self._after = [-1] * len(places)
        for joint in reversed(range(len(places))):
            farthest = max(self.children[joint], key=lambda child: bones[child] + reach[child], default=-1)
            if farthest >= 0:
                self._after[joint], reach[joint] = farthest, bones[farthest] + reach[farthest]
        self._limbs: dict[int, list[int] | None] = {}

    def chain(self, joint: int) -> list[int]:
        """Returns the chain from a joint down to the farthest end."""
        line = [joint]
        while (after := self._after[line[-1]]) >= 0:
            line.append(after)
        return line

    def limb(self, joint: int) -> list[int] | None:
        """Returns the three joints of that chain whose two bones are the longest."""
        if joint not in self._limbs:
            self._limbs[joint] = longest_two(self.places, self.chain(joint))
        return self._limbs[joint]

    def below(self, joint: int) -> list[int]:
        """Returns a joint and all joints that hang from it."""
        candidates = [joint]
        for each in candidates:
            candidates += self.children[each]
        return candidates

    def pairs(self) -> list[tuple[int, int, int]]:
        """Returns each joint with two of its children."""
        each = ((p, a, b) for p, below in enumerate(self.children) for a, b in itertools.combinations(below, 2))
        return list(itertools.islice(each, _PAIRS_MAX))


def _standing(tree: Tree, size: float, up: int, across: int) -> dict[str, int] | None:
    """Returns the joints, if the axis `up` is up and `across` points from side to side."""
    places = tree.places
    mirrored = []
    for parent, one, other in tree.pairs():
        limbs = [limb for limb in (tree.limb(one), tree.limb(other)) if limb is not None]
        if len(limbs) < 2 or _mirror_error(places, limbs[0], limbs[1], across) > _MIRROR_TOLERANCE * size:
            continue
        bones = np.linalg.norm(np.diff(places[np.array(limbs)], axis=1), axis=2)
        if bones.min() >= _LEAST_BONE * size:
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
    return _assign_sides(tree, legs, arms, head, up, across)


def longest_two(places: np.ndarray, chain: list[int]) -> list[int] | None:
    """Returns the three consecutive joints of a chain whose two bones are the longest."""
    if len(chain) < 3:
        return None
    bones = np.linalg.norm(np.diff(places[chain], axis=0), axis=1)
    first = int(np.argmax(np.minimum(bones[:-1], bones[1:])))
    return chain[first : first + 3]


def _mirror_error(places: np.ndarray, one: list[int], other: list[int], across: int) -> float:
    """Returns the distance of two limbs from being mirror images across the plane between them."""
    mirrored = places[other].copy()
    middle = (places[one, across] + places[other, across]).mean() / 2
    mirrored[:, across] = 2 * middle - mirrored[:, across]
    return float(np.linalg.norm(places[one] - mirrored, axis=1).max())


def _hangs(places: np.ndarray, limbs: list[list[int]], up: int) -> bool:
    """Whether legs point down."""
    return all(places[hip, up] - places[ankle, up] > 0.5 * abs(_length(places, hip, ankle)) for hip, _, ankle in limbs)


def _length(places: np.ndarray, start: int, end: int) -> float:
    return float(np.linalg.norm(places[end] - places[start]))


def _head(tree: Tree, arms: tuple, up: int) -> int | None:
    """Returns the end of the chain that goes up between the arms, or the joint below it if the end is a mere tip."""
    others = [child for child in tree.children[arms[0]] if child not in (arms[1][0][0], arms[1][1][0])]
    if not others:
        return None
    neck = max(others, key=lambda child: max(tree.places[each, up] for each in tree.below(child)))
    line = [neck]
    while len(tree.children[line[-1]]) == 1 and len(line) < 3:
        line.append(tree.children[line[-1]][0])
    return line[min(1, len(line) - 1)]


def _assign_sides(tree: Tree, legs: tuple, arms: tuple, head: int, up: int, across: int) -> dict[str, int]:
    """Tells left from right by the direction of the toes, and names the joints."""
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


def _tip(tree: Tree, chain: list[int], limb: list[int]) -> np.ndarray:
    last = chain[-1]
    return tree.places[last] + tree.ends.get(last, np.zeros(3)) if last != limb[2] else tree.places[last]

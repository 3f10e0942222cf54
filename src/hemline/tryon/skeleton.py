"""The body as lines, which must go through a garment's openings and never through its cloth."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int, Joints
from hemline.motions.motion import JOINT_NAMES, PARENTS

_TRUNK = (("pelvis", "neck"),)
_SIDE = (("neck", "shoulder"), ("neck", "collar"), ("collar", "hip"))
_TIPS = (("wrist", "elbow", 0.8), ("ankle", "knee", 0.3))
_HEAD = 0.25


def _number(name: str) -> int:
    return JOINT_NAMES.index(name)


def _bones() -> list[tuple[int, int]]:
    ends = {"head", "left_hand", "right_hand"}
    return [(PARENTS[j], j) for j in range(1, len(JOINT_NAMES)) if JOINT_NAMES[j] not in ends] + [
        (_number("neck"), _number("head"))
    ]


def _braces() -> list[tuple[int, int]]:
    sides = [(a if a == "neck" else f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in _SIDE]
    across = [(f"left_{each}", f"right_{each}") for each in ("shoulder", "hip")]
    return [(_number(a), _number(b)) for a, b in (*_TRUNK, *sides, *across)]


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Segments inside a posed body.

    Attributes:
        points: Positions of the joints, followed by the crown of the head, finger tips and heels [m].
        limbs: Segments that openings go around: bones, and lines from the last joints to crown, finger tips and heels.
        inner: Segments inside the body: the limbs, and braces of the trunk, such as from neck to pelvis and hip to hip.
    """

    points: Float[np.ndarray, "points 3"]
    limbs: Int[np.ndarray, "limbs 2"]
    inner: Int[np.ndarray, "segments 2"]

    @classmethod
    def of(cls, joints: Joints) -> "Skeleton":
        """Makes the skeleton of a body from its joints [m]."""
        at = np.asarray(joints, np.float64)
        points, limbs = [at, at[[_number("head")]] + (0, _HEAD, 0)], [*_bones(), (_number("head"), len(at))]
        for end, before, fraction in _TIPS:
            for side in ("left", "right"):
                last, previous = _number(f"{side}_{end}"), _number(f"{side}_{before}")
                limbs.append((last, sum(len(each) for each in points)))
                points.append(at[[last]] + fraction * (at[[last]] - at[[previous]]))
        return cls(np.concatenate(points), np.array(limbs), np.array([*limbs, *_braces()]))

    def name(self, segment: int) -> str:
        """Returns the name of an inner segment: the joint where it begins."""
        return JOINT_NAMES[int(self.inner[segment, 0])]

    def path(self, end: str) -> Int[np.ndarray, " limbs"]:
        """Returns 1 for each limb between the pelvis and an end: `crown`, `left_hand` (its finger tips), or a joint."""
        tips = {"crown": 0, "left_hand": 1, "right_hand": 2}
        point = len(JOINT_NAMES) + tips[end] if end in tips else _number(end)
        on_path = np.zeros(len(self.limbs), np.int64)
        while point != _number("pelvis"):
            limb = int(np.flatnonzero(self.limbs[:, 1] == point)[0])
            on_path[limb], point = 1, int(self.limbs[limb, 0])
        return on_path

    def nearest(self, points: Float[np.ndarray, "queries 3"]) -> Float[np.ndarray, "queries 3"]:
        """Returns the nearest point of the limbs for each point [m]."""
        start, end = self.points[self.limbs[:, 0]], self.points[self.limbs[:, 1]]
        directions = end - start
        queries = np.asarray(points, np.float64)[:, None]
        squares = np.maximum((directions * directions).sum(axis=1), 1e-12)
        fraction = np.clip(((queries - start) * directions).sum(axis=2) / squares, 0, 1)
        on = start + fraction[:, :, None] * directions
        return on[np.arange(len(on)), np.linalg.norm(queries - on, axis=2).argmin(axis=1)]

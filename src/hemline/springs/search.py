"""The search for constants with which spring bones move as simulated cloth does and stay in front of the legs."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int

from .constants import SpringConstants
from .net import Net
from .spring_bones import CapsuleColliders, SpringChains
from .swing import SkeletonMotion, swing

FRONT_WEIGHT = 3.0
"""Error that is accepted to bring one percent of the skin behind the cloth [mm]."""
SAG_WEIGHT = 3.5
"""Weight of the distance by which the garment hangs from its drape when the body stands [1]."""
_STANDING_FRAMES = 90
"""Frames in which the chains come to rest in the T-pose."""
ROUNDS, LIMIT_ROUNDS = 140, 30
"""Largest number of constants that are tried without limits, and of limits."""
SKIN_EVERY = 10
"""Frames from one comparison with the skin to the next."""
_PER_FRAME = 2
"""Frames of the engine for each frame of the takes: 60 and 30 a second."""
_FREE_STEPS = (1.0, -1.5, 0.5, 1.0, -1.0, 0.5, 0.0, 0.0, 0.5)
_LIMIT_STEPS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.7, 0.7, 0.0)
"""First steps of both searches for each of the numbers of `_numbers`."""


class SpringTarget(NamedTuple):
    """A section of a simulated take, to which spring bones are tuned."""

    skeleton: SkeletonMotion
    """The body at 60 frames a second, with frames before the section in which the chains come to rest."""
    bones: Float[np.ndarray, "frames bones 3"]
    """The bones on the simulated cloth at 30 frames a second, of the last frames of the skeleton [m]."""
    skin: Float[np.ndarray, "tenths points 6"]
    """Points of the skin below the garment [m] with their normals, in every tenth frame of the bones."""


def tune(
    chains: SpringChains,
    capsules: CapsuleColliders,
    legs: Sequence[int],
    targets: Sequence[SpringTarget],
    pairs: Int[np.ndarray, "pairs 2"],
    start: SpringConstants,
    progress: Callable[[int, int], None] = lambda done, count: None,
) -> tuple[SpringConstants, dict[str, float]]:
    """Searches the constants with which spring bones are closest to simulated takes.

    Players without `VRMC_springBone_limit` ignore the limits, so the other constants are searched without limits, and
    the limits for them. What is minimised is the mean distance of the bones to the simulated ones [mm], plus
    `FRONT_WEIGHT` times the percentage of the skin behind the simulated cloth that is in front of the played one
    (`net.LEAST_SHOWING`), plus `SAG_WEIGHT` times the distance by which the bones hang from rest in the T-pose [mm].

    Args:
        chains: The chains at rest.
        capsules: The capsules at rest.
        legs: Joints of the legs.
        targets: The takes.
        pairs: Bones of neighbouring chains, side by side.
        start: Constants with which the search begins.
        progress: Called with the number of constants tried and that of all.

    Returns:
        The constants, and the figures `springs_error_mm` and `springs_skin_percent` of the takes without limits, and
        `limited_springs_error_mm` and `limited_springs_skin_percent` with them.

    Source: Nelder, Mead, "A Simplex Method for Function Minimization", 1965.
    """
    comparison = SpringComparison(chains, capsules, legs, targets, pairs)
    count = LIMIT_ROUNDS + ROUNDS
    free = replace(start, inward=np.pi, sideways=np.pi)
    found = _search(comparison, free, _FREE_STEPS, ROUNDS, lambda done: progress(done, count))
    limited = replace(found, inward=start.inward, sideways=start.sideways)
    limited = _search(comparison, limited, _LIMIT_STEPS, LIMIT_ROUNDS, lambda done: progress(ROUNDS + done, count))
    figures = {}
    for name, constants in (("springs", found), ("limited_springs", limited)):
        error, front = comparison(constants)
        figures |= {f"{name}_error_mm": error, f"{name}_skin_percent": front}
    return limited, figures


def _search(
    comparison: "SpringComparison",
    start: SpringConstants,
    steps: tuple[float, ...],
    rounds: int,
    progress: Callable[[int], None],
) -> SpringConstants:
    """Returns the best constants that a simplex search finds; numbers with a step of 0 stay."""
    from scipy.optimize import minimize

    first = _numbers(start)
    moving, tried = np.flatnonzero(steps), [0]

    def constants_at(moved: np.ndarray) -> SpringConstants:
        numbers = first.copy()
        numbers[moving] = moved
        return _constants(numbers)

    def loss(moved: np.ndarray) -> float:
        error, front = comparison(constants_at(moved))
        tried[0] += 1
        progress(min(tried[0], rounds))
        return error + FRONT_WEIGHT * front + SAG_WEIGHT * comparison.sag_mm(constants_at(moved))

    simplex = np.stack([first[moving], *(first[moving] + step for step in np.diag(np.array(steps)[moving]))])
    options = {"maxfev": rounds, "initial_simplex": simplex}
    return constants_at(minimize(loss, first[moving], method="Nelder-Mead", options=options).x)


class SpringComparison:
    """Tells how far spring bones with some constants are from takes, and how much skin comes in front of the cloth.

    Args:
        chains: The chains at rest.
        capsules: The capsules at rest.
        legs: Joints of the legs.
        targets: The takes.
        pairs: Bones of neighbouring chains, side by side.
    """

    def __init__(
        self,
        chains: SpringChains,
        capsules: CapsuleColliders,
        legs: Sequence[int],
        targets: Sequence[SpringTarget],
        pairs: Int[np.ndarray, "pairs 2"],
    ):
        self.chains, self.capsules, self.legs, self.targets = chains, capsules, legs, targets
        self.net = Net.of(chains, pairs)
        rest = targets[0].skeleton.rest
        turns = np.tile(np.eye(3), (_STANDING_FRAMES, len(rest), 1, 1))
        self.standing = SkeletonMotion(rest, np.tile(rest, (_STANDING_FRAMES, 1, 1)), turns)
        self.covered = [
            [
                self.net.behind(bones, skin)[0]
                for bones, skin in zip(target.bones[::SKIN_EVERY], target.skin, strict=True)
            ]
            if self.net
            else []
            for target in targets
        ]

    def __call__(self, constants: SpringConstants) -> tuple[float, float]:
        """Returns the mean distance of the bones [mm], and the percentage of covered skin in front of the cloth."""
        chains, capsules = constants.apply(self.chains, self.capsules, self.legs)
        errors, front, all_covered = [], 0, 0
        for target, covered in zip(self.targets, self.covered, strict=True):
            moved, _ = swing(chains, capsules, target.skeleton)
            played = moved[len(moved) - 1 - _PER_FRAME * (len(target.bones) - 1) :: _PER_FRAME]
            errors.append(1000 * np.linalg.norm(played - target.bones, axis=-1).mean())
            for bones, skin, behind in zip(played[::SKIN_EVERY], target.skin, covered, strict=self.net is not None):
                front += int((self.net.behind(bones, skin)[1] & behind).sum())
                all_covered += int(behind.sum())
        return float(np.mean(errors)), 100 * front / max(all_covered, 1)

    def sag_mm(self, constants: SpringConstants) -> float:
        """Returns the mean distance of the bones from rest after they have hung still in the T-pose [mm]."""
        chains, capsules = constants.apply(self.chains, self.capsules, self.legs)
        hung, _ = swing(chains, capsules, self.standing)
        return float(1000 * np.linalg.norm(hung[-1] - chains.bones, axis=-1).mean())


def _numbers(constants: SpringConstants) -> Float[np.ndarray, "9"]:
    drag = np.clip(constants.drag, 1e-4, 1 - 1e-4)
    others = (constants.radius, constants.inward, constants.sideways, constants.leg_radius)
    return np.array([*np.log([*constants.stiffness, constants.gravity]), *np.log(drag / (1 - drag)), *np.log(others)])


def _constants(numbers: Float[np.ndarray, "9"]) -> SpringConstants:
    bounded = np.clip(numbers, -14.0, 14.0)
    root, tip, gravity = np.exp(bounded[:3]).tolist()
    first, last = (1 / (1 + np.exp(-bounded[3:5]))).tolist()
    radius, inward, sideways, leg_radius = np.exp(bounded[5:]).tolist()
    return SpringConstants(
        stiffness=(root, tip),
        gravity=gravity,
        drag=(first, last),
        radius=min(radius, 0.1),
        inward=min(inward, np.pi),
        sideways=min(sideways, np.pi),
        leg_radius=min(leg_radius, 1.0),
    )

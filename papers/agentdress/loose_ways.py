"""Ways to move a loose garment on a body that it was not fitted on: small animators that claims compare."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from hemline import bodies
from hemline.animators import Animator
from hemline.arrays import Vertices
from hemline.bodies import PosedBody
from hemline.datasets import Take
from hemline.garments import Garment
from hemline.garments.cut.skirt import LIGHT_SIZE, PAPER_SIZE
from hemline.learning.key_frame import to_key
from hemline.motions import JOINT_NAMES


@dataclass(frozen=True, eq=False)
class Carried:
    """What several ways have in common: a garment, and the names that an animator has."""

    garment: Garment
    figures: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    name = "claim"

    @property
    def body_name(self) -> str:
        """As of the garment."""
        return self.garment.body_name

    @property
    def body_hash(self) -> str:
        """Of that body."""
        return bodies.load(self.body_name).hash

    @cached_property
    def key(self) -> int:
        """Its key joint."""
        return JOINT_NAMES.index(self.garment.key_joint)

    def save(self, path: str | Path) -> None:
        """Nobody keeps it."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Simulated(Carried):
    """A take on the body that it was simulated on, a frame a step."""

    take: Take

    def start(self, posed: PosedBody) -> int:
        """Before the first frame."""
        return -1

    def step(self, state: int, posed: PosedBody, dt: float) -> tuple[int, Vertices]:
        """The next frame, wherever that body stands."""
        moved = posed.pose.translation - self.take.motion[state + 1].translation
        return state + 1, self.take.vertices[state + 1] + moved


@dataclass(frozen=True, eq=False)
class Dressed(Carried):
    """A take carried by the key joint of another body; the garment at rest is moved as the undraped one would be.

    What `AnimatorRopes` does on other shapes, with the simulation in the place of its ropes.
    """

    take: Take
    changed: bool = True
    """Whether the garment at rest is moved at all."""

    def start(self, posed: PosedBody) -> tuple[int, Vertices]:
        """Before the first frame; how the garment at rest is moved [m]."""
        worn = self.garment.dressed(posed.shaped) if self.changed else self.garment
        return -1, worn.vertices - self.garment.vertices

    def step(self, state: tuple[int, Vertices], posed: PosedBody, dt: float) -> tuple[Any, Vertices]:
        """The next frame."""
        index, change = state[0] + 1, state[1]
        mean = bodies.load(self.body_name).shaped().posed(self.take.motion[index])
        there = to_key(mean.transforms[self.key], self.take.vertices[index]) + change
        key = posed.transforms[self.key]
        return (index, change), (there @ key[:, :3].T + key[:, 3]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class OnGrid(Carried):
    """The skirt of 18,546 vertices, shown at the vertices of the light one: at the same places of the same cut."""

    full: Animator

    def start(self, posed: PosedBody) -> Any:
        """As of the full one."""
        return self.full.start(posed)

    def step(self, state: Any, posed: PosedBody, dt: float) -> tuple[Any, Vertices]:
        """As of the full one."""
        after, vertices = self.full.step(state, posed, dt)
        return after, (self._places @ vertices.astype(np.float64)).astype(np.float32)

    @cached_property
    def _places(self) -> csr_array:
        return grid_places(PAPER_SIZE, LIGHT_SIZE)


def grid_places(fine: tuple[int, int], coarse: tuple[int, int]) -> csr_array:
    """Weights that take vertices of one skirt to those of another, rows and columns of each given (bilinear).

    Rows below the pinned band are evenly spaced on both, columns go round.
    """
    (rows, columns), (fewer, narrower) = fine, coarse
    down = np.r_[0.0, 1 + np.arange(fewer - 1) * (rows - 2) / (fewer - 2)]
    round_ = np.arange(narrower) * columns / narrower
    row, column = (each.ravel() for each in np.meshgrid(down, round_, indexing="ij"))
    upper, left = np.minimum(row.astype(int), rows - 2), column.astype(int)
    below, right = row - upper, column - left
    entries = []
    for one, by_row in ((0, 1 - below), (1, below)):
        for other, by_column in ((0, 1 - right), (1, right)):
            entries.append(((upper + one) * columns + (left + other) % columns, by_row * by_column))
    index, weight = (np.concatenate(each) for each in zip(*entries, strict=True))
    places = np.tile(np.arange(len(row)), 4)
    return csr_array((weight, (places, index)), (len(row), rows * columns))

"""Small animators that move a loose garment on a body that it was not fitted to, for comparison."""

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
from hemline.learning.key_frame import to_key_frame
from hemline.motions import JOINT_NAMES


@dataclass(frozen=True, eq=False)
class GarmentAnimator:
    """Common attributes of these animators."""

    garment: Garment
    figures: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    name = "experiment"

    @property
    def body_name(self) -> str:
        """Name of the body of the garment."""
        return self.garment.body_name

    @property
    def body_hash(self) -> str:
        """Hash of that body."""
        return bodies.load(self.body_name).hash

    @cached_property
    def key(self) -> int:
        """Index of the key joint."""
        return JOINT_NAMES.index(self.garment.key_joint)

    def save(self, path: str | Path) -> None:
        """Raises NotImplementedError, as these animators are not saved."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class PlaySimulation(GarmentAnimator):
    """Plays a take on the body that it was simulated on, one frame per step."""

    take: Take

    def start(self, posed: PosedBody) -> int:
        """Returns the state before the first frame."""
        return -1

    def step(self, state: int, posed: PosedBody, dt: float) -> tuple[int, Vertices]:
        """Returns the next frame, moved to the place of the body."""
        shift = posed.pose.translation - self.take.motion[state + 1].translation
        return state + 1, self.take.vertices[state + 1] + shift


@dataclass(frozen=True, eq=False)
class DressSimulation(GarmentAnimator):
    """Plays a take on another body, carried by the key joint, with the rest garment fitted to the other body.

    `AnimatorRopes` treats other shapes in this way, with ropes instead of the simulation.
    """

    take: Take
    changed: bool = True
    """Whether the rest garment is fitted to the other body."""

    def start(self, posed: PosedBody) -> tuple[int, Vertices]:
        """Returns the state before the first frame, with the change of the rest garment [m]."""
        garment = self.garment.dressed(posed.shaped) if self.changed else self.garment
        return -1, garment.vertices - self.garment.vertices

    def step(self, state: tuple[int, Vertices], posed: PosedBody, dt: float) -> tuple[Any, Vertices]:
        """Returns the next frame."""
        index, change = state[0] + 1, state[1]
        mean = bodies.load(self.body_name).shaped().posed(self.take.motion[index])
        relative = to_key_frame(mean.transforms[self.key], self.take.vertices[index]) + change
        key = posed.transforms[self.key]
        return (index, change), (relative @ key[:, :3].T + key[:, 3]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class OnLightSkirt(GarmentAnimator):
    """Plays the skirt of 18,546 vertices, sampled at the vertices of the light skirt of the same cut."""

    full: Animator

    def start(self, posed: PosedBody) -> Any:
        """Returns the first state of the full animator."""
        return self.full.start(posed)

    def step(self, state: Any, posed: PosedBody, dt: float) -> tuple[Any, Vertices]:
        """Steps the full animator and samples its vertices."""
        after, vertices = self.full.step(state, posed, dt)
        return after, (self._sampling @ vertices.astype(np.float64)).astype(np.float32)

    @cached_property
    def _sampling(self) -> csr_array:
        return grid_sampling(PAPER_SIZE, LIGHT_SIZE)


def grid_sampling(fine: tuple[int, int], coarse: tuple[int, int]) -> csr_array:
    """Returns bilinear weights from the vertices of one skirt to those of another, given rows and columns of each.

    Rows below the pinned band are evenly spaced on both skirts; columns are periodic.
    """
    (rows, columns), (fewer, narrower) = fine, coarse
    down = np.r_[0.0, 1 + np.arange(fewer - 1) * (rows - 2) / (fewer - 2)]
    around = np.arange(narrower) * columns / narrower
    row, column = (each.ravel() for each in np.meshgrid(down, around, indexing="ij"))
    upper, left = np.minimum(row.astype(int), rows - 2), column.astype(int)
    below, right = row - upper, column - left
    entries = []
    for one, by_row in ((0, 1 - below), (1, below)):
        for other, by_column in ((0, 1 - right), (1, right)):
            entries.append(((upper + one) * columns + (left + other) % columns, by_row * by_column))
    index, weight = (np.concatenate(each) for each in zip(*entries, strict=True))
    places = np.tile(np.arange(len(row)), 4)
    return csr_array((weight, (places, index)), (len(row), rows * columns))

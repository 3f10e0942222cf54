"""A close-fitting garment of fewer vertices, for far from the camera."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from hemline.animators.base import Animator, Bounded, Detailed, Redressing, Settled
from hemline.animators.level import LevelOf
from hemline.arrays import Int, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.garments import Garment

from .state import AgentDressState


class SettledAnimator(Animator, Bounded, Detailed, Redressing, Settled, Protocol):
    """What a level asks of the animator that it is of."""


@dataclass(frozen=True, eq=False)
class AnimatorAgentDressLevel(LevelOf):
    """An `AnimatorAgentDress` at a lower level of detail. Its States are those of the full one.

    Attributes:
        full: The animator.
        garment: The garment that is left.
        kept: Which vertex of the full garment each of its vertices is.
        part: The animator's tables of these vertices; its States are never handed out.
    """

    full: SettledAnimator
    garment: Garment
    kept: Int[np.ndarray, " kept"]
    part: SettledAnimator

    @property
    def beta_range(self) -> tuple[float, float]:
        """As of the full animator."""
        return self.full.beta_range

    @property
    def novelty_limit(self) -> float:
        """As of the full animator."""
        return self.full.novelty_limit

    def novelty(self, state: AgentDressState) -> float:
        """As of the full animator."""
        return self.full.novelty(state)

    def start(self, posed: PosedBody) -> AgentDressState:
        """As of the full animator."""
        return self.full.start(posed)

    def step(self, state: AgentDressState, posed: PosedBody, dt: float) -> tuple[AgentDressState, Vertices]:
        """As of the full animator, for the vertices that are left."""
        moved, vertices = self.part.step(self._at_vertices(state), posed, dt)
        return replace(state, axes=moved.axes, distances=moved.distances), vertices

    def redress(
        self, state: AgentDressState, posed: PosedBody, dt: float, worn: Vertices, nominal: PosedBody
    ) -> tuple[AgentDressState, Vertices]:
        """As of the full animator; `worn` is the full garment."""
        moved, vertices = self.part.redress(self._at_vertices(state), posed, dt, worn[self.kept], nominal)
        return replace(state, axes=moved.axes, distances=moved.distances), vertices

    def settled(self, posed: PosedBody) -> Vertices:
        """As of the full animator, for the vertices that are left."""
        return self.full.settled(posed)[self.kept]

    def at_rest(self, state: AgentDressState) -> Vertices:
        """As of the full animator, for the vertices that are left."""
        return self.full.at_rest(state)[self.kept]

    def reshaped(self, state: AgentDressState, shaped: ShapedBody) -> AgentDressState:
        """As of the full animator."""
        return self.full.reshaped(state, shaped)

    def _at_vertices(self, state: AgentDressState) -> AgentDressState:
        return replace(state, rest=state.rest[self.kept], normals=state.normals[self.kept])

"""Lower levels of detail of a close-fitting garment, for use far from the camera."""

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
    """The protocols that a level needs of its full animator."""


@dataclass(frozen=True, eq=False)
class AnimatorAgentDressLevel(LevelOf):
    """An `AnimatorAgentDress` at a lower level of detail. It shares the States of the full animator.

    Attributes:
        full: The full animator.
        garment: The garment with fewer vertices.
        kept: Index in the full garment of each vertex.
        reduced: The animator restricted to these vertices; its own States are never handed out.
    """

    full: SettledAnimator
    garment: Garment
    vertex_ids: Int[np.ndarray, " kept"]
    reduced: SettledAnimator

    @property
    def beta_range(self) -> tuple[float, float]:
        """Reliable range of each beta, from the full animator."""
        return self.full.beta_range

    @property
    def novelty_limit(self) -> float:
        """Novelty limit of the full animator."""
        return self.full.novelty_limit

    @property
    def stretch_limit(self) -> float:
        """Stretch limit of the full animator."""
        return self.full.stretch_limit

    def novelty(self, state: AgentDressState) -> float:
        """Returns the novelty that the full animator computes."""
        return self.full.novelty(state)

    def start(self, posed: PosedBody) -> AgentDressState:
        """Returns the first State of the full animator."""
        return self.full.start(posed)

    def step(self, state: AgentDressState, posed: PosedBody, dt: float) -> tuple[AgentDressState, Vertices]:
        """Advances to a pose; see `AnimatorAgentDress.step`. Returns the kept vertices only."""
        moved, vertices = self.reduced.step(self._at_vertices(state), posed, dt)
        return replace(state, axes=moved.axes, distances=moved.distances), vertices

    def redress(
        self, state: AgentDressState, posed: PosedBody, dt: float, worn: Vertices, nominal: PosedBody
    ) -> tuple[AgentDressState, Vertices]:
        """Advances to a pose; see `AnimatorAgentDress.redress`. `worn` is the full garment."""
        moved, vertices = self.reduced.redress(self._at_vertices(state), posed, dt, worn[self.vertex_ids], nominal)
        return replace(state, axes=moved.axes, distances=moved.distances), vertices

    def drape(self, posed: PosedBody) -> Vertices:
        """Returns the kept vertices of the garment that the full animator predicts without history."""
        return self.full.drape(posed)[self.vertex_ids]

    def at_rest(self, state: AgentDressState, shaped: ShapedBody) -> Vertices:
        """Returns the kept vertices of the garment in the rest pose."""
        return self.full.at_rest(state, shaped)[self.vertex_ids]

    def reshape(self, state: AgentDressState, shaped: ShapedBody) -> AgentDressState:
        """Returns the State on a body of another shape; see `AnimatorAgentDress.reshape`."""
        return self.full.reshape(state, shaped)

    def _at_vertices(self, state: AgentDressState) -> AgentDressState:
        return replace(state, rest=state.rest[self.vertex_ids])

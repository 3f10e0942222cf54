"""A close-fitting garment of fewer vertices, for far from the camera."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from hemline.animators.base import Animator, Bounded, Detailed, Redressing, Settled
from hemline.arrays import Int, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.garments import Garment

from .state import AgentDressState


class SettledAnimator(Animator, Bounded, Detailed, Redressing, Settled, Protocol):
    """What a level asks of the animator that it is of."""


@dataclass(frozen=True, eq=False)
class AnimatorAgentDressLevel:
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
    def name(self) -> str:
        """As of the full animator."""
        return self.full.name

    @property
    def body_name(self) -> str:
        """As of the full animator."""
        return self.full.body_name

    @property
    def body_hash(self) -> str:
        """As of the full animator."""
        return self.full.body_hash

    @property
    def figures(self) -> Mapping[str, float]:
        """What the fit of the full animator reached."""
        return self.full.figures

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
        moved, vertices = self.part.step(self._seen(state), posed, dt)
        return replace(state, distances=moved.distances), vertices

    def redress(
        self, state: AgentDressState, posed: PosedBody, dt: float, worn: Vertices, nominal: PosedBody
    ) -> tuple[AgentDressState, Vertices]:
        """As of the full animator; `worn` is the full garment."""
        moved, vertices = self.part.redress(self._seen(state), posed, dt, worn[self.kept], nominal)
        return replace(state, distances=moved.distances), vertices

    def settled(self, posed: PosedBody) -> Vertices:
        """As of the full animator, for the vertices that are left."""
        return self.full.settled(posed)[self.kept]

    def reshaped(self, state: AgentDressState, shaped: ShapedBody) -> AgentDressState:
        """As of the full animator."""
        return self.full.reshaped(state, shaped)

    def at_detail(self, detail: float) -> Animator:
        """Another level of the full animator."""
        return self.full.at_detail(detail)

    def save(self, path: str | Path) -> None:
        """Write the model file of the full animator, which all levels are made from."""
        self.full.save(path)

    def _seen(self, state: AgentDressState) -> AgentDressState:
        return replace(state, rest=state.rest[self.kept], normals=state.normals[self.kept])

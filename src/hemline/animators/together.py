"""Several animators as one: each moves a garment of its own on the same body."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.errors import BadInput
from hemline.garments import Garment, worn_together

from .base import Animator, Bounded, Movable
from .teleport import RigidTransform


@dataclass(frozen=True, eq=False)
class AnimatorTogether:
    """Animators whose garments are worn together; the `Player` keeps each garment out of those beneath it.

    Attributes:
        parts: From the skin outwards. Make it with `together`.

    Raises:
        BadInput: Fewer than two, one garment twice, or fitted on two bodies.
    """

    parts: tuple[Animator, ...]
    name = "together"

    def __post_init__(self) -> None:
        """Refuse what cannot be worn together."""
        if len(self.parts) < 2:
            raise BadInput("garments worn together are two at least", len(self.parts), "name one over the other")
        first = self.parts[0]
        for at, part in enumerate(self.parts):
            if part.body_hash != first.body_hash:
                got = f"'{first.garment.name}' on {first.body_name}, '{part.garment.name}' on {part.body_name}"
                if part.body_name == first.body_name:
                    got += " of another make"
                raise BadInput("garments worn together must be fitted on the same body", got, "fit both on one")
            if any(part.garment.hash == other.garment.hash for other in self.parts[:at]):
                cure = "name another one to wear over it"
                raise BadInput("a garment cannot be worn over itself", f"'{part.garment.name}' twice", cure)

    @property
    def garment(self) -> Garment:
        """All of them as one, in pieces."""
        return self._garment

    @cached_property
    def _garment(self) -> Garment:
        return worn_together([part.garment for part in self.parts])

    @property
    def body_name(self) -> str:
        """Name of the body of all."""
        return self.parts[0].body_name

    @property
    def body_hash(self) -> str:
        """Hash of that body."""
        return self.parts[0].body_hash

    @property
    def figures(self) -> Mapping[str, float]:
        """Those of all fits, each after the name of its garment."""
        return {f"{part.garment.name}_{name}": value for part in self.parts for name, value in part.figures.items()}

    def start(self, posed: PosedBody) -> tuple[Any, ...]:
        """The State of each, at rest on a body in its first pose; raises BadInput for another body."""
        return tuple(part.start(posed) for part in self.parts)

    def step(self, state: tuple[Any, ...], posed: PosedBody, dt: float) -> tuple[tuple[Any, ...], Vertices]:
        """Advance to a pose.

        Args:
            state: The States before; they are not changed.
            posed: The body now.
            dt: Time since then [s].

        Returns:
            The States after, and the vertices of all garments in the world (verts, 3) [m].
        """
        done = [part.step(each, posed, dt) for part, each in zip(self.parts, state, strict=True)]
        return tuple(each for each, _ in done), np.concatenate([vertices for _, vertices in done])

    def relocate(self, state: tuple[Any, ...], shaped: ShapedBody, way: RigidTransform) -> tuple[Any, ...]:
        """The States put elsewhere, where all of the animators are `Movable`."""
        pairs = zip(self.parts, state, strict=True)
        return tuple(part.relocate(each, shaped, way) if isinstance(part, Movable) else each for part, each in pairs)

    def save(self, path: str | Path) -> None:
        """Refused: they are model files of their own.

        Raises:
            BadInput: Always.
        """
        raise BadInput("animators of garments worn together are saved one by one", f"'{path}'", "save `parts`")


@dataclass(frozen=True, eq=False)
class AnimatorTogetherBounded(AnimatorTogether):
    """The same where some of them know how far they can be believed: `Bounded` by those."""

    @property
    def _parts_with_bounds(self) -> list[tuple[int, Bounded]]:
        return [(at, part) for at, part in enumerate(self.parts) if isinstance(part, Bounded)]

    @property
    def beta_range(self) -> tuple[float, float]:
        """Where all of them are believed."""
        ranges = [part.beta_range for _, part in self._parts_with_bounds]
        return max(low for low, _ in ranges), min(high for _, high in ranges)

    @property
    def novelty_limit(self) -> float:
        """1: the novelty is counted in the limits of each."""
        return 1.0

    def novelty(self, state: tuple[Any, ...]) -> float:
        """The largest of their novelties, each over its limit."""
        return max((part.novelty(state[at]) / part.novelty_limit for at, part in self._parts_with_bounds), default=math.nan)


def together(parts: Sequence[Animator]) -> AnimatorTogether:
    """Animators as one, their garments worn one over the other.

    Args:
        parts: From the skin outwards.

    Returns:
        An animator; `Bounded` where one of them is.

    Raises:
        BadInput: As `AnimatorTogether`.
    """
    bounded = any(isinstance(part, Bounded) for part in parts)
    return (AnimatorTogetherBounded if bounded else AnimatorTogether)(tuple(parts))

"""Several animators as one. Each moves its own garment on the same body."""

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
from hemline.garments import Garment, wear_together

from .base import Animator, Bounded, Movable
from .rigid_transform import RigidTransform


@dataclass(frozen=True, eq=False)
class AnimatorTogether:
    """Animators whose garments are worn together; the `Player` keeps each garment out of those beneath it.

    Attributes:
        parts: The animators, from the skin outwards. Use `together` to combine them.

    Raises:
        BadInput: There are fewer than two animators, two of one garment, or two that were fitted on different bodies.
    """

    parts: tuple[Animator, ...]
    name = "together"

    def __post_init__(self) -> None:
        """Refuses animators whose garments cannot be worn together."""
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
        """All garments as one garment in several pieces."""
        return self._garment

    @cached_property
    def _garment(self) -> Garment:
        return wear_together([part.garment for part in self.parts])

    @property
    def body_name(self) -> str:
        """Name of the body that all garments were fitted on."""
        return self.parts[0].body_name

    @property
    def body_hash(self) -> str:
        """Hash of that body."""
        return self.parts[0].body_hash

    @property
    def figures(self) -> Mapping[str, float]:
        """Figures of all fits; each name begins with the name of the garment."""
        return {f"{part.garment.name}_{name}": value for part in self.parts for name, value in part.figures.items()}

    def start(self, posed: PosedBody) -> tuple[Any, ...]:
        """Returns the States of all animators at rest on a body in its first pose; raises BadInput for another body."""
        return tuple(part.start(posed) for part in self.parts)

    def step(self, state: tuple[Any, ...], posed: PosedBody, dt: float) -> tuple[tuple[Any, ...], Vertices]:
        """Advances to a pose.

        Args:
            state: The States before; they are not changed.
            posed: The body now.
            dt: Time since those States [s].

        Returns:
            The States after, and the vertices of all garments in the world (verts, 3) [m].
        """
        done = [part.step(each, posed, dt) for part, each in zip(self.parts, state, strict=True)]
        return tuple(each for each, _ in done), np.concatenate([vertices for _, vertices in done])

    def relocate(self, state: tuple[Any, ...], shaped: ShapedBody, transform: RigidTransform) -> tuple[Any, ...]:
        """Relocates the States of all animators that are `Movable`."""
        return tuple(
            part.relocate(each, shaped, transform) if isinstance(part, Movable) else each
            for part, each in zip(self.parts, state, strict=True)
        )

    def save(self, path: str | Path) -> None:
        """Refuses to save, since each animator has a model file of its own.

        Raises:
            BadInput: Always.
        """
        raise BadInput("animators of garments worn together are saved one by one", f"'{path}'", "save `parts`")


@dataclass(frozen=True, eq=False)
class AnimatorTogetherBounded(AnimatorTogether):
    """Animators worn together of which at least one is `Bounded`; its bounds are those of all."""

    @property
    def _parts_with_bounds(self) -> list[tuple[int, Bounded]]:
        return [(at, part) for at, part in enumerate(self.parts) if isinstance(part, Bounded)]

    @property
    def beta_range(self) -> tuple[float, float]:
        """Lowest and highest value of each beta for which all fits are valid."""
        ranges = [part.beta_range for _, part in self._parts_with_bounds]
        return max(low for low, _ in ranges), min(high for _, high in ranges)

    @property
    def novelty_limit(self) -> float:
        """Always 1, since the novelty of each animator is divided by its own limit."""
        return 1.0

    def novelty(self, state: tuple[Any, ...]) -> float:
        """Returns the largest novelty of all animators, each divided by its own limit."""
        ratios = (part.novelty(state[at]) / part.novelty_limit for at, part in self._parts_with_bounds)
        return max(ratios, default=math.nan)


def together(parts: Sequence[Animator]) -> AnimatorTogether:
    """Combines animators whose garments are worn one over the other.

    Args:
        parts: The animators, from the skin outwards.

    Returns:
        One animator, which is `Bounded` if one of them is.

    Raises:
        BadInput: There are fewer than two animators, two of one garment, or two that were fitted on different bodies.
    """
    bounded = any(isinstance(part, Bounded) for part in parts)
    return (AnimatorTogetherBounded if bounded else AnimatorTogether)(tuple(parts))

"""A model of rope chains with another source of bones, or another skin: played and judged as the model itself is."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hemline.animators.ropes.bones.bones import seen_bones
from hemline.animators.ropes.model import AnimatorRopes
from hemline.arrays import Float, Nodes, Transforms, Vertices
from hemline.bodies.body import PosedBody
from hemline.errors import BadOutput
from hemline.garments.garment import Garment
from hemline.learning.key_frame import to_key

Moved = Float[np.ndarray, " ins"]
"""Displacements of all bones from rest in the frame of the key joint, float32 [m]."""


class Source(Protocol):
    """Where bones come from, as `bone_source.BoneSource`."""

    def start(self, posed: PosedBody) -> Any:
        """The state at rest on a body."""
        ...

    def step(self, state: Any, posed: PosedBody, dt: float, rest: Nodes) -> tuple[Any, Moved]:
        """The state after `dt` seconds, and where the bones are; `rest`: all bones in the rest drape [m]."""
        ...


class Skin(Protocol):
    """What turns bones into the garment."""

    def vertices(self, moved: Moved, rest: Vertices, bones: Nodes, key: Transforms) -> Vertices:
        """The garment in the world [m], from its rest drape, the bones in that, and the key joint's transform."""
        ...


@dataclass(frozen=True, eq=False)
class NetworkSkin:
    """The model's own networks and bases."""

    model: AnimatorRopes

    def vertices(self, moved: Moved, rest: Vertices, bones: Nodes, key: Transforms) -> Vertices:
        """See `Skin.vertices`."""
        coefficients = np.concatenate([self.model.skinning(moved), self.model.shape(moved)])
        return self.model.basis.vertices(coefficients, rest, key)


@dataclass(frozen=True, eq=False)
class BaselineState:
    """All that moves."""

    source: Any
    rest: Vertices
    bones: Nodes
    """All bones in the rest drape on this body's shape [m]."""


@dataclass(frozen=True, eq=False)
class Baseline:
    """An animator made of a model and a part that takes the place of one of the model's own.

    It plays wherever an animator does (`evaluate`, `Player`); it is not in the registry and has no file.
    """

    model: AnimatorRopes
    name: str
    source: Source
    skin: Skin

    @classmethod
    def of(
        cls, model: AnimatorRopes, name: str, *, source: Source | None = None, skin: Skin | None = None
    ) -> "Baseline":
        """With the model's own source of bones and networks where none is given."""
        return cls(model, name, source or model.source, skin or NetworkSkin(model))

    @property
    def garment(self) -> Garment:
        """The model's."""
        return self.model.garment

    @property
    def body_name(self) -> str:
        """The model's."""
        return self.model.body_name

    @property
    def body_hash(self) -> str:
        """The model's."""
        return self.model.body_hash

    @property
    def figures(self) -> dict[str, float]:
        """None: it was not fitted."""
        return {}

    def start(self, posed: PosedBody) -> BaselineState:
        """At rest on a body; raises BadInput for another kind of body."""
        at_rest = self.model.start(posed)
        return BaselineState(self.source.start(posed), at_rest.rest, at_rest.rest_bones)

    def step(self, state: BaselineState, posed: PosedBody, dt: float) -> tuple[BaselineState, Vertices]:
        """Advance to a pose; as `AnimatorRopes.step`."""
        moving, moved = self.source.step(state.source, posed, dt, state.bones)
        return replace(state, source=moving), self._skinned(state, posed, moved)

    def follow(
        self, state: BaselineState, posed: PosedBody, dt: float, truth: Vertices
    ) -> tuple[BaselineState, Vertices]:
        """As `step`, driven by the bones of simulated vertices."""
        bones = seen_bones(self.model.ropes, truth, posed)
        moved = to_key(posed.transforms[self.model.key], bones) - state.bones
        return state, self._skinned(state, posed, moved.astype(np.float32).reshape(-1))

    def save(self, path: str | Path) -> None:
        """Always raises BadOutput: a baseline has no file."""
        raise BadOutput("a baseline is not saved", self.name, "save the model that it is made of")

    def _skinned(self, state: BaselineState, posed: PosedBody, moved: Moved) -> Vertices:
        return self.skin.vertices(moved, state.rest, state.bones, posed.transforms[self.model.key])

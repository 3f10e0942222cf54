"""A model of rope chains with another source of bones or another skin, played and evaluated like the model itself."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hemline.animators.ropes.bones.bones import bones_of_mesh
from hemline.animators.ropes.model import AnimatorRopes
from hemline.arrays import Float, Nodes, Transforms, Vertices
from hemline.bodies.body import PosedBody
from hemline.errors import BadOutput
from hemline.garments.garment import Garment
from hemline.learning.key_frame import to_key_frame

Moved = Float[np.ndarray, " ins"]
"""Displacements of all bones from rest in the frame of the key joint, float32 [m]."""


class BoneMotion(Protocol):
    """A source of bones, as `bone_source.BoneSource`."""

    def start(self, posed: PosedBody) -> Any:
        """Returns the state at rest on a body."""
        ...

    def step(self, state: Any, posed: PosedBody, dt: float, rest: Nodes) -> tuple[Any, Moved]:
        """Returns the state after `dt` seconds, and the displacements of all bones from `rest`, the rest drape [m]."""
        ...


class MeshSkin(Protocol):
    """A map from bones to the garment's vertices."""

    def vertices(self, moved: Moved, rest: Vertices, bones: Nodes, key: Transforms) -> Vertices:
        """Returns the garment in the world, from its rest drape, the bones in it, and the key joint's transform [m]."""
        ...


@dataclass(frozen=True, eq=False)
class NetworkSkin:
    """The networks and bases of the model."""

    model: AnimatorRopes

    def vertices(self, moved: Moved, rest: Vertices, bones: Nodes, key: Transforms) -> Vertices:
        """Returns the garment, see `MeshSkin.vertices`."""
        coefficients = np.concatenate([self.model.skinning(moved), self.model.shape(moved)])
        return self.model.basis.vertices(coefficients, rest, key)


@dataclass(frozen=True, eq=False)
class BaselineState:
    """State of a baseline."""

    source: Any
    rest: Vertices
    bones: Nodes
    """All bones in the rest drape on this body's shape [m]."""


@dataclass(frozen=True, eq=False)
class Baseline:
    """An animator made of a model in which one part is replaced.

    It plays wherever an animator does (`evaluate`, `Player`); it is not in the registry and has no file.
    """

    model: AnimatorRopes
    name: str
    source: BoneMotion
    skin: MeshSkin

    @classmethod
    def of(
        cls, model: AnimatorRopes, name: str, *, source: BoneMotion | None = None, skin: MeshSkin | None = None
    ) -> "Baseline":
        """Makes a baseline, with the model's own source of bones and networks unless given."""
        return cls(model, name, source or model.source, skin or NetworkSkin(model))

    @property
    def garment(self) -> Garment:
        """Garment of the model."""
        return self.model.garment

    @property
    def body_name(self) -> str:
        """Name of the model's body."""
        return self.model.body_name

    @property
    def body_hash(self) -> str:
        """Hash of the model's body."""
        return self.model.body_hash

    @property
    def figures(self) -> dict[str, float]:
        """No figures, since a baseline is not fitted."""
        return {}

    def start(self, posed: PosedBody) -> BaselineState:
        """Returns the state at rest on a body; raises BadInput for another body than the model's."""
        at_rest = self.model.start(posed)
        return BaselineState(self.source.start(posed), at_rest.rest, at_rest.rest_bones)

    def step(self, state: BaselineState, posed: PosedBody, dt: float) -> tuple[BaselineState, Vertices]:
        """Advances to a pose, like `AnimatorRopes.step`."""
        moving, moved = self.source.step(state.source, posed, dt, state.bones)
        return replace(state, source=moving), self._mesh(state, posed, moved)

    def follow(
        self, state: BaselineState, posed: PosedBody, dt: float, truth: Vertices
    ) -> tuple[BaselineState, Vertices]:
        """Advances like `step`, driven by the bones of simulated vertices."""
        bones = bones_of_mesh(self.model.ropes, truth, posed)
        moved = to_key_frame(posed.transforms[self.model.key], bones) - state.bones
        return state, self._mesh(state, posed, moved.astype(np.float32).reshape(-1))

    def save(self, path: str | Path) -> None:
        """Always raises BadOutput: a baseline has no file."""
        raise BadOutput("a baseline is not saved", self.name, "save the model that it is made of")

    def _mesh(self, state: BaselineState, posed: PosedBody, moved: Moved) -> Vertices:
        return self.skin.vertices(moved, state.rest, state.bones, posed.transforms[self.model.key])

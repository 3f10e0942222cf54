"""A garment that one animator moves on the body of its fit, put on other shapes by one that knows what shapes do."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hemline import bodies
from hemline.arrays import Float, Int, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.meshes import ClosestTree
from hemline.motions.motion import Pose

from .base import Animator, Movable, Redressing
from .teleport import RigidTransform

MAX_MESH_GAP = 0.02
"""Two meshes of one garment are nowhere farther apart, as they were made [m]."""


@dataclass(frozen=True)
class RedressedState:
    """All that moves."""

    moving: Any
    """Of the animator on the body of the fit."""
    shapes: Any
    """Of the one that knows shapes, on the body that is shown."""


@dataclass(frozen=True, eq=False)
class AnimatorRedressed:
    """Two animators in one: the first swings on the mean body, the second adds what the shape of the body changes.

    The body of the fit goes where the body does, its way as long as its legs are. The second may be of a coarser mesh
    of the garment: what the shape changes is smooth.

    Attributes:
        moving: Fitted on one shape: rope chains, say.
        shapes: Fitted to the same garment on many: `hemline fit --animator agentdress`.

    Raises:
        BadInput: The second does not know shapes, or they are of two garments or two bodies.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 4. Differs: the clothing pose model is an animator with a memory; the paper leaves loose garments out.
    """

    moving: Animator
    shapes: Animator
    name = "redressed"

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        if not isinstance(self.shapes, Redressing):
            raise BadInput(
                "what a body's shape does to a garment is known to models of settled garments",
                f"animator '{self.shapes.name}'",
                "fit one with 'hemline fit --animator agentdress'",
            )
        one, other = self.moving, self.shapes
        apart = [_SurfacePoints.on(a, b).farthest for a, b in ((one.garment, other.garment), (other.garment, one.garment))]
        if max(apart) > MAX_MESH_GAP or one.body_hash != other.body_hash:
            got = f"'{one.garment.name}' on {one.body_name} and '{other.garment.name}' on {other.body_name}"
            raise BadInput("the two animators must be of one garment on the same body", got, "fit both to one garment")

    @property
    def garment(self) -> Garment:
        """The garment of both."""
        return self.moving.garment

    @property
    def body_name(self) -> str:
        """Name of the body of both."""
        return self.moving.body_name

    @property
    def body_hash(self) -> str:
        """Hash of that body."""
        return self.moving.body_hash

    @property
    def figures(self) -> Mapping[str, float]:
        """Those of both fits, `shapes_` before those of the second."""
        return dict(self.moving.figures) | {f"shapes_{name}": value for name, value in self.shapes.figures.items()}

    def start(self, posed: PosedBody) -> RedressedState:
        """At rest on a body of any shape, in its first pose; raises BadInput for another body."""
        return RedressedState(self.moving.start(self._nominal(posed)), self.shapes.start(posed))

    def step(self, state: RedressedState, posed: PosedBody, dt: float) -> tuple[RedressedState, Vertices]:
        """Advance to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State [s].

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        nominal = self._nominal(posed)
        moving, worn = self.moving.step(state.moving, nominal, dt)
        assert isinstance(self.shapes, Redressing)
        if self._mesh_maps is None:
            shapes, vertices = self.shapes.redress(state.shapes, posed, dt, worn, nominal)
            return RedressedState(moving, shapes), vertices
        down, up = self._mesh_maps
        fewer = down.of(worn)
        shapes, there = self.shapes.redress(state.shapes, posed, dt, fewer, nominal)
        return RedressedState(moving, shapes), worn + up.of(there - fewer)

    def relocate(self, state: RedressedState, shaped: ShapedBody, way: RigidTransform) -> RedressedState:
        """The States put elsewhere, where both animators are `Movable`: the first as much less as its legs are shorter.

        Args:
            state: It is not changed.
            shaped: The body that is shown.
            way: From where it was to where it is.
        """
        moving, shapes = state.moving, state.shapes
        if isinstance(self.moving, Movable):
            nominal = RigidTransform(way.turn, way.shift * self._scale(shaped))
            moving = self.moving.relocate(moving, self._fit_body, nominal)
        if isinstance(self.shapes, Movable):
            shapes = self.shapes.relocate(shapes, shaped, way)
        return RedressedState(moving, shapes)

    def save(self, path: str | Path) -> None:
        """Refused: what it is made of are two model files.

        Raises:
            BadInput: Always.
        """
        raise BadInput("two animators are saved one by one", f"'{path}' for both", "save `moving` and `shapes`")

    def _nominal(self, posed: PosedBody) -> PosedBody:
        """The body of the fit in the same pose."""
        scale = self._scale(posed.shaped)
        nominal = self._fit_body.posed(Pose(posed.pose.rotations, posed.pose.translation * scale))
        if not any(posed.origin):
            return nominal
        x, y, z = (float(scale) * place for place in posed.origin)
        return replace(nominal, origin=(x, y, z))

    def _scale(self, shaped: ShapedBody) -> np.float32:
        """Length of the legs of the body of the fit over those of the one that is shown."""
        return np.float32(self._fit_body.leg_length / shaped.leg_length)

    @cached_property
    def _mesh_maps(self) -> "tuple[_Places, _Places] | None":
        """Vertices of the second mesh on the first, and the other way; None where they are one mesh."""
        one, other = self.moving.garment, self.shapes.garment
        if np.array_equal(one.faces, other.faces):
            return None
        return _SurfacePoints.on(one, other), _SurfacePoints.on(other, one)

    @cached_property
    def _fit_body(self) -> ShapedBody:
        return bodies.load(self.body_name).shaped(self.garment.body_betas)


@dataclass(frozen=True)
class _SurfacePoints:
    """Places on a mesh: corners and weights of each, and how far the farthest is from what it stands for [m]."""

    corners: Int[np.ndarray, "places 3"]
    weights: Float[np.ndarray, "places 3"]
    farthest: float

    @classmethod
    def on(cls, garment: Garment, other: Garment) -> "_Places":
        """The places on one garment that are nearest to the vertices of another, as they were made."""
        found = ClosestTree(garment.vertices.astype(np.float64), garment.faces).closest(other.vertices)
        return cls(garment.faces[found.faces], found.weights.astype(np.float32), float(found.distances.max()))

    def of(self, values: Vertices) -> Vertices:
        """Values of vertices, there."""
        return np.einsum("pc,pcx->px", self.weights, values[self.corners])

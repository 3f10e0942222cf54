"""A garment that one animator moves on the body of its fit and another one puts on other body shapes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.meshes import ClosestTree
from hemline.motions.motion import Pose

from .base import Animator, Movable, Redressing
from .own_body import own_body
from .rigid_transform import RigidTransform

MAX_MESH_GAP = 0.02
"""Largest distance between two meshes of one garment as they were made [m]."""


@dataclass(frozen=True)
class RedressedState:
    """The States of both animators."""

    moving: Any
    """State of the first animator, on the body of the fit."""
    shapes: Any
    """State of the second animator, on the body that is shown."""


@dataclass(frozen=True, eq=False)
class AnimatorRedressed:
    """Two animators as one: the first swings on the body of the fit, the second adds what the body's shape changes.

    The body of the fit moves like the body that is shown, with distances scaled by the length of its legs. The second
    animator may have a coarser mesh of the garment, since what the shape changes is smooth.

    Attributes:
        moving: An animator that was fitted on one shape, for example rope chains.
        shapes: A `Redressing` animator of the same garment, as made by `hemline fit --animator agentdress`.

    Raises:
        BadInput: The second animator is not `Redressing`, or the two have different garments or different bodies.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 4. Differs: the clothing pose model is an animator with a memory; the paper leaves loose garments out.
    """

    moving: Animator
    shapes: Animator
    name = "redressed"

    def __post_init__(self) -> None:
        """Refuses animators that do not belong together."""
        if not isinstance(self.shapes, Redressing):
            raise BadInput(
                "what a body's shape does to a garment is known to models of settled garments",
                f"animator '{self.shapes.name}'",
                "fit one with 'hemline fit --animator agentdress'",
            )
        one, other = self.moving, self.shapes
        pairs = (one.garment, other.garment), (other.garment, one.garment)
        if max(_SurfacePoints.on(*pair).farthest for pair in pairs) > MAX_MESH_GAP or one.body_hash != other.body_hash:
            got = f"'{one.garment.name}' on {one.body_name} and '{other.garment.name}' on {other.body_name}"
            raise BadInput("the two animators must be of one garment on the same body", got, "fit both to one garment")

    @property
    def garment(self) -> Garment:
        """The garment of the first animator."""
        return self.moving.garment

    @property
    def body_name(self) -> str:
        """Name of the body that both were fitted on."""
        return self.moving.body_name

    @property
    def body_hash(self) -> str:
        """Hash of the body that the animator was fitted on."""
        return self.moving.body_hash

    @property
    def figures(self) -> Mapping[str, float]:
        """Figures of both fits; the names of those of the second animator begin with `shapes_`."""
        return dict(self.moving.figures) | {f"shapes_{name}": value for name, value in self.shapes.figures.items()}

    def start(self, posed: PosedBody) -> RedressedState:
        """Returns the State at rest on a body of any shape in its first pose; raises BadInput for another body."""
        return RedressedState(self.moving.start(self._nominal(posed)), self.shapes.start(posed))

    def step(self, state: RedressedState, posed: PosedBody, dt: float) -> tuple[RedressedState, Vertices]:
        """Advances to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State [s].

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        nominal = self._nominal(posed)
        moving, on_nominal = self.moving.step(state.moving, nominal, dt)
        assert isinstance(self.shapes, Redressing)
        if self._mesh_maps is None:
            shapes, vertices = self.shapes.redress(state.shapes, posed, dt, on_nominal, nominal)
            return RedressedState(moving, shapes), vertices
        down, up = self._mesh_maps
        coarse = down.of(on_nominal)
        shapes, redressed = self.shapes.redress(state.shapes, posed, dt, coarse, nominal)
        return RedressedState(moving, shapes), on_nominal + up.of(redressed - coarse)

    def relocate(self, state: RedressedState, shaped: ShapedBody, transform: RigidTransform) -> RedressedState:
        """Relocates the States of the animators that are `Movable`; distances of the first are scaled as its body is.

        Args:
            state: The State before; it is not changed.
            shaped: The body that is shown.
            transform: From where that body was to where it is.
        """
        moving, shapes = state.moving, state.shapes
        if isinstance(self.moving, Movable):
            nominal = RigidTransform(transform.turn, transform.shift * self._scale(shaped))
            moving = self.moving.relocate(moving, self._fit_body, nominal)
        if isinstance(self.shapes, Movable):
            shapes = self.shapes.relocate(shapes, shaped, transform)
        return RedressedState(moving, shapes)

    def save(self, path: str | Path) -> None:
        """Refuses to save, since each animator has a model file of its own.

        Raises:
            BadInput: Always.
        """
        raise BadInput("two animators are saved one by one", f"'{path}' for both", "save `moving` and `shapes`")

    def _nominal(self, posed: PosedBody) -> PosedBody:
        """Returns the body of the fit in the same pose."""
        scale = self._scale(posed.shaped)
        nominal = self._fit_body.posed(Pose(posed.pose.rotations, posed.pose.translation * scale))
        if not any(posed.origin):
            return nominal
        x, y, z = (float(scale) * place for place in posed.origin)
        return replace(nominal, origin=(x, y, z))

    def _scale(self, shaped: ShapedBody) -> np.float32:
        """Returns the ratio of the leg length of the body of the fit to that of the body that is shown."""
        return np.float32(self._fit_body.leg_length / shaped.leg_length)

    @cached_property
    def _mesh_maps(self) -> "tuple[_SurfacePoints, _SurfacePoints] | None":
        """Vertices of the second mesh on the first, and of the first on the second; None if both are one mesh."""
        one, other = self.moving.garment, self.shapes.garment
        if np.array_equal(one.faces, other.faces):
            return None
        return _SurfacePoints.on(one, other), _SurfacePoints.on(other, one)

    @cached_property
    def _fit_body(self) -> ShapedBody:
        return own_body(self).shaped(self.garment.body_betas)


@dataclass(frozen=True)
class _SurfacePoints:
    """The points on one mesh that are closest to the vertices of another one."""

    corners: Int[np.ndarray, "points 3"]
    """Vertex ids of the triangle of each point."""
    weights: Float[np.ndarray, "points 3"]
    """Barycentric coordinates of each point."""
    farthest: float
    """Largest distance of a point from its vertex [m]."""

    @classmethod
    def on(cls, garment: Garment, other: Garment) -> "_SurfacePoints":
        """Finds the points on one garment that are closest to the vertices of another, both as they were made."""
        found = ClosestTree(garment.vertices.astype(np.float64), garment.faces).closest(other.vertices)
        return cls(garment.faces[found.faces], found.weights.astype(np.float32), float(found.distances.max()))

    def of(self, values: Vertices) -> Vertices:
        """Interpolates values of vertices at the points."""
        return np.einsum("pc,pcx->px", self.weights, values[self.corners])

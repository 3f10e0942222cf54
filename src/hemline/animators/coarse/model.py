"""A garment whose proxy is moved by a network that was trained on other garments."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from hemline.animators.coarse.features.trail import Trail
from hemline.animators.own_body import refuse_other_body
from hemline.animators.proxy_animator import DressedProxy, ProxyAnimator, read_proxy, settle_proxy
from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.settle import settle_garment
from hemline.animators.simulated_proxy import SimulatedProxy
from hemline.animators.teleport import is_teleport
from hemline.arrays import Float, Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.compiled import real_time_threads
from hemline.garments import Garment
from hemline.garments.proxy.embedding import Embedding
from hemline.garments.proxy.proxy import ProxySize
from hemline.motions.motion import Pose

from .beginning import opening_simulator
from .displacement import Displacement
from .proxy_on_body import ProxyOnBody
from .state import CoarseState, Opening
from .weights import NetworkReader, Weights

TIME_TOLERANCE = 1e-6
"""Rounding error that a sum of time steps may have [s]."""


class CoarseOnBody(NamedTuple):
    """What a step needs on one shape of the body."""

    proxy: ProxyOnBody
    embedding: Embedding
    """The garment on its proxy."""
    prepared: Any
    """What the network prepared for the proxy, see `Network.prepare`."""
    fine: Garment
    """The garment that is shown."""
    simulator: SimulatedProxy
    """Simulates the proxy before the network takes over."""


@dataclass(frozen=True, eq=False)
class CoarseAnimator(ProxyAnimator[CoarseOnBody]):
    """A garment whose proxy is simulated for the first second and then moved by a network.

    Attributes:
        garment: The garment.
        rest: The proxy settled on the body that the garment was made for (coarse, 3) [m], float32.
        body_name: Name of that body.
        body_hash: Hash of that body.
        weights: The network with its options and its figures.
    """

    weights: Weights

    @classmethod
    def on(cls, garment: Garment, body: ShapedBody, weights: Weights) -> Self:
        """Dresses a body in a garment and settles its proxy, which takes a few seconds.

        Raises:
            BadGarment: The garment was made for another body.
            SimulationFailed: The proxy could not be settled.
        """
        return cls(*settle_proxy(garment, body, weights.config.size), weights)

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return self.weights.kind.name

    @property
    def size(self) -> ProxySize:
        """Size of the proxy."""
        return self.weights.config.size

    @property
    def figures(self) -> Mapping[str, float]:
        """Figures of the fit, and the number of vertices of the proxy."""
        return {**self.weights.figures, "proxy_vertices": float(len(self.rest))}

    @cached_property
    def relatives(self) -> list[tuple[str, float]]:
        """Names and distances of the most similar garments of the fit, see `Relatives.nearest`."""
        return self.weights.relatives.nearest(self.coarse[0])

    @property
    def licences(self) -> tuple[str, ...]:
        """Licence terms of the data that the network was trained on."""
        return tuple(self.weights.licences)

    @real_time_threads()
    def start(self, posed: PosedBody) -> CoarseState:
        """Returns the State on a body in its first pose, into which it moved from its rest pose.

        Raises:
            BadInput: The body is another one than that of the garment.
            SimulationFailed: The proxy could not be settled on that shape.
        """
        shaped = posed.shaped
        refuse_other_body(self, shaped)
        on_body, history = self._on(shaped), self.weights.network.start(posed.pose)
        opening = Opening(on_body.simulator.start(posed), 0.0) if self.weights.config.beginning > 0 else None
        return CoarseState(Trail.start(on_body.proxy, posed), posed.pose, history, opening, None)

    @real_time_threads()
    def step(self, state: CoarseState, posed: PosedBody, dt: float) -> tuple[CoarseState, Vertices]:
        """Advances to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State [s]; any.

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        on_body, trail, history = self._on(posed.shaped), state.trail, state.history
        if is_teleport(state.pose, posed.pose, dt):
            motion = _pelvis_motion(on_body.proxy.shaped, state.pose, posed.pose)
            trail, history = trail.transform(motion), history and history.transform(motion)
        trail = trail.advance(on_body.proxy, posed, dt)
        history = history and history.advance(posed.pose, dt)
        opening = state.opening
        if opening is not None:
            opening = Opening(on_body.simulator.step(opening.simulated, posed, dt), opening.seconds + dt)
        is_last = opening is not None and opening.seconds > self.weights.config.beginning - TIME_TOLERANCE
        trail = trail.with_beginning(opening.simulated.positions) if opening and is_last else trail
        history, coarse = self.weights.network.predict(on_body.prepared, on_body.proxy, trail, history, posed)
        displacement = None
        if opening is None:
            predicted = trail.local_offsets(coarse)
            displacement = state.displacement.advance(predicted, dt) if state.displacement else Displacement(predicted)
            coarse = trail.add_displacements(displacement.current)
        else:
            if is_last:
                simulated = trail.local_offsets(opening.simulated.positions)
                displacement = Displacement.after_simulation(simulated, trail.local_offsets(coarse))
            coarse = opening.simulated.positions.astype(np.float32)
        coarse = _apply_pins(coarse, on_body.proxy.garment, posed)
        vertices = on_body.embedding.fine_vertices(coarse.astype(np.float64))
        after = CoarseState(trail, posed.pose, history, None if is_last else opening, displacement)
        return after, _apply_pins(vertices, on_body.fine, posed)

    def relocate(self, state: CoarseState, shaped: ShapedBody, transform: RigidTransform) -> CoarseState:
        """Returns the State with everything in it, its past too, turned about the vertical and shifted.

        Args:
            state: The State before; it is not changed.
            shaped: The body that wears the garment.
            transform: From where the body was to where it is.
        """
        history, opening = state.history and state.history.transform(transform), state.opening
        if opening is not None:
            opening = Opening(opening.simulated.relocate(transform), opening.seconds)
        trail, pose = state.trail.transform(transform), transform.pose(state.pose)
        return replace(state, trail=trail, pose=pose, history=history, opening=opening)

    def _prepare(self, dressed: DressedProxy, shaped: ShapedBody) -> CoarseOnBody:
        coarse, rest = dressed.coarse, dressed.rest
        rest = settle_garment(coarse, shaped).astype(np.float32) if rest is None else rest
        proxy = ProxyOnBody.of(coarse, rest, shaped)
        embedding = Embedding.of(dressed.fine, coarse, dressed.vertex_ids)
        prepared = self.weights.network.prepare(proxy)
        return CoarseOnBody(proxy, embedding, prepared, dressed.fine, opening_simulator(proxy))

    def save(self, path: str | Path) -> None:
        """Writes a model file, whole or not at all: the network, the garment and its settled proxy.

        Raises:
            BadOutput: The path cannot be written.
        """
        self._save(
            path,
            self.weights.arrays(),
            config=asdict(self.weights.config),
            figures=self.weights.figures,
            licences=self.weights.licences,
            extra=self.weights.extra(),
        )

    @classmethod
    def of(cls, kind: NetworkReader, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Reads the animator from the contents of a model file.

        Args:
            kind: The kind that reads the network.
            arrays: Arrays of the file by name.
            metadata: Metadata of the file.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array does not have the
                dtype or the shape that the garment or the options need.
        """
        weights = Weights.of(kind, arrays, metadata)
        return cls(*read_proxy(arrays, metadata, weights.config.size), weights)


def _apply_pins(vertices: Float[np.ndarray, "verts 3"], garment: Garment, posed: PosedBody) -> np.ndarray:
    """Moves the rigidly pinned vertices to their pins, in place; returns the vertices."""
    rigid = np.isinf(garment.pins.stiffness)
    vertices[garment.pins.vertices[rigid]] = garment.pins.on(posed)[rigid]
    return vertices


def _pelvis_motion(shaped: ShapedBody, before: Pose, now: Pose) -> RigidTransform:
    """Returns the motion of the pelvis between two poses."""
    rotations = before.rotations.copy()
    rotations[0] = now.rotations[0]
    moved = shaped.posed(Pose(rotations, now.translation))
    return RigidTransform.between(shaped.posed(before).transforms[0], moved.transforms[0])

"""A garment that nobody trained on, worn by the network."""

import threading
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from hemline.animators.coarse.features.trail import Trail
from hemline.animators.teleport import RigidTransform, is_teleport
from hemline.animators.model_file import garment_of, save_model
from hemline.animators.own_body import refuse_other_body
from hemline.animators.settle import settle_garment
from hemline.animators.simulated_proxy import SimulatedProxy
from hemline.arrays import Float, Int, Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.compiled import real_time_threads
from hemline.files.contents import array_of, entry, refused
from hemline.garments import Garment
from hemline.garments.proxy.embedding import Embedding
from hemline.garments.proxy.proxy import proxy_of
from hemline.motions.motion import Pose

from .beginning import opening_simulator
from .displacement import Displacement
from .proxy_on_body import ProxyOnBody
from .state import CoarseState, Opening
from .weights import NetworkReader, Weights

TIME_TOLERANCE = 1e-6
"""By so much sums of time steps may be too small [s]."""


@dataclass(frozen=True, eq=False)
class _Worn:
    """On one shape of the body."""

    proxy: ProxyOnBody
    embedding: Embedding
    prepared: Any
    """What the network knows of the garment."""
    fine: Garment
    simulated: SimulatedProxy
    """What moves the proxy at the beginning."""


@dataclass(frozen=True, eq=False)
class CoarseAnimator:
    """A garment whose coarse copy is moved by a network that was trained on other garments, and which rides on it.

    Attributes:
        garment: The garment.
        rest: The coarse garment settled on the body that the garment is made on [m].
        body_name: Name of that body.
        body_hash: Its hash.
        weights: The network, its options and its figures.
    """

    garment: Garment
    rest: Float[np.ndarray, "coarse 3"]
    body_name: str
    body_hash: str
    weights: Weights

    _worn: dict[bytes, _Worn] = field(default_factory=dict, init=False, repr=False)
    """On each shape of the body, made when it is first asked for."""
    _making: Any = field(default_factory=threading.Lock, init=False, repr=False)

    @classmethod
    @real_time_threads()
    def on(cls, garment: Garment, body: ShapedBody, weights: Weights) -> Self:
        """Make a garment ready on a body: a few seconds, in which its coarse copy settles.

        Raises:
            BadGarment: It was made on another body.
            SimulationFailed: It could not be settled.
        """
        worn = garment.dressed(body)
        coarse, _ = proxy_of(worn, weights.config.size)
        return cls(worn, settle_garment(coarse, body).astype(np.float32), body.body.name, body.body.hash, weights)

    @property
    def name(self) -> str:
        """Name of its kind."""
        return self.weights.kind.name

    @property
    def figures(self) -> Mapping[str, float]:
        """What the fit reached, and vertices of the coarse garment."""
        return {**self.weights.figures, "proxy_vertices": float(len(self.rest))}

    @cached_property
    def coarse(self) -> tuple[Garment, Int[np.ndarray, " coarse"]]:
        """The coarse garment, and which vertex of the garment each of its vertices is."""
        return proxy_of(self.garment, self.weights.config.size)

    @cached_property
    def relatives(self) -> list[tuple[str, float]]:
        """The garments of the fit that are most like this one, see `Relatives.nearest`."""
        return self.weights.relatives.nearest(self.coarse[0])

    @property
    def licences(self) -> tuple[str, ...]:
        """Terms of what the network learned from."""
        return tuple(self.weights.licences)

    @real_time_threads()
    def start(self, posed: PosedBody) -> CoarseState:
        """On a body in its first pose, into which it came from its rest pose.

        Raises:
            BadInput: The body is another one than that of the garment.
            SimulationFailed: The garment could not be settled on that shape.
        """
        shaped = posed.shaped
        refuse_other_body(self, shaped)
        worn, history = self._on(shaped), self.weights.network.start(posed.pose)
        opening = Opening(worn.simulated.start(posed), 0.0) if self.weights.config.beginning > 0 else None
        return CoarseState(Trail.start(worn.proxy, posed), posed.pose, history, opening, None)

    @real_time_threads()
    def step(self, state: CoarseState, posed: PosedBody, dt: float) -> tuple[CoarseState, Vertices]:
        """Advance to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State [s]; any.

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        worn, trail, history = self._on(posed.shaped), state.trail, state.history
        if is_teleport(state.pose, posed.pose, dt):
            way = _pelvis_motion(worn.proxy.shaped, state.pose, posed.pose)
            trail, history = trail.moved(way), history and history.moved(way)
        trail = trail.advance(worn.proxy, posed, dt)
        history = history and history.advance(posed.pose, dt)
        opening = state.opening
        if opening is not None:
            opening = Opening(worn.simulated.step(opening.simulated, posed, dt), opening.seconds + dt)
        over = opening is not None and opening.seconds > self.weights.config.beginning - TIME_TOLERANCE
        trail = trail.with_beginning(opening.simulated.positions) if opening and over else trail
        history, coarse = self.weights.network.moved(worn.prepared, worn.proxy, trail, history, posed)
        displaced = None
        if opening is None:
            said = trail.local_offsets(coarse)
            displaced = state.displaced.advance(said, dt) if state.displaced else Displacement(said)
            coarse = trail.displaced(displaced.current)
        else:
            if over:
                lay = trail.local_offsets(opening.simulated.positions)
                displaced = Displacement.after_simulation(lay, trail.local_offsets(coarse))
            coarse = opening.simulated.positions.astype(np.float32)
        vertices = worn.embedding.carried(_apply_pins(coarse, worn.proxy.garment, posed).astype(np.float64))
        after = CoarseState(trail, posed.pose, history, None if over else opening, displaced)
        return after, _apply_pins(vertices, worn.fine, posed)

    def relocate(self, state: CoarseState, shaped: ShapedBody, way: RigidTransform) -> CoarseState:
        """The State turned about the vertical and shifted as a whole, its past too.

        Args:
            state: It is not changed.
            shaped: The body that wears the garment.
            way: From where it was to where it is.
        """
        history, opening = state.history and state.history.moved(way), state.opening
        if opening is not None:
            opening = Opening(opening.simulated.relocate(way), opening.seconds)
        return replace(state, trail=state.trail.moved(way), pose=way.pose(state.pose), history=history, opening=opening)

    def _on(self, shaped: ShapedBody) -> _Worn:
        key = np.asarray(shaped.betas, np.float32).tobytes()
        with self._making:
            if key not in self._worn:
                self._worn[key] = self._made(shaped)
        return self._worn[key]

    def _made(self, shaped: ShapedBody) -> _Worn:
        (coarse, kept), own = self.coarse, self.garment.is_on(shaped)
        fine, coarse = self.garment.dressed(shaped), coarse.dressed(shaped)
        rest = self.rest if own else settle_garment(coarse, shaped).astype(np.float32)
        proxy = ProxyOnBody.of(coarse, rest, shaped)
        embedding, prepared = Embedding.of(fine, coarse, kept), self.weights.network.prepared(proxy)
        return _Worn(proxy, embedding, prepared, fine, opening_simulator(proxy))

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all: the network, the garment, its coarse copy settled.

        Raises:
            BadOutput: The path cannot be written.
        """
        save_model(
            path,
            self.name,
            {"rest": self.rest} | self.weights.arrays(),
            garment=self.garment,
            body={"name": self.body_name, "hash": self.body_hash},
            config=asdict(self.weights.config),
            figures=self.weights.figures,
            licences=self.weights.licences,
            extra=self.weights.extra(),
        )

    @classmethod
    def of(cls, kind: NetworkReader, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Make one from what a model file of a kind holds.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array of another dtype
                or shape than the garment or the options ask.
        """
        weights, garment, body = (
            Weights.of(kind, arrays, metadata),
            garment_of(arrays, metadata),
            entry(metadata, "body", dict),
        )
        with refused("the model's garment"):
            count = len(proxy_of(garment, weights.config.size)[1])
        rest = array_of(arrays, "rest", "float32", (count, 3))
        return cls(garment, rest, entry(body, "name", str), entry(body, "hash", str), weights)


def _apply_pins(vertices: Float[np.ndarray, "verts 3"], garment: Garment, posed: PosedBody) -> Float[np.ndarray, "verts 3"]:
    """Vertices whose pins hold fast, put where these are; in place."""
    fast = np.isinf(garment.pins.stiffness)
    vertices[garment.pins.vertices[fast]] = garment.pins.on(posed)[fast]
    return vertices


def _pelvis_motion(shaped: ShapedBody, before: Pose, now: Pose) -> RigidTransform:
    """How the pelvis was put elsewhere."""
    rotations = before.rotations.copy()
    rotations[0] = now.rotations[0]
    there = shaped.posed(Pose(rotations, now.translation))
    return RigidTransform.between(shaped.posed(before).transforms[0], there.transforms[0])

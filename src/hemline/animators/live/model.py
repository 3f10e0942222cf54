"""One garment that is simulated in real time, on bodies of any shape."""

import threading
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from hemline.animators.teleport import RigidTransform
from hemline.animators.model_file import garment_of, save_model
from hemline.animators.own_body import refuse_other_body
from hemline.animators.simulated_proxy import ProxyState, SimulatedProxy
from hemline.arrays import Float, Int, Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.compiled import real_time_threads
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, entry, refused
from hemline.garments import Garment
from hemline.garments.proxy.embedding import Embedding
from hemline.garments.proxy.proxy import proxy_of
from hemline.options import options_of

from .config import LiveConfig

LIVE_VERSION = 1
"""Of what a model file holds under `live`."""


@dataclass(frozen=True, eq=False)
class AnimatorLive:
    """A garment whose coarse copy is simulated while it is shown, and which rides on that copy.

    Attributes:
        garment: The garment.
        rest: The coarse garment settled on the body that the garment is made on [m].
        body_name: Name of that body.
        body_hash: Its hash.
        config: Options.
    """

    garment: Garment
    rest: Float[np.ndarray, "coarse 3"]
    body_name: str
    body_hash: str
    config: LiveConfig

    _worn: dict[bytes, tuple[SimulatedProxy, Embedding]] = field(default_factory=dict, init=False, repr=False)
    """On each shape of the body, made when it is first asked for."""
    _making: Any = field(default_factory=threading.Lock, init=False, repr=False)

    @classmethod
    @real_time_threads()
    def on(cls, garment: Garment, body: ShapedBody, config: LiveConfig) -> Self:
        """Make a garment ready on a body: a few seconds, in which it settles.

        Raises:
            BadGarment: It was made on another body.
            SimulationFailed: It could not be settled.
        """
        worn = garment.dressed(body)
        coarse, _ = proxy_of(worn, config.size)
        settled = SimulatedProxy(coarse, body, config.settings(len(coarse.vertices))).rest
        return cls(worn, settled.astype(np.float32), body.body.name, body.body.hash, config)

    @property
    def name(self) -> str:
        """Name of its kind."""
        return "live"

    @property
    def figures(self) -> Mapping[str, float]:
        """Vertices of the coarse garment, and what its frames are simulated with."""
        level = self.config.level(len(self.rest))
        return {"simulated_vertices": float(len(self.rest)), "substeps": float(level.substeps)}

    @cached_property
    def coarse(self) -> tuple[Garment, Int[np.ndarray, " coarse"]]:
        """The coarse garment, and which vertex of the garment each of its vertices is."""
        return proxy_of(self.garment, self.config.size)

    @real_time_threads()
    def start(self, posed: PosedBody) -> ProxyState:
        """At rest on a body of any shape in its first pose; on a new shape the garment settles first.

        Raises:
            BadInput: The body is another one than that of the garment.
            SimulationFailed: The garment could not be settled on that shape.
        """
        shaped = posed.shaped
        refuse_other_body(self, shaped)
        return self._on(shaped)[0].start(posed)

    def step(self, state: ProxyState, posed: PosedBody, dt: float) -> tuple[ProxyState, Vertices]:
        """Advance to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State [s]; any.

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        after = self.simulate(state, posed, dt)
        return after, self.carry_mesh(after, posed.shaped)

    @real_time_threads()
    def simulate(self, state: ProxyState, posed: PosedBody, dt: float) -> ProxyState:
        """The coarse half of `step`: the State after."""
        return self._on(posed.shaped)[0].step(state, posed, dt)

    def relocate(self, state: ProxyState, shaped: ShapedBody, way: RigidTransform) -> ProxyState:
        """The State turned about the vertical and shifted as a whole, its past too.

        Args:
            state: It is not changed.
            shaped: The body that wears the garment.
            way: From where it was to where it is.
        """
        return state.relocate(way)

    @real_time_threads()
    def carry_mesh(self, state: ProxyState, shaped: ShapedBody) -> Vertices:
        """The fine half: the vertices of a State on that shape of the body (verts, 3) [m]."""
        here = self._on(shaped)[1].carry_mesh(state.cloth.positions)
        return state.to_world.points(here.astype(np.float64)).astype(np.float32)

    def _on(self, shaped: ShapedBody) -> tuple[SimulatedProxy, Embedding]:
        key = np.asarray(shaped.betas, np.float32).tobytes()
        with self._making:
            if key not in self._worn:
                self._worn[key] = self._made(shaped)
        return self._worn[key]

    def _made(self, shaped: ShapedBody) -> tuple[SimulatedProxy, Embedding]:
        (coarse, kept), own = self.coarse, self.garment.is_on(shaped)
        fine, coarse = self.garment.dressed(shaped), coarse.dressed(shaped)
        settings = self.config.settings(len(kept))
        worn = SimulatedProxy(coarse, shaped, settings, self.rest.astype(np.float64) if own else None)
        return worn, Embedding.of(fine, coarse, kept)

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all: the garment, the coarse one settled, the options.

        Raises:
            BadOutput: The path cannot be written.
        """
        save_model(
            path,
            self.name,
            {"rest": self.rest},
            garment=self.garment,
            body={"name": self.body_name, "hash": self.body_hash},
            config=asdict(self.config),
            figures=self.figures,
            licences=[],
            extra={"live": {"version": LIVE_VERSION}},
        )

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Make one from what a model file holds.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array of another dtype
                or shape than the garment asks.
        """
        version = entry(metadata, "live", dict).get("version")
        if version != LIVE_VERSION:
            raise BadModel(f"this hemline reads version {LIVE_VERSION} of live garments", f"version {version}", AGAIN)
        garment, body = garment_of(arrays, metadata), entry(metadata, "body", dict)
        config = options_of(LiveConfig, entry(metadata, "config", dict), error=BadModel)
        with refused("the model's garment"):
            count = len(proxy_of(garment, config.size)[1])
        rest = array_of(arrays, "rest", "float32", (count, 3))
        return cls(garment, rest, entry(body, "name", str), entry(body, "hash", str), config)

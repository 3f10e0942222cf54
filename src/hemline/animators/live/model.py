"""A garment that is simulated in real time, on bodies of any shape."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from hemline.animators.newton_solver import NewtonSolver
from hemline.animators.own_body import refuse_other_body
from hemline.animators.proxy_animator import DressedProxy, ProxyAnimator, read_proxy, settle_proxy
from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.simulated_proxy import ProxyState, SimulatedProxy
from hemline.animators.small_step_solver import SmallStepSolver
from hemline.arrays import Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.compiled import real_time_threads
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, entry
from hemline.garments import Garment, lies_close
from hemline.garments.proxy.embedding import Embedding
from hemline.garments.proxy.proxy import ProxySize
from hemline.options import options_of

from .config import LiveConfig

LIVE_VERSION = 1
"""Version of what model files hold under `live`."""
CLOSE_STRETCH = 1.08
"""Longest length of an edge of a garment that lies close to the body, over the longer of those on the pattern and at
rest."""


class LiveOnBody(NamedTuple):
    """What a step needs on one shape of the body."""

    simulator: SimulatedProxy
    embedding: Embedding
    """The garment on its proxy."""
    worn: Vertices
    """The garment in the rest pose (verts, 3) [m]."""


@dataclass(frozen=True, eq=False)
class AnimatorLive(ProxyAnimator[LiveOnBody]):
    """A garment whose proxy is simulated while it is shown.

    Attributes:
        garment: The garment.
        rest: The proxy settled on the body that the garment was made for (coarse, 3) [m], float32.
        body_name: Name of that body.
        body_hash: Hash of that body.
        config: Options of the simulation.
        close: Whether the garment lies close to the body as a whole, see `lies_close`.
    """

    config: LiveConfig
    close: bool = False

    @classmethod
    def on(cls, garment: Garment, body: ShapedBody, config: LiveConfig) -> Self:
        """Dresses a body in a garment and settles its proxy, which takes a few seconds.

        Raises:
            BadGarment: The garment was made for another body.
            SimulationFailed: The proxy could not be settled.
        """
        settled = settle_proxy(garment, body, config.size, self_contact=config.self_contact)
        return cls(*settled, config, lies_close(settled.garment, body))

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return "live"

    @property
    def size(self) -> ProxySize:
        """Size of the proxy."""
        return self.config.size

    @property
    def figures(self) -> Mapping[str, float]:
        """Number of simulated vertices, and of substeps in a frame of 1/30 s."""
        substeps = self.config.settings(len(self.rest)).substeps
        return {"simulated_vertices": float(len(self.rest)), "substeps": float(substeps)}

    @property
    def stretch_limit(self) -> float:
        """See `CloseFitting`."""
        return CLOSE_STRETCH if self.close else 0.0

    def at_rest(self, state: ProxyState, shaped: ShapedBody) -> Vertices:
        """Returns the garment in the rest pose of a body of any shape (verts, 3) [m]."""
        return self._on(shaped).worn

    def in_wind(self, wind: tuple[float, float, float]) -> Self:
        """Returns the animator in a wind of the world [m/s]. It can step the States of this one."""
        return replace(self, config=replace(self.config, wind=wind))

    @real_time_threads()
    def start(self, posed: PosedBody) -> ProxyState:
        """Returns the State at rest on a body of any shape in its first pose. On a new shape the garment settles first.

        Raises:
            BadInput: The body is another one than that of the garment.
            SimulationFailed: The proxy could not be settled on that shape.
        """
        shaped = posed.shaped
        refuse_other_body(self, shaped)
        return self._on(shaped).simulator.start(posed)

    def step(self, state: ProxyState, posed: PosedBody, dt: float) -> tuple[ProxyState, Vertices]:
        """Advances to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since that State, of any length [s].

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        after = self.simulate(state, posed, dt)
        return after, self.carry_mesh(after, posed.shaped)

    @real_time_threads()
    def simulate(self, state: ProxyState, posed: PosedBody, dt: float) -> ProxyState:
        """Advances the proxy alone, the first half of `step`; returns the State after."""
        return self._on(posed.shaped).simulator.step(state, posed, dt)

    def relocate(self, state: ProxyState, shaped: ShapedBody, transform: RigidTransform) -> ProxyState:
        """Returns the State with all of its contents, its past included, turned about the vertical and shifted.

        Args:
            state: The State before; it is not changed.
            shaped: The body that wears the garment.
            transform: From where the body was to where it is.
        """
        return state.relocate(transform)

    @real_time_threads()
    def carry_mesh(self, state: ProxyState, shaped: ShapedBody) -> Vertices:
        """Carries the garment along with the proxy, the second half of `step`; returns its vertices (verts, 3) [m]."""
        here = self._on(shaped).embedding.fine_vertices(state.shown)
        return state.to_world.points(here.astype(np.float64)).astype(np.float32)

    def _prepare(self, dressed: DressedProxy, shaped: ShapedBody) -> LiveOnBody:
        settings = self.config.settings(len(dressed.vertex_ids))
        rest = None if dressed.rest is None else dressed.rest.astype(np.float64)
        solver = NewtonSolver if self.config.exact else SmallStepSolver
        simulator = SimulatedProxy(dressed.coarse, shaped, settings, rest, solver=solver)
        embedding = Embedding.of(dressed.fine, dressed.coarse, dressed.vertex_ids)
        return LiveOnBody(simulator, embedding, dressed.fine.vertices)

    def save(self, path: str | Path) -> None:
        """Writes a model file, whole or not at all: the garment, its settled proxy and the options.

        Raises:
            BadOutput: The path cannot be written.
        """
        extra = {"live": {"version": LIVE_VERSION, "close": self.close}}
        self._save(path, {}, config=asdict(self.config), figures=self.figures, licences=[], extra=extra)

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Reads the animator from the contents of a model file.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array does not have the
                dtype or the shape that the garment needs.
        """
        own = entry(metadata, "live", dict)
        version = own.get("version")
        if version != LIVE_VERSION:
            raise BadModel(f"this hemline reads version {LIVE_VERSION} of live garments", f"version {version}", AGAIN)
        config = options_of(LiveConfig, entry(metadata, "config", dict), error=BadModel)
        close = own.get("close", False)
        if not isinstance(close, bool):
            raise BadModel("'close' of a live garment must be true or false", repr(close), AGAIN)
        return cls(*read_proxy(arrays, metadata, config.size), config, close)

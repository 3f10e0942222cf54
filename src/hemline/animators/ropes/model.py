"""Rope chains that carry a full garment: the animator for capes, skirts, anything that swings."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.model_file import (
    AGAIN,
    array_of,
    config_of,
    entry,
    garment_of,
    part,
    refused,
    save_model,
)
from hemline.arrays import Float, FramesOfVertices, Nodes, Vertices
from hemline.bodies.body import PosedBody
from hemline.errors import BadInput, BadModel
from hemline.garments.garment import Garment
from hemline.motions.motion import JOINT_NAMES

from .bones import rest_bones, seen_bones
from .chains import Ropes, RopesState
from .config import RopesConfig
from .keyframe import to_key
from .mlp import Mlp
from .reconstruct import PackedBasis

if TYPE_CHECKING:
    from hemline.datasets import Dataset


@dataclass(frozen=True, eq=False)
class AnimatorRopesState:
    """All that moves; a leading axis of agents where it was started with some."""

    ropes: RopesState
    rest: Float[np.ndarray, "*agents verts 3"]
    """The rest drape on this body's shape [m]."""
    rest_bones: Float[np.ndarray, "*agents nodes 3"]
    """The bones in it [m], float64."""


@dataclass(frozen=True, eq=False)
class AnimatorRopes:
    r"""A garment driven by rope chains.

    $$x = A_\mathrm{key}\,(x_\mathrm{rest} + B_1 c_1(d) + B_2 c_2(d))$$

    with $d$ the displacements of all bones from rest in the frame of the key joint, and $c_1$, $c_2$ two networks.
    Bones of the ropes first become $d + g(d)$, with a third network (`bridge`).

    Source: Jin et al., "Rope chains", 2024, Sections 7 and 8. Differs: on other body shapes than the fitted one the
        rest drape is moved as the undraped garment would be (`Garment.dressed`), and displacements are kept as they
        are; the paper has one shape.
    """

    garment: Garment
    ropes: Ropes
    rest: Vertices
    """The settled drape in the body's rest pose, on the fitted shape [m]."""
    skinning_basis: PackedBasis
    shape_basis: PackedBasis
    skinning: Mlp
    shape: Mlp
    bridge: Mlp
    """From the ropes' bones to a change of them, see `bridge.train_bridge`; simulated bones need none."""
    body_name: str
    body_hash: str
    config: RopesConfig
    figures: Mapping[str, float] = field(default_factory=dict)
    licences: tuple[str, ...] = ()

    Config: ClassVar[type] = RopesConfig

    @cached_property
    def basis(self) -> PackedBasis:
        """Both bases side by side, as they are played."""
        return self.skinning_basis.joined(self.shape_basis)

    @cached_property
    def key(self) -> int:
        """Index of the key joint."""
        return JOINT_NAMES.index(self.garment.key_joint)

    @classmethod
    def fit(
        cls,
        dataset: "Dataset",
        config: RopesConfig | None = None,
        *,
        seed: int = 0,
        progress: Progress | None = None,
        checkpoints: Path | None = None,
    ) -> Self:
        """Learn from simulated takes; see `fit.fit`."""
        from .fit import fit

        return fit(dataset, config or RopesConfig(), seed=seed, progress=progress, checkpoints=checkpoints)  # type: ignore[return-value]

    def start(self, posed: PosedBody | Sequence[PosedBody], *, agents: int | None = None) -> AnimatorRopesState:
        """At rest on a body in its first pose.

        Args:
            posed: The posed body, of any shape; with `agents`, a sequence of them.
            agents: How many.

        Raises:
            BadInput: The body is another one than that of the fit, or there are not as many as agents.
        """
        bodies = _sequence(posed, agents)
        rests = [self._rest_on(each) for each in bodies]
        ropes = self.ropes.start(posed, agents=agents)
        if agents is None:
            return AnimatorRopesState(ropes, *rests[0])
        return AnimatorRopesState(ropes, np.stack([r for r, _ in rests]), np.stack([b for _, b in rests]))

    def step(
        self,
        state: AnimatorRopesState,
        posed: PosedBody | Sequence[PosedBody],
        dt: float,
        *,
        bones: Nodes | None = None,
    ) -> tuple[AnimatorRopesState, Vertices | FramesOfVertices]:
        """Advance to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now; a sequence where the State was started with agents.
            dt: Time since the State [s]; any.
            bones: World positions of all bones [m]; given, the networks are driven by them and the ropes rest.

        Returns:
            The State after, and the vertices in the world [m]: (verts, 3), or (agents, verts, 3).
        """
        ropes = self.ropes.step(state.ropes, posed, dt) if bones is None else state.ropes
        positions = ropes.positions if bones is None else bones
        after = AnimatorRopesState(ropes, state.rest, state.rest_bones)
        own = bones is None
        if state.rest.ndim == 2:
            return after, self._vertices(positions, posed.transforms[self.key], state.rest, state.rest_bones, own)  # type: ignore[union-attr]
        each = zip(positions, posed, state.rest, state.rest_bones, strict=True)  # type: ignore[arg-type]
        return after, np.stack([self._vertices(p, b.transforms[self.key], r, n, own) for p, b, r, n in each])

    def follow(
        self, state: AnimatorRopesState, posed: PosedBody, dt: float, truth: Vertices
    ) -> tuple[AnimatorRopesState, Vertices]:
        """As `step`, driven by the bones of simulated vertices."""
        return self.step(state, posed, dt, bones=seen_bones(self.ropes, truth, posed))

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all.

        Raises:
            BadOutput: The path cannot be written.
        """
        parts = {
            "ropes": self.ropes.arrays(),
            "skinning_basis": self.skinning_basis.arrays(),
            "shape_basis": self.shape_basis.arrays(),
            "skinning": self.skinning.arrays(),
            "shape": self.shape.arrays(),
            "bridge": self.bridge.arrays(),
        }
        arrays = {f"{name}.{key}": array for name, held in parts.items() for key, array in held.items()}
        save_model(
            path,
            "ropes",
            {"rest": self.rest} | arrays,
            garment=self.garment,
            body={"name": self.body_name, "hash": self.body_hash},
            config=asdict(self.config),
            figures=self.figures,
            licences=self.licences,
            extra={"ropes": self.ropes.metadata()},
        )

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Make one from what a model file holds.

        Raises:
            BadModel: A key is missing or of another type, or an array of another dtype or shape than the rest asks for.
        """
        garment = garment_of(arrays, metadata)
        with refused("the model's ropes"):
            ropes = Ropes.of(part(arrays, "ropes"), entry(metadata, "ropes", dict))
        if not np.array_equal(_trimmed(ropes.betas), _trimmed(garment.body_betas)):
            raise BadModel("ropes and garment of the model are on different shapes", ropes.betas.tolist(), AGAIN)
        count = len(garment.vertices)
        if ropes.embedding.corners.max(initial=0) >= count:
            raise BadModel("a bone lies on a vertex past the garment's last", int(ropes.embedding.corners.max()), AGAIN)
        inputs = 3 * ropes.node_count
        first = PackedBasis.of(part(arrays, "skinning_basis"), vertex_count=count)
        second = PackedBasis.of(part(arrays, "shape_basis"), vertex_count=count)
        skinning = Mlp.of(part(arrays, "skinning"), inputs=inputs, outputs=first.mode_count)
        shape = Mlp.of(part(arrays, "shape"), inputs=inputs, outputs=second.mode_count)
        bridge = Mlp.of(part(arrays, "bridge"), inputs=inputs, outputs=inputs)
        body = entry(metadata, "body", dict)
        figures = entry(metadata, "figures", dict)
        if not all(isinstance(value, int | float) for value in figures.values()):
            raise BadModel("figures of the model are numbers", figures, AGAIN)
        return cls(
            garment,
            ropes,
            array_of(arrays, "rest", "float32", (count, 3)),
            first,
            second,
            skinning,
            shape,
            bridge,
            body_name=entry(body, "name", str),
            body_hash=entry(body, "hash", str),
            config=config_of(RopesConfig, entry(metadata, "config", dict)),
            figures=figures,
            licences=tuple(str(text) for text in entry(metadata, "licences", list)),
        )

    def _rest_on(self, posed: PosedBody) -> tuple[Vertices, Nodes]:
        shaped = posed.shaped
        if shaped.body.hash != self.body_hash:
            raise BadInput(
                f"the model of '{self.garment.name}' was fitted on body {self.body_name} ({self.body_hash})",
                f"{shaped.body.name} ({shaped.body.hash})",
                "use that body, or fit the garment again",
            )
        if self.ropes.carriage.nearest.max(initial=0) >= len(shaped.vertices):
            raise BadModel(
                "a bone hangs on a vertex past the body's last", int(self.ropes.carriage.nearest.max()), AGAIN
            )
        fitted = np.zeros_like(shaped.betas)
        fitted[: len(self.garment.body_betas)] = self.garment.body_betas
        rest = self.rest
        if not np.array_equal(fitted, shaped.betas):
            rest = rest + (self.garment.dressed(shaped).vertices - self.garment.vertices)
        return rest, rest_bones(self.ropes, rest, shaped)

    def _vertices(
        self, bones: Nodes, transform: Float[np.ndarray, "3 4"], rest: Vertices, rest_bones: Nodes, own: bool
    ) -> Vertices:
        moved = (to_key(transform, bones) - rest_bones).astype(np.float32).reshape(-1)
        moved = moved + self.bridge(moved) if own else moved
        coefficients = np.concatenate([self.skinning(moved), self.shape(moved)])
        return self.basis.vertices(coefficients, rest, transform)


def _trimmed(betas: np.ndarray) -> np.ndarray:
    return np.trim_zeros(np.asarray(betas, np.float32).reshape(-1), "b")


def _sequence(posed: PosedBody | Sequence[PosedBody], agents: int | None) -> Sequence[PosedBody]:
    if agents is None:
        return [posed]  # type: ignore[list-item]
    if isinstance(posed, PosedBody) or len(posed) != agents:
        raise BadInput(f"{agents} agents need as many posed bodies", type(posed).__name__, "give a sequence of them")
    return posed

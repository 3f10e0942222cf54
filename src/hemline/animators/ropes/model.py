"""Rope chains that carry a full garment: the animator for capes, skirts, anything that swings."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from hemline.animators.model_file import garment_of, save_model
from hemline.animators.own_body import refuse_other_body
from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.ropes.bones.bone_correction import BoneCorrection
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.bones import bones_of_mesh, rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.bones.reading import read_ropes
from hemline.animators.ropes.springs import DEFAULT_CONSTANTS
from hemline.arrays import Nodes, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, damage_as_bad_model, entry, part
from hemline.garments.garment import Garment
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import PackedBasis
from hemline.motions.motion import JOINT_NAMES
from hemline.options import options_of
from hemline.springs import SpringConstants

from .animator_state import AnimatorRopesState
from .config import RopesConfig
from .detail import AnimatorRopesLevel

VERSION = 5
"""Version of rope chains in model files, key `ropes.version`; version 1 had no such key."""


@dataclass(frozen=True, eq=False)
class AnimatorRopes:
    r"""A garment driven by rope chains.

    $$x = A_\mathrm{key}\,(x_\mathrm{rest} + B_1 c_1(d) + B_2 c_2(d))$$

    with $d$ the displacements of all bones from rest in the frame of the key joint (`BoneSource`), and $c_1$, $c_2$ two
    networks, or linear maps where no network is better.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 and 8. Differs: on other body shapes than the fitted one the rest drape is moved as
        the undraped garment would be (`Garment.dressed`), and displacements stay the same; the paper has one shape.
    """

    garment: Garment
    ropes: Ropes
    rest: Vertices
    """The settled drape in the body's rest pose, on the fitted shape [m]."""
    skinning_basis: PackedBasis
    shape_basis: PackedBasis
    skinning: Mlp
    shape: Mlp
    correction: BoneCorrection
    """Correction of the ropes' bones; simulated bones need none."""
    body_name: str
    body_hash: str
    config: RopesConfig
    springs: SpringConstants = DEFAULT_CONSTANTS
    """Constants of spring bones, with which engines swing the chains without hemline."""
    figures: Mapping[str, float] = field(default_factory=dict)
    licences: tuple[str, ...] = ()

    _levels: dict[float, AnimatorRopesLevel] = field(default_factory=dict, init=False, repr=False)

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return "ropes"

    @cached_property
    def basis(self) -> PackedBasis:
        """Both bases side by side, as they are used in playing."""
        return self.skinning_basis.concatenate(self.shape_basis)

    @cached_property
    def key(self) -> int:
        """Index of the key joint."""
        return JOINT_NAMES.index(self.garment.key_joint)

    @cached_property
    def source(self) -> BoneSource:
        """Source of the bones' displacements."""
        return BoneSource(self.ropes, self.correction)

    def start(self, posed: PosedBody) -> AnimatorRopesState:
        """Returns the State at rest on a body, of any shape, in its first pose.

        Raises:
            BadInput: The body is not the one of the fit.
        """
        rest, bones = self._rest_on(posed)
        return AnimatorRopesState(self.source.start(posed), rest, bones)

    def step(
        self, state: AnimatorRopesState, posed: PosedBody, dt: float, *, bones: Nodes | None = None
    ) -> tuple[AnimatorRopesState, Vertices]:
        """Advances to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State: from 1 us to 10 s [s].
            bones: World positions of all bones, which then drive the networks while the source rests [m].

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        if bones is None:
            moving, moved = self.source.step(state.bones, posed, dt, state.rest_bones)
            after = replace(state, bones=moving)
        else:
            moved = state.displacements(bones, posed.transforms[self.key])
            after = state
        coefficients = np.concatenate([self.skinning(moved), self.shape(moved)])
        return after, self.basis.vertices(coefficients, state.rest, posed.transforms[self.key])

    def in_wind(self, wind: tuple[float, float, float]) -> Self:
        """Returns the animator in a wind of the world [m/s]. It can step the States of this one."""
        constants = replace(self.ropes.constants, wind=wind)
        return replace(self, ropes=self.ropes.with_constants(constants))

    def relocate(self, state: AnimatorRopesState, shaped: ShapedBody, transform: RigidTransform) -> AnimatorRopesState:
        """Returns the State rotated about the vertical and translated as a whole, history included.

        Args:
            state: It is not changed.
            shaped: The body that wears the garment.
            transform: From where it was to where it is.
        """
        return replace(state, bones=state.bones.relocate(transform))

    def follow(
        self, state: AnimatorRopesState, posed: PosedBody, dt: float, truth: Vertices
    ) -> tuple[AnimatorRopesState, Vertices]:
        """Advances like `step`, driven by the bones of simulated vertices."""
        return self.step(state, posed, dt, bones=bones_of_mesh(self.ropes, truth, posed))

    def at_detail(self, detail: float) -> "AnimatorRopes | AnimatorRopesLevel":
        """Returns this animator with a fraction of its vertices; itself for 1.

        Raises:
            BadInput: As `coarser_garment`.
        """
        if detail == 1:
            return self
        if detail not in self._levels:
            parts = ((self.skinning, self.skinning_basis), (self.shape, self.shape_basis))
            self._levels[detail] = AnimatorRopesLevel.of(self, detail, self.source, parts)
        return self._levels[detail]

    def save(self, path: str | Path) -> None:
        """Writes a model file, completely or not at all.

        Raises:
            BadOutput: The path cannot be written.
        """
        parts = {
            "ropes": self.ropes.arrays(),
            "skinning_basis": self.skinning_basis.arrays(),
            "shape_basis": self.shape_basis.arrays(),
            "skinning": self.skinning.arrays(),
            "shape": self.shape.arrays(),
            "correction": self.correction.arrays(),
        }
        arrays = {f"{name}.{key}": array for name, named in parts.items() for key, array in named.items()}
        save_model(
            path,
            self.name,
            {"rest": self.rest} | arrays,
            garment=self.garment,
            body={"name": self.body_name, "hash": self.body_hash},
            config=asdict(self.config),
            figures=self.figures,
            licences=self.licences,
            extra={"ropes": self.ropes.metadata() | {"version": VERSION, "springs": self.springs.metadata()}},
        )

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Makes an animator from the contents of a model file.

        Raises:
            BadModel: The file has another version, a key is missing or of another type, or an array has a dtype or
                shape that does not fit the others.
        """
        ropes_metadata = entry(metadata, "ropes", dict)
        _check_version(ropes_metadata.get("version", 1))
        garment = garment_of(arrays, metadata)
        with damage_as_bad_model("the model's ropes"):
            ropes = read_ropes(part(arrays, "ropes"), ropes_metadata)
        if not np.array_equal(_trim_zeros(ropes.betas), _trim_zeros(garment.body_betas)):
            raise BadModel("ropes and garment of the model are on different shapes", ropes.betas.tolist(), AGAIN)
        count = len(garment.vertices)
        if ropes.embedding.corners.max(initial=0) >= count:
            raise BadModel("a bone lies on a vertex past the garment's last", int(ropes.embedding.corners.max()), AGAIN)
        inputs = 3 * ropes.node_count
        first = PackedBasis.of(part(arrays, "skinning_basis"), vertex_count=count)
        second = PackedBasis.of(part(arrays, "shape_basis"), vertex_count=count)
        skinning = Mlp.of(part(arrays, "skinning"), inputs=inputs, outputs=first.mode_count)
        shape = Mlp.of(part(arrays, "shape"), inputs=inputs, outputs=second.mode_count)
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
            BoneCorrection.of(part(arrays, "correction"), rows=inputs),
            body_name=entry(body, "name", str),
            body_hash=entry(body, "hash", str),
            config=options_of(RopesConfig, entry(metadata, "config", dict), error=BadModel),
            springs=SpringConstants.of(entry(ropes_metadata, "springs", dict)),
            figures=figures,
            licences=tuple(str(text) for text in entry(metadata, "licences", list)),
        )

    def _rest_on(self, posed: PosedBody) -> tuple[Vertices, Nodes]:
        shaped = posed.shaped
        refuse_other_body(self, shaped)
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


def _check_version(found: Any) -> None:
    if found != VERSION:
        newer = isinstance(found, int) and found > VERSION
        cure = "upgrade hemline" if newer else "fit again with 'hemline fit'"
        raise BadModel(f"this hemline reads version {VERSION} of rope chains", f"version {found}", cure)


def _trim_zeros(betas: np.ndarray) -> np.ndarray:
    return np.trim_zeros(np.asarray(betas, np.float32).reshape(-1), "b")

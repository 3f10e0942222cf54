"""The animator of a close-fitting garment, for a body of any shape in any pose."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from hemline.animators.model_file import save_model
from hemline.animators.own_body import own_body, refuse_other_body
from hemline.animators.rigid_transform import RigidTransform
from hemline.arrays import Float, Int, Quaternions, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.bodies.lifted_arms import LIFT_DEG, lift_rotations
from hemline.errors import BadInput
from hemline.garments import Garment, Material, coarser_garment
from hemline.motions.motion import Pose
from hemline.motions.quaternions import to_matrix

from .binding import Binding
from .bounds import (
    DEFAULT_BETA_RANGE,
    DEFAULT_STRETCH_LIMIT,
    NOVELTY_LIMIT,
    BetaRange,
    novelty,
    reliable_range,
    warn_of_extreme_betas,
    warn_of_unknown_material,
)
from .config import AgentDressConfig
from .contents import arrays_of, fields_of, metadata_of
from .detail import AnimatorAgentDressLevel
from .distance_kernels import axes_distances, mix, pose_axes
from .distances import anchor_weights
from .garment_kernels import pose_garment
from .kernel_inputs import GarmentTables
from .materials import Materials
from .pose_model import kernel
from .shape_model import pad_betas, shape_features
from .state import AgentDressState
from .tables import Tables

LEAST_JOINT_WEIGHT = 1e-3
"""Joints whose weight is below this fraction of the largest one, in every region, do not count in distances."""


@dataclass(frozen=True, eq=False)
class AnimatorAgentDress:
    r"""A garment predicted from settled drapes.

    $$x = \sum_b w_b A_b(\beta, \theta)\, \bar x(\beta) + R(\theta) \left(\bar u + \sum_g r_g B \left(K_g(\theta) +
    \sum_s S_g^s(\theta)\, E_{g,s}(\beta)\right)\right)$$

    where $\bar x$ is the garment in the rest pose of the body, $A_b$ are the skin transforms of the body, $R$ is the
    blended rotation of the bones, $r_g$ are region weights, $K_g$ is the pose model (a kernel regression), $E_{g,s}$ is
    the effect of the body shape in pose $s$ (`ShapeSamples`), and $S_g^s$ is a kernel or the weights of the nearest
    anchors. Rigging, if it is the pose model, replaces $\bar u$ and $K_g$. `Materials` adds the effect of another
    material to that of the shape.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 4. Differs: the offsets of an anchor from its skinned garment are taken in rotated vertex frames, and the
        bones of the query are applied once; shapes and poses share one basis in these frames.
    """

    garment: Garment
    tables: Tables
    body_name: str
    body_hash: str
    config: AgentDressConfig
    width: float
    """Width of the kernel of the pose model."""
    shape_width: float
    """Width of the kernel over poses in the shape model."""
    figures: Mapping[str, float] = field(default_factory=dict)
    licences: tuple[str, ...] = ()
    fitted_betas: BetaRange = DEFAULT_BETA_RANGE
    """Lowest and highest beta of the anchors."""
    stretch_limit: float = DEFAULT_STRETCH_LIMIT
    """Longest length of an edge, over the longer of those on the pattern and at rest on the body."""
    lift_deg: float = LIFT_DEG
    """Angle by which hanging arms were lifted in the poses of the fit [deg]."""
    materials: Materials | None = None
    """Effects of other materials than that of the fit, if the garment was also draped in others."""
    name = "agentdress"
    novelty_limit = NOVELTY_LIMIT

    _levels: dict[float, AnimatorAgentDressLevel] = field(default_factory=dict, init=False, repr=False)

    @property
    def beta_range(self) -> BetaRange:
        """Range of each beta in which the shape model is reliable."""
        return reliable_range(self.fitted_betas)

    def novelty(self, state: AgentDressState) -> float:
        """Returns the distance of the pose of a State from the nearest pose of the fit; 1 is that between anchors."""
        return novelty(state.distances, self._region_sizes)

    @property
    def known_materials(self) -> tuple[str, ...]:
        """Names of the materials in which the garment was draped, that of the fit first."""
        if self.materials is None:
            return (self.garment.material.name,)
        return (self.materials.own.name, *self.materials.known)

    def in_material(self, material: Material | str) -> Self:
        """Returns the animator with its garment made of another material.

        Args:
            material: A material or its name; the material of the fit is allowed.

        Raises:
            BadInput: The model was fitted to a single material.
            BadGarment: There is no such material.

        Warns:
            HemlineWarning: The material lies outside the range of those in which the garment was draped.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, section 6, which leaves material as a further dimension to future work.
        """
        target = Material.of(material)
        if target == self.garment.material:
            return self
        if self.materials is None:
            cure = "drape it in others (hemline drape --material NAME --poses-of DATASET), then fit to all of them"
            what = f"the model of '{self.garment.name}' knows one material, {self.garment.material.name}"
            raise BadInput(what, target.name, cure)
        warn_of_unknown_material(self.garment.name, self.materials, target)
        return replace(self, garment=self.garment.in_material(target))

    @cached_property
    def _material_effects(self) -> Float[np.ndarray, "regions poses shape_modes"] | None:
        """Effect of the material in each pose; None for the material of the fit."""
        if self.materials is None or self.garment.material == self.materials.own:
            return None
        return self.materials.effects(self.garment.material)

    @cached_property
    def _region_sizes(self) -> Float[np.ndarray, " regions"]:
        return self.tables.regions.mean(axis=0)

    @cached_property
    def _joints(self) -> Int[np.ndarray, " counting"]:
        """Joints whose rotation counts in some region."""
        axes = self.tables.axes
        relative = axes / np.maximum(axes.max(axis=1, keepdims=True), 1e-20)
        return np.flatnonzero(relative.reshape(len(axes), -1, 3).max(axis=(0, 2)) > LEAST_JOINT_WEIGHT)

    @cached_property
    def _anchor_axes(self) -> Float[np.ndarray, "counting 9 poses"]:
        """Axes of the frames of these joints in all poses of the model."""
        axes = to_matrix(self.tables.rotations[:, self._joints]).transpose(1, 3, 2, 0)
        return np.ascontiguousarray(axes.reshape(len(self._joints), 9, -1), np.float32)

    @cached_property
    def _digits(self) -> Int[np.ndarray, "verts 3 columns"]:
        digits = self.tables.basis.digits
        return np.ascontiguousarray(digits).reshape(-1, 3, digits.shape[1])

    @cached_property
    def _kernel_tables(self) -> GarmentTables:
        t = self.tables
        return GarmentTables(t.indices, t.weights, t.regions, self._digits)

    @cached_property
    def _binding(self) -> Binding:
        return Binding(self.tables.indices, self.tables.weights, self.tables.nearest)

    @cached_property
    def _mean_body(self) -> ShapedBody:
        """Body of mean shape, which the rigged anchors were draped on."""
        return own_body(self).shaped()

    def start(self, posed: PosedBody) -> AgentDressState:
        """Returns the State of a garment at rest on a body of any shape, in its first pose.

        Raises:
            BadInput: The body is not the one of the fit.

        Warns:
            HemlineWarning: A beta of the body is outside `beta_range`.
        """
        shaped = posed.shaped
        refuse_other_body(self, shaped)
        warn_of_extreme_betas(self.garment.name, self.fitted_betas, shaped.betas)
        tables = self.tables
        features = shape_features(pad_betas(shaped.betas[None], len(tables.rest_effects) // 2))[0].astype(np.float32)
        rest = tables.rest + np.einsum("f,fvi->vi", features, tables.rest_effects)
        effects, material_effects = tables.shapes.effects(shaped.betas), self._material_effects
        if material_effects is not None:
            effects = np.concatenate([effects, material_effects], axis=1)
        return AgentDressState(rest, effects)

    def step(self, state: AgentDressState, posed: PosedBody, dt: float) -> tuple[AgentDressState, Vertices]:
        """Advances to a pose.

        Args:
            state: The previous State, which is not changed.
            posed: The posed body.
            dt: Time since the previous State [s], of any length.

        Returns:
            The new State, and the vertices in the world (verts, 3) [m].
        """
        after = self._follow(state, posed.pose, dt)
        return after, self._pose_garment(after, posed, self._rigging_offsets(after, posed))

    def at_detail(self, detail: float) -> "AnimatorAgentDress | AnimatorAgentDressLevel":
        """Returns this animator with a fraction of its vertices; itself for 1.

        Raises:
            BadInput: The fraction is not above 0 and at most 1, or leaves fewer than 50 vertices.
        """
        if detail == 1:
            return self
        if detail not in self._levels:
            garment, kept = coarser_garment(self.garment, detail)
            reduced = replace(self, garment=garment, tables=self.tables.at_vertices(kept))
            self._levels[detail] = AnimatorAgentDressLevel(self, garment, kept, reduced)
        return self._levels[detail]

    def redress(
        self, state: AgentDressState, posed: PosedBody, dt: float, worn: Vertices, nominal: PosedBody
    ) -> tuple[AgentDressState, Vertices]:
        r"""Advances to a pose like `step`, with a given garment as clothing pose model $f(\beta_0, \theta)$.

        The anchors still supply the effect of the body shape.

        Args:
            state: The previous State, which is not changed.
            posed: The posed body.
            dt: Time since the previous State [s], of any length.
            worn: The garment on the body of the fit in this pose (verts, 3) [m].
            nominal: The body of the fit in this pose.

        Raises:
            BadInput: `nominal` differs in shape from the body of the fit, or `worn` in its number of vertices.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, Eq. 4 and section 4.4, a simulated sequence as clothing pose model.
        """
        fitted = np.pad(self.garment.body_betas, (0, len(nominal.shaped.betas) - len(self.garment.body_betas)))
        if not np.array_equal(nominal.shaped.betas, fitted):
            got = " ".join(f"{beta:g}" for beta in nominal.shaped.betas)
            raise BadInput(
                f"'{self.garment.name}' is put on other shapes from the one that it was made on",
                f"betas {got}",
                "simulate it there: without --betas for a garment of the mean body",
            )
        if worn.shape != state.rest.shape:
            raise BadInput(f"'{self.garment.name}' has vertices {state.rest.shape}", worn.shape, "give its own mesh")
        after = self._follow(state, posed.pose, dt)
        offset = self._binding.offsets(nominal.transforms, self.tables.rest, worn.astype(np.float64))
        return after, self._pose_garment(after, posed, offset.astype(np.float32))

    def _follow(self, state: AgentDressState, pose: Pose, dt: float) -> AgentDressState:
        r"""Returns the State whose axes follow the pose: $\exp(-\Delta t / \tau)$ of the difference remains.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, Eq. 9. Differs: the axes follow, not the distances. The mean of squared distances to two poses is that
            of a pose far from everything between them, for which a regression predicts nothing meaningful.
        """
        axes = self._axes(lift_rotations(pose.rotations, self.lift_deg))
        if state.axes is not None and self.config.decay_seconds > 0:
            decay = np.float32(np.exp(-dt / self.config.decay_seconds))
            axes = decay * state.axes + (1 - decay) * axes
        return replace(state, axes=axes, distances=self._distances(axes))

    def drape(self, posed: PosedBody) -> Vertices:
        """Returns the garment in a pose with arms already lifted, as anchors have, without history (verts, 3) [m].

        Experiments compare it with a garment simulated into this pose.

        Raises:
            BadInput: See `start`.
        """
        axes = self._axes(posed.pose.rotations)
        state = replace(self.start(posed), axes=axes, distances=self._distances(axes))
        return self._pose_garment(state, posed, self._rigging_offsets(state, posed))

    def at_rest(self, state: AgentDressState, shaped: ShapedBody) -> Vertices:
        """Returns the garment in the rest pose of the body of a State, which wears it (verts, 3) [m]."""
        return state.rest

    def relocate(self, state: AgentDressState, shaped: ShapedBody, transform: RigidTransform) -> AgentDressState:
        """Returns the State unchanged: it holds no world positions and no heading."""
        return state

    def reshape(self, state: AgentDressState, shaped: ShapedBody) -> AgentDressState:
        """Returns the State on a body of another shape, for a shape slider or a new agent in a crowd.

        Args:
            state: The State on the previous body, which is not changed.
            shaped: The new body.

        Raises:
            BadInput: See `start`.
        """
        return replace(self.start(shaped.posed(shaped.rest_pose)), axes=state.axes, distances=state.distances)

    def _rigging_offsets(self, state: AgentDressState, posed: PosedBody) -> Vertices | None:
        """Returns the offsets that rigged anchors predict in a pose [m]; None if the pose model is a kernel."""
        tables, rigged = self.tables, self.tables.rigged
        if rigged is None:
            return None
        assert state.distances is not None
        place = self._mean_body.rest_pose.translation
        transforms = self._mean_body.transforms_of(posed.pose.rotations[None], place[None])[0][0]
        blend = anchor_weights(state.distances[:, rigged.poses], **self.config.blending)
        return rigged.offset(transforms, blend, tables.regions, self._binding, tables.rest)

    def _pose_garment(self, state: AgentDressState, posed: PosedBody, offset: Vertices | None = None) -> Vertices:
        """Returns the posed garment of a State [m]; `offset`, if given, replaces the pose model [m]."""
        assert state.distances is not None
        tables, vertices = self.tables, np.empty_like(state.rest)
        mixed = self._basis_coefficients(state.distances, state.effects, posing=offset is None)
        base = tables.offset if offset is None else offset
        pose_garment(self._kernel_tables, state.rest, base, mixed, posed.transforms, vertices)
        return vertices

    def _axes(self, lifted: Quaternions) -> Float[np.ndarray, "counting 9"]:
        """Returns the axes of the frames of the joints that count, for lifted arms and without heading."""
        axes = np.empty((len(self._joints), 9), np.float32)
        pose_axes(self._joints, lifted, axes)
        return axes

    def _distances(self, axes: Float[np.ndarray, "counting 9"]) -> Float[np.ndarray, "regions poses"]:
        """Returns the squared distances to all poses of the model."""
        tables = self.tables
        distances = np.empty((len(tables.axes), len(tables.rotations)), np.float32)
        axes_distances(self._anchor_axes, tables.axes, self._joints, axes, distances)
        return distances

    def _basis_coefficients(
        self,
        distances: Float[np.ndarray, "regions poses"],
        effects: Float[np.ndarray, "shape_regions shape_poses shape_modes"],
        *,
        posing: bool = True,
    ) -> Float[np.ndarray, "regions columns"]:
        """Returns the scaled basis coefficients of each region [m], from pose (if `posing`), shape and material."""
        tables, basis = self.tables, self.tables.basis
        coefficients = np.empty((len(distances), len(basis.modes)), np.float32)
        exact = distances.astype(np.float64)
        pose_kernel = kernel(exact if posing else exact[:, :0], self.width)
        shape_kernel = self._anchor_weights(exact[:, : tables.shapes.pose_count])
        material_poses = effects.shape[1] - tables.shapes.pose_count
        if self.materials is not None and material_poses:
            shape_kernel = np.hstack([shape_kernel, kernel(exact[:, :material_poses], self.materials.width)])
        mix(pose_kernel, tables.pose_weights, shape_kernel, effects, basis.modes, basis.scales, coefficients)
        return coefficients

    def _anchor_weights(self, distances: Float[np.ndarray, "regions anchors"]) -> Float[np.ndarray, "regions anchors"]:
        """Returns the weight of each anchor in the effect of the shape."""
        if self.config.shape_model == "kernel":
            return kernel(distances, self.shape_width)
        return anchor_weights(distances, **self.config.blending)

    def save(self, path: str | Path) -> None:
        """Writes a model file, completely or not at all.

        Raises:
            BadOutput: The path cannot be written.
        """
        save_model(
            path,
            self.name,
            arrays_of(self.tables, self.materials),
            garment=self.garment,
            body={"name": self.body_name, "hash": self.body_hash},
            config=asdict(self.config),
            figures=self.figures,
            licences=self.licences,
            extra=metadata_of(
                self.materials,
                width=self.width,
                shape_width=self.shape_width,
                betas=self.fitted_betas,
                stretch_limit=self.stretch_limit,
                lift_deg=self.lift_deg,
            ),
        )

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Makes an animator from the contents of a model file.

        Raises:
            BadModel: The file has another version, a key is missing or has the wrong type, or an array has the wrong
                dtype or shape.
        """
        return cls(**fields_of(arrays, metadata))

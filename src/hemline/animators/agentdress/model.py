"""A close-fitting garment that follows any body in any pose."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from hemline import bodies
from hemline.animators.teleport import RigidTransform
from hemline.animators.model_file import save_model
from hemline.animators.own_body import refuse_other_body
from hemline.arrays import Float, Int, Quaternions, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.bodies.lifted_arms import lifted_rotations
from hemline.errors import BadInput
from hemline.garments import Garment, Material, coarser_garment
from hemline.motions.motion import Pose
from hemline.motions.quaternions import to_matrix

from .binding import Binding
from .bounds import DEFAULT_BETA_RANGE, NOVELTY_LIMIT, BetaRange, reliable_range, novelty, warn_of_extreme_betas, warn_of_unknown_material
from .config import AgentDressConfig
from .contents import arrays_of, fields_of, metadata_of
from .detail import AnimatorAgentDressLevel
from .distance_kernels import axes_distances, mix, pose_axes
from .distances import anchor_weights
from .materials import Materials
from .pose_model import kernel
from .shape_model import shape_features, pad_betas
from .state import AgentDressState
from .tables import Tables
from .garment_kernels import pose_garment

LEAST_JOINT_WEIGHT = 1e-3
"""Joints with less than this share of the largest weight in every region are left out of distances."""

DEEPEST_PUSH, FARTHEST_ASIDE = 0.03, 0.03
"""A vertex that is deeper in the skin is left to the projection, and one that has gone farther from its vertex of the
body, along the skin [m]."""


@dataclass(frozen=True, eq=False)
class AnimatorAgentDress:
    r"""A garment of settled states, blended.

    $$x = \sum_b w_b A_b(\beta, \theta)\, \bar x(\beta) + R(\theta) \left(\bar u + \sum_g r_g B \left(K_g(\theta) +
    \sum_s S_g^s(\theta)\, E_{g,s}(\beta)\right)\right)$$

    with $\bar x$ the garment in the rest pose of the body, $A_b$ the skin transforms of the body as it is, $R$ the
    blended rotation of the bones, $r_g$ regions, $K_g$ the pose model (a kernel regression), $E_{g,s}$ what the shape
    adds in pose $s$ (`ShapeSamples`), $S_g^s$ a kernel or the weights of the nearest anchors. Where the pose model is
    rigging, it takes the place of $\bar u$ and $K_g$. Another material adds to the shape what `Materials` knows.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 4. Differs: what an anchor adds to skinning is taken in the turned frames of the vertices, and the query's
        bones are applied once; there shapes and poses share one basis.
    """

    garment: Garment
    tables: Tables
    body_name: str
    body_hash: str
    config: AgentDressConfig
    width: float
    """Of the kernel of the pose model."""
    shape_width: float
    """Of the kernel over poses of the shape model."""
    figures: Mapping[str, float] = field(default_factory=dict)
    licences: tuple[str, ...] = ()
    fitted_betas: BetaRange = DEFAULT_BETA_RANGE
    """Of the anchors."""
    materials: Materials | None = None
    """What other materials add than that of the fit, where it was draped in others, too."""
    name = "agentdress"
    novelty_limit = NOVELTY_LIMIT

    _levels: dict[float, AnimatorAgentDressLevel] = field(default_factory=dict, init=False, repr=False)

    @property
    def beta_range(self) -> BetaRange:
        """From where to where the shape model is believed in each beta."""
        return reliable_range(self.fitted_betas)

    def novelty(self, state: AgentDressState) -> float:
        """How far the pose of a State is from the nearest one of the fit; 1: as far as anchors are apart."""
        return novelty(state.distances, self._region_sizes)

    @property
    def known_materials(self) -> tuple[str, ...]:
        """Names of the materials that the garment was draped in, that of the fit first."""
        if self.materials is None:
            return (self.garment.material.name,)
        return (self.materials.own.name, *self.materials.known)

    def in_material(self, material: Material | str) -> Self:
        """The garment made of another material.

        Args:
            material: The material, or the name of one; that of the fit, too.

        Raises:
            BadInput: The model was fitted to one material alone.
            BadGarment: No such material.

        Warns:
            HemlineWarning: It lies outside of all those that the garment was draped in.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, section 6, where the material as a dimension of its own is left to the future.
        """
        chosen = Material.of(material)
        if chosen == self.garment.material:
            return self
        if self.materials is None:
            cure = "drape it in others (hemline drape --material NAME --poses-of DATASET), then fit to all of them"
            what = f"the model of '{self.garment.name}' knows one material, {self.garment.material.name}"
            raise BadInput(what, chosen.name, cure)
        warn_of_unknown_material(self.garment.name, self.materials, chosen)
        return replace(self, garment=self.garment.in_material(chosen))

    @cached_property
    def _material_effects(self) -> Float[np.ndarray, "regions poses shape_modes"] | None:
        """What the material adds in each pose; None for that of the fit."""
        if self.materials is None or self.garment.material == self.materials.own:
            return None
        return self.materials.effects(self.garment.material)

    @cached_property
    def _region_sizes(self) -> Float[np.ndarray, " regions"]:
        return self.tables.regions.mean(axis=0)

    @cached_property
    def _joints(self) -> Int[np.ndarray, " counting"]:
        """Joints whose turns count in some region."""
        axes = self.tables.axes
        shares = axes / np.maximum(axes.max(axis=1, keepdims=True), 1e-20)
        return np.flatnonzero(shares.reshape(len(axes), -1, 3).max(axis=(0, 2)) > LEAST_JOINT_WEIGHT)

    @cached_property
    def _anchor_axes(self) -> Float[np.ndarray, "counting 9 poses"]:
        """The axes of these joints' frames in the poses of the model, one after the other."""
        turned = to_matrix(self.tables.rotations[:, self._joints]).transpose(1, 3, 2, 0)
        return np.ascontiguousarray(turned.reshape(len(self._joints), 9, -1), np.float32)

    @cached_property
    def _digits(self) -> Int[np.ndarray, "verts 3 columns"]:
        digits = self.tables.basis.digits
        return np.ascontiguousarray(digits).reshape(-1, 3, digits.shape[1])

    @cached_property
    def _binding(self) -> Binding:
        return Binding(self.tables.indices, self.tables.weights, self.tables.nearest)

    @cached_property
    def _mean_body(self) -> ShapedBody:
        """The body that rigged anchors are on."""
        return bodies.load(self.body_name).shaped()

    def start(self, posed: PosedBody) -> AgentDressState:
        """At rest on a body of any shape, in its first pose.

        Raises:
            BadInput: The body is another one than that of the fit.

        Warns:
            HemlineWarning: A beta of the body is outside `beta_range`.
        """
        shaped = posed.shaped
        refuse_other_body(self, shaped)
        warn_of_extreme_betas(self.garment.name, self.fitted_betas, shaped.betas)
        tables = self.tables
        features = shape_features(pad_betas(shaped.betas[None], len(tables.rest_effects) // 2))[0].astype(np.float32)
        rest = tables.rest + np.einsum("f,fvi->vi", features, tables.rest_effects)
        effects, of_material = tables.shapes.effects(shaped.betas), self._material_effects
        if of_material is not None:
            effects = np.concatenate([effects, of_material], axis=1)
        return AgentDressState(rest, shaped.normals[tables.nearest], effects)

    def step(self, state: AgentDressState, posed: PosedBody, dt: float) -> tuple[AgentDressState, Vertices]:
        """Advance to a pose.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State [s]; any.

        Returns:
            The State after, and the vertices in the world (verts, 3) [m].
        """
        after = self._follow(state, posed.pose, dt)
        return after, self._pose_garment(after, posed, self._rigging_offsets(after, posed))

    def at_detail(self, detail: float) -> "AnimatorAgentDress | AnimatorAgentDressLevel":
        """This animator with a share of its vertices; itself for 1.

        Raises:
            BadInput: A share that is not above 0 and at most 1, or that leaves fewer than 50 vertices.
        """
        if detail == 1:
            return self
        if detail not in self._levels:
            garment, kept = coarser_garment(self.garment, detail)
            part = replace(self, garment=garment, tables=self.tables.at_vertices(kept))
            self._levels[detail] = AnimatorAgentDressLevel(self, garment, kept, part)
        return self._levels[detail]

    def redress(
        self, state: AgentDressState, posed: PosedBody, dt: float, worn: Vertices, nominal: PosedBody
    ) -> tuple[AgentDressState, Vertices]:
        r"""As `step`, with any clothing pose model $f(\beta_0, \theta)$: what the shape adds is the anchors'.

        Args:
            state: The State before; it is not changed.
            posed: The body now.
            dt: Time since the State [s]; any.
            worn: The garment on the body of the fit in this pose (verts, 3) [m].
            nominal: That body there.

        Raises:
            BadInput: `nominal` has another shape than the body of the fit, or `worn` another number of vertices.

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
        r"""The State when time has gone on: axes that follow the pose, $\exp(-\Delta t / \tau)$ of what they were.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, Eq. 9. Differs: the axes follow, not the distances: means of squared distances to two poses are those
            of a pose that is far from all between the two, and a regression makes of it what no pose is given.
        """
        axes = self._axes(lifted_rotations(pose.rotations))
        if state.axes is not None and self.config.decay_seconds > 0:
            kept = np.float32(np.exp(-dt / self.config.decay_seconds))
            axes = kept * state.axes + (1 - kept) * axes
        return replace(state, axes=axes, distances=self._distances(axes))

    def settled(self, posed: PosedBody) -> Vertices:
        """The garment in a pose of the kind that anchors have, arms lifted already, with no past (verts, 3) [m].

        What a garment that was walked into this pose is compared with.

        Raises:
            BadInput: As `start`.
        """
        axes = self._axes(posed.pose.rotations)
        state = replace(self.start(posed), axes=axes, distances=self._distances(axes))
        return self._pose_garment(state, posed, self._rigging_offsets(state, posed))

    def at_rest(self, state: AgentDressState) -> Vertices:
        """The garment in the rest pose of the body of a State (verts, 3) [m]."""
        return state.rest

    def relocate(self, state: AgentDressState, shaped: ShapedBody, way: RigidTransform) -> AgentDressState:
        """The State as it is: it holds no places of the world, and no heading."""
        return state

    def reshaped(self, state: AgentDressState, shaped: ShapedBody) -> AgentDressState:
        """The State on a body of another shape: what a slider asks for, and an agent that joins a crowd.

        Args:
            state: The State on the body before; it is not changed.
            shaped: The body from now on.

        Raises:
            BadInput: As `start`.
        """
        return replace(self.start(shaped.posed(shaped.rest_pose)), axes=state.axes, distances=state.distances)

    def _rigging_offsets(self, state: AgentDressState, posed: PosedBody) -> Vertices | None:
        """What rigged anchors add in a pose [m]; None where the pose model is a kernel, which `_mixed` takes in."""
        tables, rigged = self.tables, self.tables.rigged
        if rigged is None:
            return None
        assert state.distances is not None
        here = self._mean_body.rest_pose.translation
        transforms = self._mean_body.transforms_of(posed.pose.rotations[None], here[None])[0][0]
        blend = anchor_weights(state.distances[:, rigged.poses], **self.config.blending)
        return rigged.offset(transforms, blend, tables.regions, self._binding, tables.rest)

    def _pose_garment(self, state: AgentDressState, posed: PosedBody, offset: Vertices | None = None) -> Vertices:
        """The garment in a pose that was followed; an offset stands in the place of the pose model [m]."""
        assert state.distances is not None
        tables, vertices = self.tables, np.empty_like(state.rest)
        pose_garment(
            tables.indices,
            tables.weights,
            tables.nearest,
            tables.regions,
            self._digits,
            tables.clearances,
            self._basis_coefficients(state.distances, state.effects, posing=offset is None),
            state.rest,
            tables.offset if offset is None else offset,
            state.normals,
            posed.transforms,
            posed.vertices,
            np.array([DEEPEST_PUSH, FARTHEST_ASIDE], np.float32),
            vertices,
        )
        return vertices

    def _axes(self, lifted: Quaternions) -> Float[np.ndarray, "counting 9"]:
        """Of the frames of the joints that count, arms lifted as in the anchors, heading left out."""
        axes = np.empty((len(self._joints), 9), np.float32)
        pose_axes(self._joints, lifted, axes)
        return axes

    def _distances(self, axes: Float[np.ndarray, "counting 9"]) -> Float[np.ndarray, "regions poses"]:
        """To all poses of the model."""
        tables = self.tables
        distances = np.empty((len(tables.axes), len(tables.rotations)), np.float32)
        axes_distances(self._anchor_axes, tables.axes, self._joints, axes, distances)
        return distances

    def _basis_coefficients(
        self,
        distances: Float[np.ndarray, "regions poses"],
        effects: Float[np.ndarray, "shape_regions told shape_modes"],
        *,
        posing: bool = True,
    ) -> Float[np.ndarray, "regions columns"]:
        """What each region makes of pose, if it is asked, of shape and of material: by columns of the basis, with their
        scales [m].
        """
        tables, basis = self.tables, self.tables.basis
        mixed = np.empty((len(distances), len(basis.modes)), np.float32)
        exact = distances.astype(np.float64)
        pose_shares = kernel(exact if posing else exact[:, :0], self.width)
        shape_shares = self._anchor_weights(exact[:, : tables.shapes.pose_count])
        others = effects.shape[1] - tables.shapes.pose_count
        if self.materials is not None and others:
            shape_shares = np.hstack([shape_shares, kernel(exact[:, :others], self.materials.width)])
        mix(pose_shares, tables.pose_weights, shape_shares, effects, basis.modes, basis.scales, mixed)
        return mixed

    def _anchor_weights(self, distances: Float[np.ndarray, "regions anchors"]) -> Float[np.ndarray, "regions anchors"]:
        """What each anchor counts for in what the shape adds."""
        if self.config.shape_model == "kernel":
            return kernel(distances, self.shape_width)
        return anchor_weights(distances, **self.config.blending)

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all.

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
            extra=metadata_of(self.materials, width=self.width, shape_width=self.shape_width, betas=self.fitted_betas),
        )

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Make one from what a model file holds.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array of another dtype
                or shape than the rest asks for.
        """
        return cls(**fields_of(arrays, metadata))

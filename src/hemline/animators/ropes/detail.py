"""Rope chains that carry a coarser garment."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.animators.base import Animator
from hemline.animators.level import LevelOf
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.bones import bones_of_mesh
from hemline.arrays import Float, Int, Vertices
from hemline.bodies.body import PosedBody
from hemline.garments import Garment, coarser_garment
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import PackedBasis
from hemline.motions.motion import JOINT_NAMES

from .animator_state import AnimatorRopesState


@dataclass(frozen=True, eq=False)
class AnimatorRopesLevel(LevelOf):
    """An `AnimatorRopes` at a lower level of detail. It has the States of the full one, so they can be exchanged."""

    full: Animator
    garment: Garment
    vertex_ids: Int[np.ndarray, " kept"]
    """Index of each vertex in the full garment."""
    source: BoneSource
    networks: tuple[Mlp, ...]
    basis: PackedBasis
    """Basis of the remaining vertices; its coefficients are those of all networks, one after the other."""

    @classmethod
    def of(cls, full: Animator, detail: float, source: BoneSource, parts: Sequence[tuple[Mlp, PackedBasis]]) -> Self:
        """Returns a level of an animator.

        Args:
            full: The animator.
            detail: Fraction of its vertices.
            source: Its bones.
            parts: Its networks, each with the basis of its coefficients.

        Raises:
            BadInput: As `coarser_garment`.
        """
        garment, vertex_ids = coarser_garment(full.garment, detail)
        networks, (basis, *others) = zip(*parts, strict=True)
        for other in others:
            basis = basis.concatenate(other)
        return cls(full, garment, vertex_ids, source, networks, basis.at_vertices(vertex_ids))

    def start(self, posed: PosedBody) -> AnimatorRopesState:
        """Returns the State at rest, that of the full animator."""
        return self.full.start(posed)

    def step(self, state: AnimatorRopesState, posed: PosedBody, dt: float) -> tuple[AnimatorRopesState, Vertices]:
        """Advances to a pose.

        Args:
            state: The State before, of any level of this animator; it is not changed.
            posed: The body now.
            dt: Time since the State: from 1 us to 10 s [s].

        Returns:
            The State after, and the remaining vertices in the world (verts, 3) [m].
        """
        moving, moved = self.source.step(state.bones, posed, dt, state.rest_bones)
        return replace(state, bones=moving), self._vertices(state, posed, moved)

    def follow(
        self, state: AnimatorRopesState, posed: PosedBody, dt: float, truth: Vertices
    ) -> tuple[AnimatorRopesState, Vertices]:
        """Advances like `step`, driven by the bones of simulated vertices of the full garment."""
        bones = bones_of_mesh(self.source.ropes, truth, posed)
        return state, self._vertices(state, posed, state.displacements(bones, posed.transforms[self._key]))

    @property
    def _key(self) -> int:
        return JOINT_NAMES.index(self.garment.key_joint)

    def _vertices(self, state: AnimatorRopesState, posed: PosedBody, moved: Float[np.ndarray, " ins"]) -> Vertices:
        coefficients = np.concatenate([network(moved) for network in self.networks])
        return self.basis.vertices(coefficients, state.rest[self.vertex_ids], posed.transforms[self._key])

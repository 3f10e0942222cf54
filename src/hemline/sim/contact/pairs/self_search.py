"""Search for self-contact of a sheet within a step, and for self-crossings at its start."""

import functools
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from hemline.sim.cloth.sheet import Sheet

from .contour_kernels import contour_directions
from .lane_kernels import fill_lanes
from .pair_kernels import PairRows
from .pair_search_kernels import (
    PATCH_PAIR_CHUNK,
    SEARCH_MARGIN,
    ClothMesh,
    Elements,
    SearchedCloth,
    near_pairs,
    piercing_edges,
)
from .patch_kernels import (
    ElementBounds,
    GroupBounds,
    PatchBounds,
    PatchRows,
    element_bounds,
    group_bounds,
    patch_bounds,
    patch_pairs,
)
from .patches import lanes_of, make_patches
from .self_contact import SelfContact

UNTANGLE_DISTANCE = 0.003
"""Approximate distance by which a crossing is pulled apart in a step [m]."""

PATCHES_PER_GROUP = 8
"""Patches in a group; groups are compared first."""


class SelfSearch:
    """Finds the pairs of a sheet with itself, step by step.

    It keeps only working memory from step to step, which changes no result.

    Args:
        sheet: The cloth.
        thickness: Distance that the cloth keeps from itself [m].
        stiffness: Contact stiffness per area [N/m^3].
        friction: Coulomb's coefficient of cloth on cloth at each vertex.
    """

    def __init__(self, sheet: Sheet, *, thickness: float, stiffness: float, friction: Float[np.ndarray, " verts"]):
        self.sheet, self.patches = sheet, make_patches(sheet, thickness)
        self.stiffness, self.friction = stiffness * sheet.vertex_area, friction
        patches, count = self.patches, self.patches.count
        self.thickest = 2 * float(patches.radius.max())
        self._edges = sheet.edges.astype(np.uint32)
        self._mesh = ClothMesh(sheet.faces, self._edges, patches.radius, patches.joined)
        self._rows = PatchRows(patches.vertices, patches.edges, patches.faces)
        self._elements = Elements(*(lanes_of(each) for each in self._rows))
        counts = len(sheet.faces), len(sheet.edges), sheet.vertex_count
        self._element_bounds = ElementBounds(*(np.empty((each, 11)) for each in counts))
        self._patch_bounds = PatchBounds(np.empty((count, 6)), np.empty((count, 4)), np.empty((count, 4)))
        groups = (count + PATCHES_PER_GROUP - 1) // PATCHES_PER_GROUP
        self._group_bounds = GroupBounds(np.empty((groups, 6)), np.empty((groups, 4)))
        self._room: dict[str, int] = {"patches": 32, "near": 256, "piercing": 64}

    def find(self, start: Float[np.ndarray, "verts 3"], guess: Float[np.ndarray, "verts 3"]) -> SelfContact:
        """Returns the pairs that may touch between the start and the guess, and the edges that cross the cloth at the
        start.
        """
        sheet, frames, bounds, elements = self.sheet, self._element_bounds, self._patch_bounds, self._elements
        moved = guess - start
        element_bounds(start, moved, sheet.faces, self._edges, sheet.corners, frames)
        patch_bounds(start, moved, sheet.faces, self._edges, frames.faces, self._rows, bounds)
        for of, lanes in zip((frames.vertices, frames.edges, frames.faces), elements, strict=True):
            fill_lanes(of, bounds.motion, start[0], lanes)
        cloth, mesh = SearchedCloth(start, moved, frames, bounds, elements), self._mesh
        pairs, slack = self._patch_pairs(), self.thickest + SEARCH_MARGIN
        met = np.empty(len(pairs), bool)
        corners = self._collect("near", 5, len(pairs), functools.partial(near_pairs, cloth, mesh, pairs, slack, met))
        crossing = pairs[met]
        crossed = self._collect("piercing", 2, len(crossing), functools.partial(piercing_edges, cloth, mesh, crossing))
        if len(crossed):
            corners = self._without_crossings(crossed, corners)
        return SelfContact(
            start,
            corners,
            thickness=self._pair_thickness(corners),
            stiffness=self.stiffness[corners[:, :4]].mean(axis=1),
            friction=self.friction[corners[:, :4]].mean(axis=1),
            untangling=self._untangling(start, crossed) if len(crossed) else None,
            crossed=self._edges[crossed[:, 0]],
        )

    def _pair_thickness(self, corners: np.ndarray) -> np.ndarray:
        """Returns the distance that the elements of each pair keep [m]."""
        one, two, three, four = self.patches.radius[corners[:, :4]].T
        edge, last = corners[:, 4] == 1, np.minimum(three, four)
        return np.where(edge, np.minimum(one, two) + last, one + np.minimum(two, last))

    def _patch_pairs(self) -> np.ndarray:
        """Returns the pairs of patches that could touch."""
        count = np.empty(self.patches.count, np.int64)
        group_bounds(self._patch_bounds, PATCHES_PER_GROUP, self._group_bounds)
        while True:
            room = self._room["patches"]
            out = np.empty((self.patches.count, room), np.int32)
            margin = self.thickest + SEARCH_MARGIN
            patch_pairs(
                self._patch_bounds, self._group_bounds, PATCHES_PER_GROUP, self.patches.joined, margin, room, count, out
            )
            if count.max() <= room:
                valid = np.arange(room) < count[:, None]
                return np.stack([np.nonzero(valid)[0].astype(np.int32), out[valid]], axis=1)
            self._room["patches"] = int(1.5 * count.max())

    def _collect(self, name: str, columns: int, pairs: int, search: Callable[..., None]) -> np.ndarray:
        """Runs a search chunk by chunk and joins its results; repeats it with more room if they do not fit."""
        count = np.empty((pairs + PATCH_PAIR_CHUNK - 1) // PATCH_PAIR_CHUNK, np.int64)
        while True:
            room = self._room[name]
            out = np.empty((len(count) * room, columns), np.uint32)
            search(count, out)
            if count.max(initial=0) <= room:
                return out.reshape(len(count), room, columns)[np.arange(room) < count[:, None]]
            self._room[name] = int(1.5 * count.max())

    def _without_crossings(self, crossed: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """Returns the pairs without those whose two elements both touch a crossing: their sides mean nothing."""
        flagged = np.zeros(self.sheet.vertex_count, bool)
        flagged[self._edges[crossed[:, 0]]] = True
        flagged[self.sheet.faces[crossed[:, 1]]] = True
        touched = flagged[corners[:, :4]]
        edge = corners[:, 4] == 1
        first = touched[:, 0] | (edge & touched[:, 1])
        second = touched[:, 2] | touched[:, 3] | (~edge & touched[:, 1])
        return corners[~(first & second)]

    def _untangling(self, start: np.ndarray, crossed: np.ndarray) -> PairRows:
        """Returns pairs that shorten the curves of crossings: each end of the edge against the triangle."""
        count = len(crossed)
        direction, position, inner = np.empty((count, 3)), np.empty(count), np.empty((count, 2))
        contour_directions(
            start, self._edges, self.sheet.faces, self.patches.opposite, crossed, direction, position, inner
        )
        ends, face = self._edges[crossed[:, 0]], self.sheet.faces[crossed[:, 1]]
        corners = np.concatenate([np.column_stack([ends[:, end], face]) for end in (0, 1)]).astype(np.uint32)
        weights = np.tile(np.column_stack([np.ones(count), inner.sum(axis=1) - 1, -inner]), (2, 1))
        normal = np.tile(direction, (2, 1))
        between = np.einsum("pc,pcx->px", weights, start[corners])
        reach = np.einsum("px,px->p", between, normal) + UNTANGLE_DISTANCE
        stiffness = self.stiffness[corners].mean(axis=1) * np.concatenate([1 - position, position])
        return PairRows(
            corners,
            weights,
            normal,
            reach,
            between,
            np.full(2 * count, UNTANGLE_DISTANCE),
            stiffness,
            np.zeros(2 * count),
        )

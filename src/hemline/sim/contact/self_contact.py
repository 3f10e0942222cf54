"""Contact of the cloth with itself during one step.

A pair of elements that come near is found at the step's start, and its side is where it is then. From Newton step to
Newton step its normal follows the elements, but the side stays. Cloth that crosses itself at the start has no side:
what is around such a place is pulled in the direction in which the curve of the crossing becomes shorter.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from hemline.sim.cloth.sheet import Sheet

from .contour_kernels import contour_directions
from .lane_kernels import LANES, ROWS, fill_lanes
from .pair_kernels import lay_pairs, near_rows
from .pair_search_kernels import near_pairs, piercing_edges
from .pairs import PairRows
from .patch_kernels import element_frames, group_bounds, patch_bounds, patch_pairs
from .patches import Blocks, make_patches

MARGIN = 0.001
"""Distance beyond thickness and motion up to which pairs are looked for [m]."""

PULL = 0.003
"""How far a crossing is pulled apart in a step, about [m]."""

GROUP = 8
"""Patches in a group: groups are compared first."""

CHUNK = 64
"""Patch pairs worked on at a time: fixed, so that the order of what is found does not depend on the threads."""


class SelfContact:
    """The pairs of a sheet, step by step.

    Args:
        sheet: The cloth.
        thickness: Distance that it keeps from itself [m].
        stiffness: Of contact, over area [N/m^3].
        friction: Coulomb's coefficient of cloth on cloth, a vertex.
    """

    def __init__(self, sheet: Sheet, *, thickness: float, stiffness: float, friction: Float[np.ndarray, " verts"]):
        self.sheet, self.patches = sheet, make_patches(sheet, thickness)
        self.push, self.friction = stiffness * sheet.vertex_area, friction
        rows = self.patches.faces, self.patches.edges, self.patches.vertices
        self._blocks = tuple(Blocks.of(each) for each in rows)
        self._lanes = tuple(np.empty((len(each.elements), ROWS, LANES), np.float32) for each in self._blocks)
        self.thickest = 2 * float(self.patches.radius.max())
        count = self.patches.count
        counts = len(sheet.faces), len(sheet.edges), sheet.vertex_count
        self._frames = tuple(np.empty((each, 11)) for each in counts)
        self._bounds = np.empty((count, 6)), np.empty((count, 4)), np.empty((count, 4))
        groups = (count + GROUP - 1) // GROUP
        self._groups = np.empty((groups, 6)), np.empty((groups, 4))
        self._edges = sheet.edges.astype(np.uint32)
        self._room: dict[str, int] = {"patches": 32, "near": 256, "piercing": 64}
        self._corners = np.empty((0, 5), np.uint32)
        self._normal = np.empty((0, 3))
        self._start = np.empty((0, 3))
        self._pulls: PairRows | None = None
        self.crossed = np.empty((0, 2), np.uint32)
        """Edges that went through a triangle at the start of the last step, as vertex pairs."""

    def begin(self, start: Float[np.ndarray, "verts 3"], guess: Float[np.ndarray, "verts 3"]) -> None:
        """Find what may meet on the way from the start to the guess, and what crosses at the start."""
        sheet, patches, (faces, edges, normal) = self.sheet, self.patches, self._frames
        moved = guess - start
        box, motion, cone = self._bounds
        element_frames(
            start, moved, sheet.faces, self._edges, sheet.corners.starts, sheet.corners.columns, *self._frames
        )
        rows = patches.edges.starts, patches.edges.columns, patches.faces.starts, patches.faces.columns
        patch_bounds(
            start,
            moved,
            sheet.faces,
            self._edges,
            faces,
            patches.vertices.starts,
            patches.vertices.columns,
            *rows,
            box,
            motion,
            cone,
        )
        for frames, blocks, lanes in zip(self._frames, self._blocks, self._lanes, strict=True):
            fill_lanes(frames, motion, start[0], blocks.starts, blocks.elements, lanes)
        by_face, by_edge, by_vertex = (
            (blocks.starts, blocks.elements, lanes) for blocks, lanes in zip(self._blocks, self._lanes, strict=True)
        )
        pairs = self._patch_pairs(box, motion, cone)
        met = np.empty(len(pairs), bool)
        corners = self._filled(
            "near",
            5,
            len(pairs),
            lambda room, count, out: near_pairs(
                start,
                moved,
                sheet.faces,
                self._edges,
                faces,
                edges,
                normal,
                patches.radius,
                box,
                motion,
                patches.joined,
                *by_vertex,
                *by_edge,
                *by_face,
                pairs,
                self.thickest,
                MARGIN,
                CHUNK,
                room,
                met,
                count,
                out,
            ),
        )
        pairs = pairs[met]
        crossed = self._filled(
            "piercing",
            2,
            len(pairs),
            lambda room, count, out: piercing_edges(
                start,
                sheet.faces,
                self._edges,
                faces,
                edges,
                box,
                motion,
                patches.joined,
                *by_edge,
                *by_face,
                pairs,
                CHUNK,
                room,
                count,
                out,
            ),
        )
        self.crossed = self._edges[crossed[:, 0]]
        if len(crossed):
            corners = self._apart(crossed, corners)
        self._corners, self._pulls = corners, self._pull(start, crossed) if len(crossed) else None
        self._start = start
        weights, self._normal, distance, carried = self._empty(len(corners))
        lay_pairs(start, start, corners, np.zeros((len(corners), 3)), weights, self._normal, distance, carried)
        self._thickness = self._thick(corners)
        self._stiffness = self.push[corners[:, :4]].mean(axis=1)
        pressed = np.maximum(self._thickness - distance, 0.0)
        self._limit = self.friction[corners[:, :4]].mean(axis=1) * self._stiffness * pressed**2 / self._thickness

    def lay(self, positions: Float[np.ndarray, "verts 3"]) -> list[PairRows]:
        """The pairs where the cloth is now, on the sides that they had at the start; and what pulls crossings apart."""
        weights, normal, distance, carried = self._empty(len(self._corners))
        lay_pairs(positions, self._start, self._corners, self._normal, weights, normal, distance, carried)
        self._normal = normal
        found = (weights, normal, carried, self._thickness, self._stiffness, self._limit)
        out = np.empty((len(distance), 4), np.uint32), *(np.empty_like(each) for each in found)
        count = near_rows(distance, MARGIN, self._corners, *found, *out)
        corners, weights, normal, carried, thickness, stiffness, limit = (each[:count] for each in out)
        rows = PairRows(corners, weights, normal, thickness, carried, thickness, stiffness, limit)
        return [rows] if self._pulls is None else [rows, self._pulls]

    def _thick(self, corners: np.ndarray) -> np.ndarray:
        """Distance that the elements of each pair keep."""
        one, two, three, four = self.patches.radius[corners[:, :4]].T
        edge, last = corners[:, 4] == 1, np.minimum(three, four)
        return np.where(edge, np.minimum(one, two) + last, one + np.minimum(two, last))

    @staticmethod
    def _empty(count: int) -> tuple[np.ndarray, ...]:
        return np.empty((count, 4)), np.empty((count, 3)), np.empty(count), np.empty((count, 3))

    def _patch_pairs(self, box: np.ndarray, motion: np.ndarray, cone: np.ndarray) -> np.ndarray:
        count = np.empty(self.patches.count, np.int64)
        group_bounds(box, motion, GROUP, *self._groups)
        while True:
            room = self._room["patches"]
            out = np.empty((self.patches.count, room), np.int32)
            patch_pairs(
                box, motion, cone, *self._groups, GROUP, self.patches.joined, self.thickest + MARGIN, room, count, out
            )
            if count.max() <= room:
                kept = np.arange(room) < count[:, None]
                return np.stack([np.nonzero(kept)[0].astype(np.int32), out[kept]], axis=1)
            self._room["patches"] = int(1.5 * count.max())

    def _filled(self, name: str, columns: int, pairs: int, search: Callable[..., None]) -> np.ndarray:
        """What a search finds, chunk after chunk; done again with more room where it does not fit."""
        count = np.empty((pairs + CHUNK - 1) // CHUNK, np.int64)
        while True:
            room = self._room[name]
            out = np.empty((len(count) * room, columns), np.uint32)
            search(room, count, out)
            if count.max(initial=0) <= room:
                return out.reshape(len(count), room, columns)[np.arange(room) < count[:, None]]
            self._room[name] = int(1.5 * count.max())

    def _apart(self, crossed: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """The pairs without those whose two elements both touch a crossing: their sides mean nothing."""
        flagged = np.zeros(self.sheet.vertex_count, bool)
        flagged[self._edges[crossed[:, 0]]] = True
        flagged[self.sheet.faces[crossed[:, 1]]] = True
        touched = flagged[corners[:, :4]]
        edge = corners[:, 4] == 1
        first = touched[:, 0] | (edge & touched[:, 1])
        second = touched[:, 2] | touched[:, 3] | (~edge & touched[:, 1])
        return corners[~(first & second)]

    def _pull(self, start: np.ndarray, crossed: np.ndarray) -> PairRows:
        """Pairs that shorten the curves of crossings: each end of the edge against the triangle."""
        count = len(crossed)
        direction, share, inner = np.empty((count, 3)), np.empty(count), np.empty((count, 2))
        contour_directions(
            start, self._edges, self.sheet.faces, self.patches.opposite, crossed, direction, share, inner
        )
        ends, face = self._edges[crossed[:, 0]], self.sheet.faces[crossed[:, 1]]
        corners = np.concatenate([np.column_stack([ends[:, end], face]) for end in (0, 1)]).astype(np.uint32)
        weights = np.tile(np.column_stack([np.ones(count), inner.sum(axis=1) - 1, -inner]), (2, 1))
        normal = np.tile(direction, (2, 1))
        between = np.einsum("pc,pcx->px", weights, start[corners])
        reach = np.einsum("px,px->p", between, normal) + PULL
        stiffness = self.push[corners].mean(axis=1) * np.concatenate([1 - share, share])
        return PairRows(
            corners, weights, normal, reach, between, np.full(2 * count, PULL), stiffness, np.zeros(2 * count)
        )

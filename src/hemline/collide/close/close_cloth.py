"""Keeps close-fitting cloth within its limits between the animator and the projection.

An animator that blends settled garments may tear the cloth where a pose or a body is far from those of its fit, and may
put it into the skin. Steps that cure one of these after the other undo each other. So one loop does: position-based
dynamics on two coarse levels and on all edges, with the skin as half-spaces.

Source of the method: Mueller et al., "Position Based Dynamics", 2007; coarse levels as in Mueller, "Hierarchical
Position Based Dynamics", 2008. Unlike there, edges are only kept from being too long: they may become shorter, as in
folds.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.collide.cover.cover import LENGTHS, Cover
from hemline.collide.cover.cover_kernels import CoveredSkin
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.collide.surface.nearest_skin import NearestSkin
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.collide.whole.models import CoarseModel, coarse_model, fine_model

from .close_kernels import CloseLimits, CloseModel, hold_close
from .skin_plane_kernels import SkinDistances, SkinPlanes

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments import Garment

STRETCH = 1.15
"""Longest length of an edge, over its length on the pattern, or in the garment at rest on the body if that is longer,
where the garment's own limit is not known. In the drapes of the shipped T-shirt 1.1 % of the edges are longer."""
REST_STRETCH = 1.3
"""Largest length of an edge at rest on the body that counts, over its length on the pattern: a body far from those of
the fit may tear the garment even at rest."""
CONTROLS = (120, 700)
"""Number of control vertices on the two coarse levels."""
FEWEST_VERTICES = 3
"""A level is left out if the garment has fewer vertices than this for each control vertex."""
GAP, NEAR, REACH = 0.0015, 0.01, 0.12
"""Least height over the skin, height up to which a vertex is kept from the skin, and radius of the search [m]."""
SINK = 0.006
"""Depth below its least height to which a vertex may sink while control vertices are moved [m]."""
FEWEST, MANY = 0.01, 0.03
"""Fraction of violated constraints after the first sweeps from which control vertices are moved, and moved in full."""
COARSE_SWEEPS, FINE_SWEEPS = 6, 6
"""Sweeps of each round."""
COVER_MARGIN = np.float32(0.005)
"""Skin farther behind the cloth than this at the start of a round is not looked at in the round [m]."""


@dataclass(frozen=True, eq=False)
class CloseCloth:
    """Holds the cloth of a garment close to a body within its limits; frozen. Make one with `CloseCloth.prepare`.

    A frame depends on the garment and the body of this frame alone, not on earlier frames.
    """

    on_body: GarmentOnBody
    model: CloseModel
    distances: SkinDistances
    limits: CloseLimits

    @classmethod
    def prepare(
        cls,
        shaped: "ShapedBody | None",
        garment: "Garment",
        on_body: GarmentOnBody,
        *,
        stretch: float = STRETCH,
    ) -> Self:
        """Finds edges, control vertices and covered skin of a garment; takes less than a second.

        Args:
            shaped: The body on which the garment was made; its vertices are the first ones of the body of `on_body`.
                The garment covers its skin. None if there is none: then skin may show through it.
            garment: The garment.
            on_body: Body and garment, cut into patches and blocks.
            stretch: Longest length of an edge over the longer of those on the pattern and at rest on the body.
        """
        order, patches = on_body.order, on_body.patches
        number = np.empty(len(order), np.int64)
        number[order] = np.arange(len(order))
        pinned = np.sort(number[garment.pins.vertices[np.isinf(garment.pins.stiffness)]])
        faces, vertices = number[garment.faces], garment.vertices[order]
        levels = [_level(vertices, faces, garment.rest_edges, pinned, controls) for controls in CONTROLS]
        covered = CoveredSkin(*(np.empty(shape, np.int32) for shape in (0, 0, (0, 3), (0, 3))))
        if shaped is not None:
            cover = Cover.prepare(shaped, garment.vertices, garment.faces)
            points, corners = patches.number[cover.points], number[cover.corners]
            covered = CoveredSkin(points.astype(np.int32), cover.over, corners.astype(np.int32), cover.beyond)
        return cls(
            on_body=on_body,
            model=CloseModel(on_body.nearest, fine_model(faces, garment.rest_edges, pinned), *levels, covered),
            distances=SkinDistances(*map(np.float32, (GAP, NEAR, REACH))),
            limits=CloseLimits(
                *map(np.float32, (stretch, REST_STRETCH, SINK)),
                cover=LENGTHS,
                cover_margin=COVER_MARGIN,
                coarse_sweeps=COARSE_SWEEPS,
                fine_sweeps=FINE_SWEEPS,
                fewest=np.float32(FEWEST),
                many=np.float32(MANY),
            ),
        )

    def step(
        self,
        posed: "PosedBody",
        vertices: Vertices,
        rest: Vertices,
        *,
        surface: PosedSurface | None = None,
    ) -> tuple[Vertices, NearestSkin]:
        """Brings the cloth of one frame within its limits.

        Args:
            posed: The body in this frame.
            vertices: The garment as the animator made it [m].
            rest: The garment at rest on the body that wears it (verts, 3) [m].
            surface: The body's surface in this frame (`on_body.surface(posed)`), if it was computed already.

        Returns:
            The vertices [m], and where the skin is.

        Raises:
            BadGarment: The number of vertices differs from the prepared garment's, or a position is not finite.
        """
        order, surface = self.on_body.order, surface or self.on_body.surface(posed)
        points = surface.into_bone_frame(self.on_body.check_vertices(vertices), order)
        count, moved = len(points), np.empty_like(points)
        found = SkinPlanes(
            np.zeros((count, 4), np.float32),
            np.empty(count, np.int64),
            np.zeros(count, np.float32),
            np.empty((count, 3), np.float32),
            np.empty(count, np.bool_),
            np.empty(count, np.int64),
        )
        at_rest = np.ascontiguousarray(rest[order], np.float32)
        hold_close(surface.skin, self.model, at_rest, points, self.distances, self.limits, found, moved)
        contact = NearestSkin.unknown(count)
        contact.faces[order], contact.heights[order] = found.faces, found.heights
        contact.pinched[order] = found.pinched
        return surface.out_of_bone_frame(moved, order), contact


def _level(
    vertices: Vertices,
    faces: Int[np.ndarray, "faces 3"],
    rest_edges: Float[np.ndarray, "faces 2 2"],
    pinned: Int[np.ndarray, " pins"],
    controls: int,
) -> CoarseModel:
    """Returns control vertices of which all vertices are samples; none if the garment has too few vertices."""
    count = len(vertices)
    if count < FEWEST_VERTICES * controls:
        none = np.empty(0, np.int32)
        empty = np.empty((0, 2), np.int32), np.empty(0, np.float32)
        near = np.zeros((count, 1), np.int32), np.zeros((count, 1), np.float32)
        return CoarseModel(none, *empty, np.empty(0, np.float32), *near, none, np.empty((0, 3), np.int32))
    model = coarse_model(vertices, faces, rest_edges, pinned, controls, 1)
    return model._replace(samples=np.arange(count, dtype=np.int32))

"""The final projection: no garment vertex inside the posed body, tested for every vertex in every frame.

After it, every garment vertex has winding number 0 with respect to the posed body mesh of this frame, except *pinched*
ones. The nearest place of a pinched vertex on its own limb, moved 2 mm outward, lies inside another part of the body,
which cuts through itself there. Pinched vertices are moved along with the cloth around them, and are reported.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Int, Vertices
from hemline.collide.surface.nearest_skin import NearestSkin
from hemline.collide.surface.posed_surface import PosedSurface

from .prepared import PreparedProjection, ProjectorState
from .project_frame import ProjectedFrame, ProjectionReport

if TYPE_CHECKING:
    from hemline.bodies import PosedBody


@dataclass(frozen=True)
class Projector(PreparedProjection):
    """Projects a garment out of a body, frame by frame; frozen. Make one with `Projector.prepare`."""

    def project(
        self,
        state: ProjectorState,
        posed: "PosedBody",
        vertices: Vertices,
        *,
        dt: float,
        places: Int[np.ndarray, " verts"] | None = None,
        surface: PosedSurface | None = None,
        contact: NearestSkin | None = None,
    ) -> tuple[ProjectorState, Vertices, ProjectionReport]:
        """Moves the vertices of one frame out of the posed body.

        Args:
            state: State from `start`, or from the frame before; it is not changed.
            posed: The body in this frame.
            vertices: The garment in this frame, any finite positions [m].
            dt: Time since the frame before [s].
            places: Face of the body that contact holds each vertex off from, -1 for none. Such a vertex is led out over
                that place or not at all: other skin may be nearer, but across flesh.
            surface: The body's surface in this frame (`on_body.surface(posed)`), if it was computed already.
            contact: Where the skin is, from a step before this one; it takes the place of what the state remembers.

        Returns:
            The next state, the vertices outside of the body [m], and a report.

        Raises:
            BadGarment: The number of vertices differs from the prepared garment's, or a position is not finite.
        """
        return ProjectedFrame(
            self, state, posed, self.on_body.check_vertices(vertices), places, surface, contact
        ).project(dt)

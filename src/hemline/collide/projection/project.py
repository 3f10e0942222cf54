"""The final projection: no garment vertex inside the posed body, tested for every vertex in every frame.

After it every garment vertex has winding number 0 with respect to this frame's posed body mesh, except *pinched* ones:
their nearest place on their own limb, moved 2 mm outward, lies inside another part of the body, which cuts through
itself there. Those go along with the cloth around them, and are reported.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Int, Vertices
from hemline.collide.surface.posed_surface import PosedSurface

from .prepared import PreparedProjection, ProjectorState
from .project_frame import ProjectedFrame, ProjectionReport

if TYPE_CHECKING:
    from hemline.bodies import PosedBody


@dataclass(frozen=True)
class Projector(PreparedProjection):
    """A garment and a body made ready, and what is done to each frame; frozen. Make it with `Projector.prepare`."""

    def project(
        self,
        state: ProjectorState,
        posed: "PosedBody",
        vertices: Vertices,
        *,
        dt: float,
        places: Int[np.ndarray, " verts"] | None = None,
        surface: PosedSurface | None = None,
    ) -> tuple[ProjectorState, Vertices, ProjectionReport]:
        """Move the vertices of one frame out of the posed body.

        Args:
            state: From `start`, or from the frame before.
            posed: The body in this frame.
            vertices: The garment in this frame, any finite positions [m].
            dt: Time since the frame before [s].
            places: The face of the body that each vertex was held off from, -1 for none. Such a vertex is led out over
                that place or not at all: however near other skin is, it may be across flesh.
            surface: The body's surface in this frame (`worn.surface(posed)`), where it is there already.

        Returns:
            The next state, the vertices outside of the body, and what was done.

        Raises:
            BadGarment: Another number of vertices than was prepared, or positions that are not finite.
        """
        return ProjectedFrame(self, state, posed, self.on_body.check_vertices(vertices), places, surface).project(dt)

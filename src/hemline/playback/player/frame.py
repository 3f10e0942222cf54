"""One frame of a garment on a body."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies.body import PosedBody
from hemline.collide import ProjectionReport


@dataclass(frozen=True)
class Frame:
    """One frame of a garment on a body, in the world.

    A body more than 64 m from the origin of the world is played near zero and then moved, where single precision rounds
    its vertices: to 8 mm at 100 km, to 6 cm at 1,000 km. `local` is not rounded: draw it as an object at `origin`.
    """

    vertices: Vertices
    """Garment vertices after the projection [m]."""
    animated: Vertices
    """Garment vertices from the animator [m]."""
    before_projection: Vertices
    """Garment vertices after the steps that keep cloth in one piece and over the skin, before the projection [m]; those
    of the animator where these steps are off."""
    body: PosedBody
    """The body of this frame."""
    report: ProjectionReport
    """Report of the projection."""
    milliseconds: Mapping[str, float]
    """Time of each stage [ms]: `body`, `animator`, `whole` (for garments that lie close the loop of `CloseCloth`),
    `cover`, `projection`; `layers` for several garments."""
    novelty: float | None = None
    """Distance of the pose from all poses of the fit, see `Bounded`; None where the animator does not know it."""
    terms: tuple[str, ...] = ()
    """Licence terms of model and garment, which exports carry on."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Origin of `local` in the world [m]: a multiple of 64 m along each axis, 0 near the origin of the world."""
    _local: "Frame | None" = None

    @property
    def local(self) -> "Frame":
        """This frame with all positions relative to `origin`, exact at any distance; near 0 the frame itself."""
        return self if self._local is None else self._local

    def in_world(self, body: PosedBody) -> Self:
        """Returns this frame, which is relative to the origin of its body, in the world.

        Args:
            body: The body in the world.
        """
        origin = self.body.origin
        vertices, animated, before_projection = (
            (each + np.array(origin)).astype(np.float32)
            for each in (self.vertices, self.animated, self.before_projection)
        )
        return replace(
            self,
            vertices=vertices,
            animated=animated,
            before_projection=before_projection,
            body=body,
            origin=origin,
            _local=self,
        )

"""One frame of a garment on a body, as it is shown."""

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

    A body that is more than 64 m from the world's origin is played near zero, and then moved. Far away single precision
    blurs what is moved: at 100 km its steps are 8 mm, at 1,000 km 6 cm. `local` is not blurred: draw that, as an object
    at `origin`.
    """

    vertices: Vertices
    """Garment vertices after the projection [m]."""
    animated: Vertices
    """What the animator made [m]."""
    held: Vertices
    """The same after whole-cloth step and cover, before the projection [m]; what the animator made without both."""
    body: PosedBody
    """The body of this frame."""
    report: ProjectionReport
    """What the projection did."""
    milliseconds: Mapping[str, float]
    """Time by stage [ms]: `body`, `animator`, `whole`, `cover`, `projection`; `layers` of several garments."""
    novelty: float | None = None
    """How far the pose is from all poses of the fit, see `Bounded`; None where the animator cannot tell."""
    terms: tuple[str, ...] = ()
    """Terms of the model and of its garment, which go along into whatever is exported."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Place in the world that `local` is counted from [m]: a whole number of 64 m along each axis, 0 near the world's
    own origin."""
    _local: "Frame | None" = None

    @property
    def local(self) -> "Frame":
        """This frame with all positions counted from `origin`: exact however far that is. Near 0 the frame itself."""
        return self if self._local is None else self._local

    def in_world(self, body: PosedBody) -> Self:
        """A frame that is counted from its body's origin, in the world.

        Args:
            body: Its body in the world.
        """
        origin = self.body.origin
        vertices, animated, held = (
            (each + np.array(origin)).astype(np.float32) for each in (self.vertices, self.animated, self.held)
        )
        return replace(self, vertices=vertices, animated=animated, held=held, body=body, origin=origin, _local=self)

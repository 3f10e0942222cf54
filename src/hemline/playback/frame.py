"""One frame of a garment on a body, as it is shown."""

from collections.abc import Mapping
from dataclasses import dataclass

from hemline.arrays import Vertices
from hemline.bodies.body import PosedBody
from hemline.collide import ProjectionReport


@dataclass(frozen=True)
class Frame:
    """One frame of a garment on a body."""

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

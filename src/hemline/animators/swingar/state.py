"""All that moves of a garment that nobody trained on."""

from dataclasses import dataclass

from hemline.animators.swingar.features.trail import Trail
from hemline.animators.swingar.graph.history import History
from hemline.motions.motion import Pose


@dataclass(frozen=True, eq=False)
class SwingarState:
    """At the end of a frame; never changed in place."""

    trail: Trail
    """How the proxy moved."""
    pose: Pose
    """The body's."""
    history: History | None
    """What the graph network remembers beside it; None for the lag network."""

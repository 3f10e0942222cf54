"""All that moves of a garment that nobody trained on."""

from dataclasses import dataclass

from hemline.animators.simulated_proxy import ProxyState
from hemline.animators.swingar.features.trail import Trail
from hemline.animators.swingar.graph.history import History
from hemline.motions.motion import Pose

from .displaced import Displaced


@dataclass(frozen=True, eq=False)
class SwingarState:
    """At the end of a frame; never changed in place."""

    trail: Trail
    """How the proxy moved."""
    pose: Pose
    """The body's."""
    history: History | None
    """What the graph network remembers beside it; None for the lag network."""
    opening: "Opening | None"
    """The proxy while it is simulated; None: the network moves it."""
    displaced: Displaced | None
    """Where the network has moved it; None: it has not yet."""


@dataclass(frozen=True, eq=False)
class Opening:
    """The simulation that comes before the network."""

    simulated: ProxyState
    seconds: float
    """How long it has lasted [s]."""

"""All that moves of a garment that nobody trained on."""

from dataclasses import dataclass
from typing import Any

from hemline.animators.coarse.features.trail import Trail
from hemline.animators.simulated_proxy import ProxyState
from hemline.motions.motion import Pose

from .displacement import Displacement


@dataclass(frozen=True, eq=False)
class CoarseState:
    """At the end of a frame; never changed in place."""

    trail: Trail
    """How the proxy moved."""
    pose: Pose
    """The body's."""
    history: Any
    """What the network remembers beside it, see `network.Network`."""
    opening: "Opening | None"
    """The proxy while it is simulated; None: the network moves it."""
    displacement: Displacement | None
    """Where the network has moved it; None: it has not yet."""


@dataclass(frozen=True, eq=False)
class Opening:
    """The simulation that comes before the network."""

    simulated: ProxyState
    seconds: float
    """How long it has lasted [s]."""

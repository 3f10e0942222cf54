"""The State of a garment whose proxy is moved by a network."""

from dataclasses import dataclass
from typing import Any

from hemline.animators.coarse.features.trail import Trail
from hemline.animators.simulated_proxy import ProxyState
from hemline.motions.motion import Pose

from .displacement import Displacement


@dataclass(frozen=True, eq=False)
class CoarseState:
    """The State at the end of a frame; never changed in place."""

    trail: Trail
    """Memory of how the proxy moved."""
    pose: Pose
    """Pose of the body."""
    history: Any
    """What the network remembers beside the trail, see `network.Network`."""
    opening: "Opening | None"
    """The simulation that comes before the network; None once the network moves the proxy."""
    displacement: Displacement | None
    """Displacements from skinning; None while the proxy is simulated, and before the first step."""


@dataclass(frozen=True, eq=False)
class Opening:
    """The simulation that comes before the network."""

    simulated: ProxyState
    """State of the simulation."""
    seconds: float
    """Time since its start [s]."""

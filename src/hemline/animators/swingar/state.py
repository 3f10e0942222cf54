"""All that moves of a garment that nobody trained on."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.simulated_proxy import ProxyState
from hemline.animators.swingar.features.trail import Trail
from hemline.animators.swingar.graph.history import History
from hemline.arrays import Float
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
    seconds: float
    """Since the start [s]."""
    simulated: ProxyState | None
    """The proxy, while it is simulated; None: the network moves it."""
    missed: Float[np.ndarray, "verts 3"] | None
    """Where the simulation had left each vertex, from where the network would have put it, in its turned frame [m];
    None: it was not simulated."""

"""All that moves of a garment that is simulated in real time."""

from dataclasses import dataclass

from hemline.animators.leaps import Rigid
from hemline.collide import ProjectorState
from hemline.motions.motion import Pose
from hemline.sim.step.state import ClothState


@dataclass(frozen=True, eq=False)
class LiveState:
    """At the end of a frame; never changed in place."""

    home: Rigid
    """From where the body stood and headed at the start, in which all else is seen, to the world."""
    cloth: ClothState
    """The coarse cloth."""
    projector: ProjectorState
    """What the projection of the coarse cloth remembers."""
    pose: Pose
    """The body's."""
    lost: int = 0
    """Frames up to this one in which no step could be taken, one after the other."""

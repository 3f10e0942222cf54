"""State of a player between frames, and how it follows a body that went far or was teleported."""

from dataclasses import dataclass, replace
from typing import Any

from hemline.animators.base import Animator, Movable
from hemline.bodies.body import ShapedBody
from hemline.collide import LayersState, ProjectorState, WholeState
from hemline.motions.motion import Pose

from .origin import WORLD_ORIGIN, Origin, carry_motion, is_movable, origin_for
from .time_step import LONGEST_STEP, SHORTEST_STEP


@dataclass(frozen=True)
class PlayerState:
    """Everything that changes from frame to frame: plain data, never changed in place. An old one is a rollback."""

    animator: Any
    """State of the animator."""
    whole: WholeState | None
    """State of the whole-cloth step; None where it is off."""
    projector: ProjectorState | LayersState
    """State of the projection."""
    origin: Origin = WORLD_ORIGIN
    """Origin of all positions in the world [m]."""
    pose: Pose | None = None
    """Pose of the body relative to the origin; None: unknown, so that the garment is not carried over a pause."""

    def relocate(self, animator: Animator, body: ShapedBody, pose: Pose, dt: float) -> "PlayerState":
        """Returns this state relative to the origin of the next frame, and carried over a pause.

        Args:
            animator: The animator of this state.
            body: The body that wears the garment.
            pose: Pose of the next frame, in the world.
            dt: Whole time since this state [s].

        Raises:
            BadInput: The pose is too far away to be played.
        """
        origin = origin_for(pose, self.origin)
        usual = origin == self.origin and SHORTEST_STEP <= dt <= LONGEST_STEP
        if usual or self.pose is None or not (is_movable(animator) and isinstance(animator, Movable)):
            return self
        motion = carry_motion(self.pose, pose, (self.origin, origin), dt)
        if motion is None:
            return self
        return replace(self, animator=animator.relocate(self.animator, body, motion), origin=origin)

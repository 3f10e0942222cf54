"""What moves from frame to frame of a player, and how it goes along with a body that went far or was put elsewhere."""

from dataclasses import dataclass, replace
from typing import Any

from hemline.animators.base import Animator, Movable
from hemline.bodies.body import ShapedBody
from hemline.collide import LayersState, ProjectorState, WholeState
from hemline.motions.motion import Pose

from .time_step import LONGEST_STEP, SHORTEST_STEP
from .origin import WORLD_ORIGIN, Origin, is_movable, origin_for, carry_motion


@dataclass(frozen=True)
class PlayerState:
    """All that moves from frame to frame: plain data, never changed in place. Keeping an old one is a rollback."""

    animator: Any
    """The animator's own State."""
    whole: WholeState | None
    """None where the step is off."""
    projector: ProjectorState | LayersState
    origin: Origin = WORLD_ORIGIN
    """Place in the world that all of it is counted from [m]."""
    pose: Pose | None = None
    """The body's, counted from there; None: nothing is known of it, so that the garment is not carried over a pause."""

    def relocate(self, animator: Animator, body: ShapedBody, pose: Pose, dt: float) -> "PlayerState":
        """The state before a frame, counted from the origin of that frame, and carried over a pause.

        Args:
            animator: The animator that it is a state of.
            body: The body that wears the garment.
            pose: The pose of the frame, in the world.
            dt: Time since the state, all of it [s].

        Raises:
            BadInput: The pose is too far away to be played.
        """
        origin = origin_for(pose, self.origin)
        usual = origin == self.origin and SHORTEST_STEP <= dt <= LONGEST_STEP
        if usual or self.pose is None or not (is_movable(animator) and isinstance(animator, Movable)):
            return self
        way = carry_motion(self.pose, pose, (self.origin, origin), dt)
        if way is None:
            return self
        return replace(self, animator=animator.relocate(self.animator, body, way), origin=origin)

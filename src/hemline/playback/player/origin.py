"""Where positions are counted from while a body is played: near it, so that far from the world's origin nothing blurs.

Single precision, in which skin and cloth are, has steps of a hundredth of a millimetre at 100 m and of six centimetres
at 1,000 km. So a body that has gone far is played as if it were near zero, and what a `Frame` says of the world is
that, moved.
"""

from dataclasses import replace

import numpy as np

from hemline.animators import Animator, AnimatorTogether
from hemline.animators.base import Level, Movable
from hemline.animators.teleport import TELEPORT_SPEED, RigidTransform
from hemline.animators.redressed import AnimatorRedressed
from hemline.bodies.body import PosedBody
from hemline.errors import BadInput
from hemline.motions.motion import Pose
from hemline.motions.quaternions import heading, inverse, multiply, slerp, to_matrix

from .time_step import LONGEST_STEP, SHORTEST_STEP

Origin = tuple[float, float, float]
"""A place in the world [m]."""

WORLD_ORIGIN: Origin = (0.0, 0.0, 0.0)
ORIGIN_SPACING = 64.0
"""A body that gets farther from the origin along an axis has a new one, a whole number of this length away [m]."""
TELEPORT_DISTANCE = 32.0
"""A body that needs a new origin and came farther than this in a frame was put there [m]."""
FARTHEST_BODY = 2.0**20
"""Bodies are played up to here [m]: places in single precision are an eighth of a metre apart there."""

NO_TURN = np.array([1.0, 0.0, 0.0, 0.0])


def origin_for(pose: Pose, before: Origin = WORLD_ORIGIN) -> Origin:
    """The origin from which a pose is played: the one before, as long as the body is near it.

    Args:
        pose: A pose in the world.
        before: That of the frame before.

    Raises:
        BadInput: The body is too far away to have a place.
    """
    pelvis = pose.translation.astype(np.float64)
    if not np.abs(pelvis).max() <= FARTHEST_BODY:
        place = " ".join(f"{each:.6g}" for each in pelvis)
        what = f"a body is played within {FARTHEST_BODY / 1000:.0f} km of the world's origin"
        raise BadInput(what, f"a pelvis at {place} m", "move the world's origin nearer to it")
    if np.abs(pelvis - before).max() <= ORIGIN_SPACING:
        return before
    if np.abs(pelvis).max() <= ORIGIN_SPACING:
        return WORLD_ORIGIN
    x, y, z = (ORIGIN_SPACING * np.round(pelvis / ORIGIN_SPACING)).tolist()
    return x, y, z


def relative_to(pose: Pose, origin: Origin) -> Pose:
    """A pose of the world counted from an origin, exactly: a whole number of steps of single precision is taken off."""
    if origin == WORLD_ORIGIN:
        return pose
    return pose.placed_at((pose.translation.astype(np.float64) - origin).astype(np.float32))


def in_world(posed: PosedBody, pose: Pose) -> PosedBody:
    """A body that is counted from its origin, in the world, as far as single precision goes.

    Args:
        posed: The body.
        pose: Its pose in the world.
    """
    if posed.origin == WORLD_ORIGIN:
        return posed
    transforms = posed.transforms.astype(np.float64)
    transforms[..., 3] += posed.origin
    joints = (posed.joints + np.array(posed.origin)).astype(np.float32)
    return replace(posed, pose=pose, transforms=transforms.astype(np.float32), joints=joints, origin=WORLD_ORIGIN)


def is_movable(animator: Animator) -> bool:
    """Whether an animator's States can be put elsewhere; of several, those of all."""
    if isinstance(animator, AnimatorTogether):
        return all(is_movable(part) for part in animator.parts)
    if isinstance(animator, AnimatorRedressed):
        return is_movable(animator.moving) and is_movable(animator.shapes)
    return is_movable(animator.full) if isinstance(animator, Level) else isinstance(animator, Movable)


def carry_motion(before: Pose, pose: Pose, origins: tuple[Origin, Origin], dt: float) -> RigidTransform | None:
    """How the garment goes along before a frame is played, from one origin to the next; None: it stays where it is.

    It goes along with a body that was put elsewhere, or came so quickly that no time was to be seen. Of the way in a
    pause it goes along on that part for which no time is played: what is played is as fast as the body went.

    Args:
        before: The pose of the frame before, seen from its origin.
        pose: The pose in the world.
        origins: That origin, and the one of this frame.
        dt: Time between them [s].
    """
    old, new = (np.array(each) for each in origins)
    pelvis, there = before.translation + old, pose.translation.astype(np.float64)
    far = float(np.linalg.norm(there - pelvis))
    put = dt < SHORTEST_STEP or (origins[0] != origins[1] and far > TELEPORT_DISTANCE) or (dt > LONGEST_STEP and far > TELEPORT_SPEED * dt)
    share = 1.0 if put else 1 - LONGEST_STEP / dt if dt > LONGEST_STEP else 0.0
    if share == 0:
        return None if origins[0] == origins[1] else RigidTransform.shifted(old - new)
    one, two = (heading(each.rotations[0].astype(np.float64)) for each in (before, pose))
    turn = to_matrix(slerp(NO_TURN, multiply(two, inverse(one)), share))
    about = RigidTransform(turn, pelvis - turn @ pelvis + share * (there - pelvis))
    return RigidTransform.shifted(-new).after(about).after(RigidTransform.shifted(old))

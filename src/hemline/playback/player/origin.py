"""A local origin near the body, so that positions are exact far from the origin of the world.

Skin and cloth are in single precision, which has steps of a hundredth of a millimetre at 100 m and of six centimetres
at 1,000 km. So a body far away is played as if it were near zero, and the frame is moved to its place in the world.
"""

from dataclasses import replace

import numpy as np

from hemline.animators import Animator, AnimatorTogether
from hemline.animators.base import Level, Movable
from hemline.animators.redressed import AnimatorRedressed
from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.teleport import TELEPORT_SPEED
from hemline.bodies.body import PosedBody
from hemline.errors import BadInput
from hemline.motions.motion import Pose
from hemline.motions.quaternions import heading, inverse, multiply, slerp, to_matrix

from .time_step import LONGEST_STEP, SHORTEST_STEP

Origin = tuple[float, float, float]
"""A place in the world [m]."""

WORLD_ORIGIN: Origin = (0.0, 0.0, 0.0)
ORIGIN_SPACING = 64.0
"""Distance from the origin, along an axis, beyond which a body gets a new one, at a multiple of this length [m]."""
TELEPORT_DISTANCE = 32.0
"""Distance in one frame beyond which a body that needs a new origin counts as teleported [m]."""
FARTHEST_BODY = 2.0**20
"""Largest coordinate of a body [m]; steps of single precision are an eighth of a metre there."""

NO_TURN = np.array([1.0, 0.0, 0.0, 0.0])


def origin_for(pose: Pose, before: Origin = WORLD_ORIGIN) -> Origin:
    """Returns the origin for a pose: the previous one as long as the body is near it.

    Args:
        pose: A pose in the world.
        before: Origin of the previous frame.

    Raises:
        BadInput: The body is too far away to be played.
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
    """Returns a pose of the world relative to an origin; the subtraction is exact in single precision."""
    if origin == WORLD_ORIGIN:
        return pose
    return pose.move_to((pose.translation.astype(np.float64) - origin).astype(np.float32))


def in_world(posed: PosedBody, pose: Pose) -> PosedBody:
    """Returns a body that is relative to its origin in the world, as exactly as single precision allows.

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
    """Whether the States of an animator, and of each of its parts, can be moved elsewhere."""
    if isinstance(animator, AnimatorTogether):
        return all(is_movable(part) for part in animator.parts)
    if isinstance(animator, AnimatorRedressed):
        return is_movable(animator.moving) and is_movable(animator.shapes)
    return is_movable(animator.full) if isinstance(animator, Level) else isinstance(animator, Movable)


def carry_motion(before: Pose, pose: Pose, origins: tuple[Origin, Origin], dt: float) -> RigidTransform | None:
    """Returns the rigid motion that carries the garment along before a frame is played; None: it stays.

    It follows a teleported body entirely. In a pause it follows the body for the time that is skipped, so that the rest
    is played at the speed of the body.

    Args:
        before: Previous pose, relative to its origin.
        pose: Present pose, in the world.
        origins: Previous and present origin.
        dt: Time between both [s].
    """
    old, new = (np.array(each) for each in origins)
    pelvis, there = before.translation + old, pose.translation.astype(np.float64)
    distance = float(np.linalg.norm(there - pelvis))
    teleported = (
        dt < SHORTEST_STEP
        or (origins[0] != origins[1] and distance > TELEPORT_DISTANCE)
        or (dt > LONGEST_STEP and distance > TELEPORT_SPEED * dt)
    )
    fraction = 1.0 if teleported else 1 - LONGEST_STEP / dt if dt > LONGEST_STEP else 0.0
    if fraction == 0:
        return None if origins[0] == origins[1] else RigidTransform.translation(old - new)
    one, two = (heading(each.rotations[0].astype(np.float64)) for each in (before, pose))
    turn = to_matrix(slerp(NO_TURN, multiply(two, inverse(one)), fraction))
    about = RigidTransform(turn, pelvis - turn @ pelvis + fraction * (there - pelvis))
    return RigidTransform.translation(-new).after(about).after(RigidTransform.translation(old))

"""Walks a garment into a pose: the body that wears it moves from the rest pose, in a fixed number of damped frames."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.bodies.lead_in import Stance, interpolate_poses
from hemline.errors import SimulationFailed
from hemline.sim.cloth.sheet import Positions
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd
from hemline.sim.step.state import ClothState

from .damped import free_crossings
from .ironing import iron
from .rest import Rest

if TYPE_CHECKING:
    from hemline.motions.motion import Pose

MAX_SPEED_MM_S = 20.0
"""Maximum mean speed at the end of a walk at which cloth counts as still [mm/s]."""

MAX_PINCHED_RATIO, MAX_CROSSING_PERCENT = 0.05, 3.0
"""Maximum fraction of pinched vertices, and maximum percentage of edges that cross the cloth, after a walk."""


@dataclass(frozen=True)
class Walk:
    """Protocol by which a body moves from its rest pose into another pose, so that garments can be compared.

    The place where a garment comes to rest depends on its path (friction, folds), by 5 to 10 mm on a T-shirt. Anchors
    and the poses that they are compared with must therefore be reached along the same path.

    Attributes:
        name: Name of this protocol, stored in every file with such a garment. Any change of the numbers needs a new
            name.
        moving_frames: Frames in which the body moves from the rest pose into the pose, slowly at both ends.
        still_frames: Frames in which it then stands still.
        substeps: Steps of the cloth in each frame.
        velocity_ratio: Fraction of the velocity that is kept from frame to frame.
        ironing_frames: Frames after which cloth that crosses itself is ironed flat.
    """

    name: str = "walk 2"
    moving_frames: int = 20
    still_frames: int = 30
    substeps: int = 2
    velocity_ratio: float = 0.9
    ironing_frames: tuple[int, ...] = (10, 20, 30)


WALK = Walk()
"""The protocol that anchors and test sets use."""


def walk_into_pose(
    dressed: DressedBody, end: FrameEnd, drape: Positions, goal: "Pose", walk: Walk = WALK
) -> ClothState:
    """Moves the body into a pose and lets it stand still there; returns the state of the cloth.

    The same pose, turned about the vertical and moved, leads to the same cloth, turned and moved.

    Args:
        dressed: The garment on its body.
        end: Pushes the cloth out of the body after each frame.
        drape: The cloth at rest, in the rest pose of the body [m].
        goal: The pose.
        walk: The protocol.

    Raises:
        SimulationFailed: A step failed at its shortest.
    """
    stance = Stance.of(dressed.shaped, goal, np.zeros(3))
    origin = stance.pose(dressed.shaped.rest_pose)
    state, pose, projector = dressed.stepper.start(stance.points(drape)), origin, end.start()
    for frame in range(1, walk.moving_frames + walk.still_frames + 1):
        fraction = min(frame / walk.moving_frames, 1.0)
        following = interpolate_poses(origin, goal, fraction * fraction * (3 - 2 * fraction))
        try:
            simulated = dressed.simulate_frame(state, pose, following, substeps=walk.substeps)
        except SimulationFailed as reason:
            raise SimulationFailed(f"walking '{dressed.garment.name}' into a pose: {reason}") from reason
        state, seconds = simulated.state, 1 / dressed.settings.fps
        cleaned = end.clean(simulated.posed, state.positions, seconds, state.contact_history, projector=projector)
        state, pose, projector = dressed.apply_projection(simulated, cleaned), following, cleaned.projector
        state = replace(
            state, velocities=walk.velocity_ratio * state.velocities, change=walk.velocity_ratio * state.change
        )
        if frame in walk.ironing_frames:
            state = _iron_crossings(dressed, state)
    return state


def _iron_crossings(dressed: DressedBody, state: ClothState) -> ClothState:
    crossed = free_crossings(dressed, state.positions, state.pinched, dressed.settings)
    if not len(crossed):
        return state
    free = ~state.pinched & ~dressed.pinned
    return replace(state, positions=iron(dressed.sheet, state.positions, crossed, free))


def accept(rest: Rest, state: ClothState, most_pinched: float = MAX_PINCHED_RATIO) -> Rest:
    """Checks a garment after a walk; returns it with the figure `speed_mm_s`.

    Args:
        rest: The garment.
        state: The state of the cloth.
        most_pinched: Maximum fraction of pinched vertices.

    Raises:
        SimulationFailed: It still moves, or too much of it is pinched or crosses itself.
    """
    speed = 1e3 * float(np.linalg.norm(state.velocities, axis=1).mean())
    pinched, crossing = float(rest.pinched.mean()), rest.figures["self_crossing_percent"]
    for what, value, limit in (
        ("mean speed [mm/s]", speed, MAX_SPEED_MM_S),
        ("pinched share", pinched, most_pinched),
        ("edges through the cloth [%]", crossing, MAX_CROSSING_PERCENT),
    ):
        if not value <= limit:
            raise SimulationFailed(
                f"'{rest.garment.name}' did not come to rest in this pose: {what} {value:.3g}, accepted up to "
                f"{limit:g}; choose another pose, or lift the limbs that press it together"
            )
    return replace(rest, figures=rest.figures | {"speed_mm_s": speed})

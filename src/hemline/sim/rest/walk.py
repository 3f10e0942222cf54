"""A garment brought into a pose by the body that wears it: from the rest drape, in a fixed number of damped frames."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.bodies.lead_in import Stance, between
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
"""Mean speed at the end up to which cloth counts as still [mm/s]."""

MOST_PINCHED, MOST_CROSSING_PERCENT = 0.03, 3.0
"""Share of pinched vertices, and of edges that go through the cloth, up to which a walked garment is accepted."""


@dataclass(frozen=True)
class Walk:
    """How a body goes from its rest pose into another one, so that two garments can be compared.

    Where a garment comes to lie depends on how it got there (friction, folds), by 5 to 10 mm on a T-shirt: anchors and
    the poses that they are judged on must be reached in the same way.

    Attributes:
        name: Of this protocol; every file that holds such a garment names it. Another number, another name.
        moving: Frames in which the body goes from the rest pose into the pose, beginning and ending slowly.
        held: Frames in which it then stands still.
        substeps: Steps of the cloth in each of them.
        kept: Share of the velocity that is kept from frame to frame.
        ironed: Frames after which cloth that goes through itself is ironed flat.
    """

    name: str = "walk 1"
    moving: int = 20
    held: int = 30
    substeps: int = 2
    kept: float = 0.9
    iron: tuple[int, ...] = (10, 20, 30)


WALK = Walk()
"""The protocol of anchors and test sets."""


def walk_into_pose(dressed: DressedBody, end: FrameEnd, drape: Positions, goal: "Pose", walk: Walk = WALK) -> ClothState:
    """The cloth after the body went into a pose and stood still there.

    Turned about the vertical and moved with it, the pose leads to the same cloth, turned and moved.

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
    state, pose = dressed.stepper.start(stance.points(drape)), origin
    for frame in range(1, walk.moving + walk.held + 1):
        share = min(frame / walk.moving, 1.0)
        following = between(origin, goal, share * share * (3 - 2 * share))
        try:
            state, _, posed = dressed.frame(state, pose, following, substeps=walk.substeps)
        except SimulationFailed as reason:
            raise SimulationFailed(f"walking '{dressed.garment.name}' into a pose: {reason}") from reason
        cleaned = end.clean(posed, state.positions, 1 / dressed.settings.fps, state.contact_history)
        state, pose = dressed.fed_back(state, cleaned.positions, cleaned.pinched), following
        state = replace(state, velocities=walk.kept * state.velocities, change=walk.kept * state.change)
        if frame in walk.ironed:
            state = _iron_crossings(dressed, state)
    return state


def _iron_crossings(dressed: DressedBody, state: ClothState) -> ClothState:
    crossed = free_crossings(dressed, state.positions, state.pinched, dressed.settings)
    if not len(crossed):
        return state
    free = ~state.pinched & ~dressed.pinned
    return replace(state, positions=iron(dressed.sheet, state.positions, crossed, free))


def accept(rest: Rest, state: ClothState) -> Rest:
    """A walked garment with its speed among the figures, `speed_mm_s`.

    Raises:
        SimulationFailed: It moves still, or too much of it is pinched or goes through itself.
    """
    speed = 1e3 * float(np.linalg.norm(state.velocities, axis=1).mean())
    pinched, crossing = float(rest.pinched.mean()), rest.figures["self_crossing_percent"]
    for what, found, most in (
        ("mean speed [mm/s]", speed, MAX_SPEED_MM_S),
        ("pinched share", pinched, MOST_PINCHED),
        ("edges through the cloth [%]", crossing, MOST_CROSSING_PERCENT),
    ):
        if not found <= most:
            raise SimulationFailed(
                f"'{rest.garment.name}' did not come to rest in this pose: {what} {found:.3g}, accepted up to "
                f"{most:g}; choose another pose, or lift the limbs that press it together"
            )
    return replace(rest, figures=rest.figures | {"speed_mm_s": speed})

"""Play a fitted garment on a body that moves: pose, animator, projection, frame."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

from hemline.animators.base import Animator, Driven
from hemline.arrays import FramesOfVertices, Vertices
from hemline.bodies.posed import PosedBody
from hemline.bodies.shaped import ShapedBody
from hemline.collide.projection.project import Guarantee, ProjectionReport, Projector
from hemline.errors import BadInput, BadModel
from hemline.motions.motion import Motion


@dataclass(frozen=True)
class Frame:
    """One frame of a garment on a body."""

    vertices: Vertices
    """Garment vertices after the projection [m]."""
    animated: Vertices
    """The same before the projection: what the animator made [m]."""
    body: PosedBody
    """The body of this frame."""
    report: ProjectionReport
    """What the projection did."""
    milliseconds: Mapping[str, float]
    """Time by stage [ms]: `body`, `animator`, `projection`."""


def play(
    animator: Animator,
    body: ShapedBody,
    motion: Motion,
    *,
    fps: float | None = 30.0,
    pre_roll: float = 1.0,
    guarantee: Guarantee = "exact",
    measure: bool = False,
    untangle: bool = False,
    placed: bool = False,
    truth: FramesOfVertices | None = None,
) -> Iterator[Frame]:
    """Play a motion, frame by frame.

    The first frame is settled: the animator runs for `pre_roll` seconds in the first pose before anything is shown.

    Args:
        animator: A fitted animator.
        body: A body of the kind that it was fitted on, of any shape.
        motion: The motion, of any frame rate and for any leg length.
        fps: Frames a second to play at; None: the motion's own.
        pre_roll: Time in the first pose before the first frame [s].
        guarantee: `exact`: no vertex inside the body, tested in every frame; `fast`: not tested.
        measure: Let reports say how many vertices were inside before, and how deep.
        untangle: Lift limbs out of each other first.
        placed: The motion is already scaled and grounded for this body.
        truth: Simulated vertices, one row a frame of the motion as it is played: the animator is driven by their
            bones instead of its own.

    Yields:
        One `Frame` a frame.

    Raises:
        BadModel: The animator was fitted on another kind of body.
        BadInput: A frame rate that is not positive, a truth of another length, or an animator that is not `Driven`.
    """
    if body.body.name != animator.body_name:
        raise BadModel(
            f"the model was fitted on body '{animator.body_name}'",
            f"body '{body.body.name}'",
            "load that body, or fit again",
        )
    if fps is not None and not 0 < fps <= 1000:
        raise BadInput("fps must lie between 0 and 1000", fps, "leave it out for 30")
    motion = motion if placed else body.placed(motion)
    motion = motion if fps is None or fps == motion.fps else motion.resampled(fps)
    motion = body.untangled_motion(motion) if untangle else motion
    if truth is not None and len(truth) != len(motion):
        raise BadInput(
            "the truth must have one row a frame", f"{len(truth)} for {len(motion)} frames", "use the take's motion"
        )
    driven = animator if isinstance(animator, Driven) else None
    if truth is not None and driven is None:
        raise BadInput(
            f"animator '{animator.name}' is not driven by ground truth", "simulated vertices", "leave them out"
        )
    dt = 1.0 / motion.fps
    projector = Projector.prepare(
        body, animator.garment.vertices, animator.garment.faces, guarantee=guarantee, measure=measure
    )
    first = body.posed(motion[0])
    state, projected = animator.start(first), projector.start()
    for _ in range(round(pre_roll / dt) if truth is None else 0):
        state, _ = animator.step(state, first, dt)
    for index in range(len(motion)):
        clock = [time.perf_counter()]
        posed = body.posed(motion[index])
        _ = posed.vertices
        clock.append(time.perf_counter())
        if truth is None or driven is None:
            state, animated = animator.step(state, posed, dt)
        else:
            state, animated = driven.follow(state, posed, dt, truth[index])
        clock.append(time.perf_counter())
        projected, vertices, report = projector.project(projected, posed, animated, dt=dt)
        clock.append(time.perf_counter())
        spans = [(after - before) * 1e3 for before, after in pairwise(clock)]
        yield Frame(
            vertices, animated, posed, report, dict(zip(("body", "animator", "projection"), spans, strict=True))
        )

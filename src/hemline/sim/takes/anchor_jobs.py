"""Jobs that settle one garment in one pose on one body, unless a dataset holds it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.bodies.lifted_arms import LIFT_DEG
from hemline.datasets import Dataset, Take
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion, Pose
from hemline.sim.rest.rest import Rest
from hemline.sim.rest.sensitivities import Sensitivities
from hemline.sim.rest.settle import settle
from hemline.sim.rest.walk import MAX_PINCHED_RATIO, WALK
from hemline.sim.settings import SIMULATOR, SimSettings

from .build_info import build_info
from .jobs import Call, Job, Progress
from .setup import Setup, drape, shaped_body

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


@dataclass(frozen=True)
class WalkRules:
    """What is allowed of a garment that is walked into a pose.

    Attributes:
        lift_deg: Angle by which hanging arms were lifted in the pose, see `lift_pose_arms` [deg].
        most_pinched: Maximum fraction of vertices without a free place. Arms that hang leave less room.
    """

    lift_deg: float = LIFT_DEG
    most_pinched: float = MAX_PINCHED_RATIO


LIFTED, HANGING = WalkRules(), WalkRules(lift_deg=0.0, most_pinched=0.25)
"""Rules of poses with arms lifted off the torso, and of poses as they are recorded, with pinched armpits."""


@dataclass(frozen=True)
class AnchorTask:
    """One anchor: pose, shape, derivatives, and the way there."""

    pose: Pose
    shape: tuple[float, ...]
    turns: tuple[int, ...] = ()
    betas: tuple[int, ...] = ()
    rules: WalkRules | None = None
    """How the garment is walked into the pose; None to search for the equilibrium."""


def shape_key(betas: Sequence[float]) -> tuple[float, ...]:
    """Returns betas as the floats that name a shape."""
    return tuple(float(beta) for beta in np.asarray(betas, np.float32))


def anchor_inputs(
    garment: Garment,
    shaped: "ShapedBody",
    pose: Pose,
    settings: SimSettings,
    turns: Sequence[int],
    betas: Sequence[int],
    rules: WalkRules | None = None,
) -> dict[str, Any]:
    """Returns the inputs of an anchor, whose hash is its name."""
    walked = {} if rules is None else {"protocol": WALK.name, "lift_deg": rules.lift_deg}
    if rules is not None and rules.most_pinched != MAX_PINCHED_RATIO:
        walked["most_pinched"] = rules.most_pinched
    return walked | {
        "kind": "anchor",
        "garment": garment.hash,
        "body": shaped.body.hash,
        "betas": [float(beta) for beta in shaped.betas],
        "pose": pose.hash,
        "settings": asdict(settings),
        "simulator": SIMULATOR,
        "derivatives": {"turns": [int(joint) for joint in turns], "betas": [int(index) for index in betas]},
    }


def anchor_job(dataset: Dataset, setup: Setup, task: AnchorTask) -> Job[Take]:
    """Makes the anchor of a pose on a shape, unless the dataset holds it."""
    body = setup.body.shaped(task.shape)
    inputs = anchor_inputs(setup.garment, body, task.pose, setup.settings, task.turns, task.betas, task.rules)
    take = dataset.find_by_inputs(inputs)
    if take is not None:
        return take
    take = yield Call(_anchor, setup, task)
    take = replace(take, inputs=inputs)
    dataset.add(take)
    return take


def _anchor(setup: Setup, task: AnchorTask, tell: Progress) -> Take:
    """Settles an anchor; returns it, or the reason of the failure, as a take."""
    garment, body = setup.garment, shaped_body(setup, task.shape)
    try:
        if task.rules is None:
            rest = settle(garment, body, task.pose, setup.settings)
        else:
            start = drape(setup, task.shape)
            body, pinched = start.shaped, task.rules.most_pinched
            rest = settle(garment, body, task.pose, setup.settings, start=start, method="walked", most_pinched=pinched)
        derivatives = compute_derivatives(rest, task.turns, task.betas)
        return replace(rest.take(), kind="anchor", derivatives=derivatives, made_with=build_info())
    except SimulationFailed as reason:
        return _make_failed_take(garment, body, task.pose, setup.settings, str(reason))


def compute_derivatives(rest: Rest, turns: Sequence[int], betas: Sequence[int]) -> dict[str, np.ndarray]:
    """Returns derivatives of a settled garment by the names that a take stores them under, float32 (verts, 3) each.

    Args:
        rest: The settled garment.
        turns: Joints, about three axes of their own frame each [m/rad].
        betas: Shape coefficients [m].

    Raises:
        BadInput: There is no such joint or coefficient.
        SimulationFailed: The equilibrium is not isolated.
    """
    if not (len(turns) or len(betas)):
        return {}
    sensitivities = Sensitivities(rest)
    axes = np.eye(3)
    derivatives = {
        f"turn.{joint}.{axis}": sensitivities.turn(joint, axes[axis]) for joint in turns for axis in range(3)
    }
    derivatives |= {f"beta.{index}": sensitivities.beta(index) for index in betas}
    return {name: value.astype(np.float32) for name, value in derivatives.items()}


def _make_failed_take(garment: Garment, shaped: "ShapedBody", pose: Pose, settings: SimSettings, reason: str) -> Take:
    """Makes the take of an anchor that could not be settled: the garment as it was made, with the reason."""
    motion = Motion(
        pose.rotations[None],
        pose.translation[None],
        fps=settings.fps,
        leg_length=shaped.leg_length,
        name="anchor",
    )
    return Take(
        kind="anchor",
        vertices=garment.vertices[None],
        motion=motion,
        betas=shaped.betas,
        lead_in=np.zeros(1, bool),
        pinched=np.zeros(1, np.int32),
        figures={},
        inputs={},
        failed=reason,
        made_with=build_info(),
    )

"""Anchors: one garment settled in given poses on given shapes, with its derivatives there, in a dataset.

What an animator of settled states learns from (AgentDress, Wu et al. 2021, sections 3.2 to 3.4). Each anchor is a job
of its own: its name is the hash of its inputs, so that a command that is run again makes only what is missing.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline import bodies
from hemline.datasets import Dataset, Row, Take, create, take_name
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion, Pose
from hemline.sim.rest.rest import Rest
from hemline.sim.rest.sensitivities import Sensitivities
from hemline.sim.rest.settle import settle
from hemline.sim.settings import SimSettings

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


@dataclass(frozen=True)
class Anchor:
    """Where a garment is to be settled."""

    pose: Pose
    betas: tuple[float, ...] = ()
    """Shape of the body; what is left out is 0."""


def produce_anchors(
    folder: str | Path,
    garment: Garment,
    anchors: Sequence[Anchor],
    *,
    turns: Sequence[int] = (),
    betas: Sequence[int] = (),
    settings: SimSettings | None = None,
    report: Callable[[int, int], None] | None = None,
) -> list[Row]:
    """Settle a garment in many poses and shapes into a dataset; what is there already is kept.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        anchors: Where to settle it.
        turns: Joints whose derivatives are stored, three axes each.
        betas: Shape coefficients whose derivatives are stored.
        settings: Settings of the simulator.
        report: Called with anchors done and anchors in all.

    Returns:
        The index row of each anchor; `failed` says why one could not be settled.

    Raises:
        BadBody: Betas that are too many or not finite.
        BadDataset: The folder holds another garment's takes.
        BadInput: No such joint, no such shape coefficient.
        BadOutput: It cannot be written.
    """
    body, settings = bodies.load(garment.body_name), settings or SimSettings()
    shaped = [body.shaped(np.asarray(anchor.betas, np.float32)) for anchor in anchors]
    dataset, names = create(folder, garment), []
    for number, (anchor, each) in enumerate(zip(anchors, shaped, strict=True)):
        inputs = anchor_inputs(garment, each, anchor.pose, settings, turns, betas)
        names.append(take_name(inputs))
        if not dataset.path(names[-1]).exists():
            dataset.add(_settled(dataset, each, anchor.pose, settings, turns, betas, inputs))
        if report:
            report(number + 1, len(anchors))
    rows = {row.name: row for row in dataset.rows()}
    return [rows[name] for name in names]


def anchor_inputs(
    garment: Garment,
    shaped: "ShapedBody",
    pose: Pose,
    settings: SimSettings,
    turns: Sequence[int],
    betas: Sequence[int],
) -> dict[str, Any]:
    """What an anchor depends on; the hash of it is its name."""
    return {
        "kind": "anchor",
        "garment": garment.hash,
        "body": shaped.body.hash,
        "betas": [float(beta) for beta in shaped.betas],
        "pose": pose.hash,
        "settings": asdict(settings),
        "derivatives": {"turns": [int(joint) for joint in turns], "betas": [int(index) for index in betas]},
    }


def _settled(
    dataset: Dataset,
    shaped: "ShapedBody",
    pose: Pose,
    settings: SimSettings,
    turns: Sequence[int],
    betas: Sequence[int],
    inputs: dict[str, Any],
) -> Take:
    try:
        rest = settle(dataset.garment, shaped, pose, settings)
        derivatives = derivatives_of(rest, turns, betas)
    except SimulationFailed as reason:
        return _failed(dataset.garment, shaped, pose, settings, inputs, str(reason))
    return replace(rest.take(), kind="anchor", inputs=inputs, derivatives=derivatives)


def derivatives_of(rest: Rest, turns: Sequence[int], betas: Sequence[int]) -> dict[str, np.ndarray]:
    """Derivatives of a settled garment by the name that a take keeps them under, float32 (verts, 3) each.

    Args:
        rest: The settled garment.
        turns: Joints, about three axes of their own frame each [m/rad].
        betas: Shape coefficients [m].

    Raises:
        BadInput: No such joint, no such coefficient.
        SimulationFailed: The equilibrium is not isolated.
    """
    if not (len(turns) or len(betas)):
        return {}
    made = Sensitivities(rest)
    found = {f"turn.{joint}.{axis}": made.turn(joint, np.eye(3)[axis]) for joint in turns for axis in range(3)}
    found |= {f"beta.{index}": made.beta(index) for index in betas}
    return {name: value.astype(np.float32) for name, value in found.items()}


def _failed(
    garment: Garment, shaped: "ShapedBody", pose: Pose, settings: SimSettings, inputs: dict[str, Any], reason: str
) -> Take:
    """An anchor that could not be settled: the garment as it was made, and why."""
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
        inputs=inputs,
        failed=reason,
    )

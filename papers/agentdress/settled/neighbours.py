"""Poses and shapes at a given distance from an anchor, and the garment settled there in two ways."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.arrays import Float, Vertices
from hemline.datasets import create, take_name
from hemline.errors import SimulationFailed
from hemline.motions.motion import JOINT_COUNT, Pose
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim import Rest, SimSettings, settle
from hemline.sim.takes.anchor_jobs import anchor_inputs
from papers.agentdress.settled.pairs import settle_in_poses

BETAS = 4
"""Number of shape parameters that change, the first ones."""

Neighbour = tuple[Pose, tuple[float, ...]]
"""A pose, and the betas of a body."""


def random_directions(count: int, seed: int) -> Float[np.ndarray, "neighbours numbers"]:
    """Draws random unit vectors with three numbers for each joint and one for each of four betas.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        appendix, section 2.
    """
    vectors = np.random.default_rng(seed).normal(size=(count, 3 * JOINT_COUNT + BETAS))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def step_from(anchor: Pose, step: Float[np.ndarray, " numbers"]) -> Neighbour:
    """Returns the pose and shape reached by a step from an anchor on the mean shape.

    Args:
        anchor: Pose of the anchor.
        step: Rotation vectors of the joints in their own frames [rad], followed by betas.
    """
    turns = step[: 3 * JOINT_COUNT].reshape(JOINT_COUNT, 3)
    rotations = multiply(anchor.rotations.astype(np.float64), from_axis_angle(turns))
    return Pose(rotations.astype(np.float32), anchor.translation), tuple(float(each) for each in step[-BETAS:])


class SettleFromRest:
    """Settles the garment in each neighbour from its rest drape on that body, as anchors are."""

    name = "walked from rest"

    def __init__(self, folder: Path, rest: Rest):
        self.folder, self.garment = folder, rest.garment

    def at(self, neighbour: Neighbour) -> Vertices | None:
        """Returns the garment [m]; None if it does not come to rest."""
        pose, betas = neighbour
        return settle_in_poses(self.folder, self.garment, [pose], betas, jobs=1)[0]


class SettleFromAnchor:
    """Keeps the settled garment of the anchor in balance while the body moves from there to each neighbour."""

    def __init__(self, folder: Path, rest: Rest, name: str = "followed from the anchor"):
        self.dataset, self.rest, self.name = create(folder, rest.garment), rest, name

    def at(self, neighbour: Neighbour) -> Vertices | None:
        """Returns the garment [m]; None if no balance is found."""
        garment, rest = self.rest.garment, self.rest
        pose, betas = neighbour
        shaped = bodies.load(garment.body_name).shaped(np.asarray(betas, np.float32))
        inputs = anchor_inputs(garment, shaped, pose, rest.settings, (), ()) | {"start": rest.pose.hash}
        name = take_name(inputs)
        if not self.dataset.path(name).exists():
            take = replace(rest.take(), kind="anchor", inputs=inputs)
            try:
                take = replace(settle(garment, shaped, pose, start=rest).take(), kind="anchor", inputs=inputs)
            except SimulationFailed as reason:
                take = replace(take, failed=str(reason))
            self.dataset.add(take)
        take = self.dataset.take(name)
        return None if take.failed else take.vertices[0]


def without_friction(rest: Rest) -> Rest | None:
    """Settles the garment of a Rest in the same pose and balances it without friction; None if that fails."""
    slippery = rest.garment.in_material(replace(rest.garment.material, name="without friction", friction=0.0))
    try:
        return balance(settle(slippery, rest.shaped, rest.pose, method="walked"))
    except SimulationFailed:
        return None


def balance(rest: Rest) -> Rest | None:
    """Brings a settled garment into exact balance; None if Newton's method alone finds none."""
    try:
        result = settle(rest.garment, rest.shaped, rest.pose, SimSettings(), start=rest)
    except SimulationFailed:
        return None
    return result if result.method == "newton" else None

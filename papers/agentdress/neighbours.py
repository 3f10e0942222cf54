"""Poses and shapes at a given distance from an anchor, and the garment settled there, from two starts."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.arrays import Float, Vertices
from hemline.datasets import create, take_name
from hemline.errors import SimulationFailed
from hemline.motions.motion import JOINT_COUNT, Pose
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim import Rest, SimSettings, produce_posed, settle
from hemline.sim.takes.anchors import anchor_inputs

BETAS = 4
"""Shape parameters that are moved, the first ones."""

Place = tuple[Pose, tuple[float, ...]]
"""A pose, and betas of a body."""


def directions(count: int, seed: int) -> Float[np.ndarray, "neighbours numbers"]:
    """Random unit vectors of three numbers for each joint and one for each of four betas.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        appendix, section 2.
    """
    drawn = np.random.default_rng(seed).normal(size=(count, 3 * JOINT_COUNT + BETAS))
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)


def moved(anchor: Pose, step: Float[np.ndarray, " numbers"]) -> Place:
    """The pose and shape that a step from an anchor on the mean shape leads to.

    Args:
        anchor: Its pose.
        step: Rotation vectors of the joints about their own axes [rad], then betas.
    """
    turns = step[: 3 * JOINT_COUNT].reshape(JOINT_COUNT, 3)
    rotations = multiply(anchor.rotations.astype(np.float64), from_axis_angle(turns))
    return Pose(rotations.astype(np.float32), anchor.translation), tuple(float(each) for each in step[-BETAS:])


class Walked:
    """The garment walked into each place from its rest drape on that body, as anchors are."""

    name = "walked from rest"

    def __init__(self, folder: Path, rest: Rest):
        self.folder, self.garment = folder, rest.garment

    def at(self, place: Place) -> Vertices | None:
        """The garment [m]; None where it does not come to rest."""
        (found,) = produce_posed(self.folder, self.garment, [[place[0]]], [place[1]])
        return None if found is None else create(self.folder, self.garment).take(found.names[0]).vertices[0]


class Followed:
    """The garment that lies settled at the anchor, kept in balance while the body goes from there to each place."""

    def __init__(self, folder: Path, rest: Rest, name: str = "followed from the anchor"):
        self.dataset, self.rest, self.name = create(folder, rest.garment), rest, name

    def at(self, place: Place) -> Vertices | None:
        """The garment [m]; None where no balance is found."""
        garment, rest = self.rest.garment, self.rest
        pose, betas = place
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
    """The garment of a Rest walked into the same place and balanced there without friction; None where it is not."""
    slippery = rest.garment.in_material(replace(rest.garment.material, name="without friction", friction=0.0))
    try:
        return balanced(settle(slippery, rest.shaped, rest.pose, method="walked"))
    except SimulationFailed:
        return None


def balanced(rest: Rest) -> Rest | None:
    """A walked garment brought into balance where it lies; None where it finds none by Newton's method alone."""
    try:
        found = settle(rest.garment, rest.shaped, rest.pose, SimSettings(), start=rest)
    except SimulationFailed:
        return None
    return found if found.method == "newton" else None

"""The settled drapes of one garment on bodies of many shapes, in a dataset: what a model of shape learns from."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline import bodies
from hemline.datasets import Dataset, Take, create
from hemline.errors import BadDataset, SimulationFailed
from hemline.garments.garment import Garment
from hemline.sim.rest.settle import rest_drape
from hemline.sim.settings import SimSettings

if TYPE_CHECKING:
    from hemline.bodies import Body, ShapedBody

SPREAD = (-2.0, -1.0, 1.0, 2.0)
"""Values that one beta takes while the others are 0 (AgentDress, Wu et al. 2021, section 3.2)."""


def spread_shapes(count: int) -> list[tuple[float, ...]]:
    """The betas of a plain body, then those where one of the first `count` betas is -2, -1, 1 or 2.

    With 4, the seventeen shapes of AgentDress (Wu et al. 2021, section 3.2).
    """
    single = [(*[0.0] * index, value) for index in range(count) for value in SPREAD]
    return [(), *single]


def random_shapes(body: "Body", count: int, seed: int) -> list[tuple[float, ...]]:
    """Betas of so many random bodies, of one standard deviation."""
    betas = np.random.default_rng(seed).normal(size=(count, len(body.shapedirs)))
    return [tuple(float(beta) for beta in row) for row in betas]


def rest_of(dataset: Dataset, shaped: "ShapedBody", settings: SimSettings) -> Take:
    """The settled drape on a body, made and kept where the dataset has none.

    Raises:
        SimulationFailed: It could not be settled.
    """
    try:
        return dataset.rest(shaped.betas)
    except BadDataset:
        inputs = {
            "garment": dataset.garment.hash,
            "body": shaped.body.hash,
            "betas": [float(b) for b in shaped.betas],
            "settings": asdict(settings),
            "clip": "",
            "part": 0,
        }
        take = replace(rest_drape(dataset.garment, shaped, settings), inputs=inputs)
        dataset.add(take)
        return take


def produce_rests(
    folder: str | Path,
    garment: Garment,
    shapes: Sequence[Sequence[float]],
    *,
    settings: SimSettings | None = None,
    report: Callable[[int, int], None] | None = None,
) -> list[Take | str]:
    """Settle a garment on bodies of many shapes into a dataset; what is there already is kept.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        shapes: Betas of each body; what is left out is 0.
        settings: Settings of the simulator.
        report: Called with shapes done and shapes in all.

    Returns:
        For each shape its take of kind `rest`, or why there is none.

    Raises:
        BadBody: Betas that are too many or not finite.
        BadDataset: The folder holds another garment's takes.
        BadOutput: It cannot be written.
    """
    body = bodies.load(garment.body_name)
    shaped = [body.shaped(np.asarray(betas, np.float32)) for betas in shapes]
    dataset, found = create(folder, garment), []
    for number, each in enumerate(shaped):
        try:
            found.append(rest_of(dataset, each, settings or SimSettings()))
        except SimulationFailed as reason:
            found.append(str(reason))
        if report:
            report(number + 1, len(shaped))
    return found

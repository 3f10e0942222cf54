"""Settled drapes of one garment on bodies of many shapes, in a dataset; models of shape are fitted to them."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.datasets import Dataset, Take
from hemline.errors import SimulationFailed
from hemline.garments.garment import Garment
from hemline.sim.rest.settle import rest_drape
from hemline.sim.settings import SIMULATOR, SimSettings

from .build_info import build_info
from .jobs import Call, Job, Progress, run_jobs
from .setup import Setup, shaped_body
from .start_dataset import start_dataset
from .workers import workers

if TYPE_CHECKING:
    from hemline.bodies import Body

AXIS_BETAS = (-2.0, -1.0, 1.0, 2.0)
"""Values that one beta takes while the others are 0 (AgentDress, Wu et al. 2021, section 3.2)."""


def axis_shapes(count: int) -> list[tuple[float, ...]]:
    """Returns the betas of the mean body, then those where one of the first `count` betas is -2, -1, 1 or 2.

    With 4, these are the seventeen shapes of AgentDress (Wu et al. 2021, section 3.2).
    """
    single = [(*[0.0] * index, value) for index in range(count) for value in AXIS_BETAS]
    return [(), *single]


def random_shapes(body: "Body", count: int, seed: int) -> list[tuple[float, ...]]:
    """Returns betas of random bodies, of one standard deviation."""
    betas = np.random.default_rng(seed).normal(size=(count, len(body.shapedirs)))
    return [tuple(float(beta) for beta in row) for row in betas]


def rest_job(dataset: Dataset, setup: Setup, betas: tuple[float, ...]) -> Job[Take]:
    """Makes and stores the settled drape on a body, unless the dataset holds it.

    Raises:
        BadDataset: An existing drape cannot be read.
        SimulationFailed: The garment could not be settled.
    """
    body = setup.body.shaped(betas)
    for row in dataset.rest_rows(body.betas):
        if row.simulator == SIMULATOR and (take := dataset.find(row.name)) is not None:
            return take
    inputs = {
        "garment": setup.garment.hash,
        "body": setup.body.hash,
        "betas": [float(b) for b in body.betas],
        "settings": asdict(setup.settings),
        "simulator": SIMULATOR,
        "clip": "",
        "part": 0,
    }
    take = yield Call(_settle_rest, setup, betas)
    take = replace(take, inputs=inputs)
    dataset.add(take)
    return take


def _settle_rest(setup: Setup, betas: tuple[float, ...], tell: Progress) -> Take:
    """Settles the garment in the rest pose of a shape."""
    return replace(rest_drape(setup.garment, shaped_body(setup, betas), setup.settings), made_with=build_info())


def produce_rests(
    folder: str | Path,
    garment: Garment,
    shapes: Sequence[Sequence[float]],
    *,
    settings: SimSettings | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    report: Callable[[int, int], None] | None = None,
) -> list[Take | str]:
    """Settles a garment on bodies of many shapes into a dataset; existing drapes are kept.

    Args:
        folder: The dataset; created if missing.
        garment: The garment, made on the body of `garment.body_name`.
        shapes: Betas of each body; missing ones are 0.
        settings: Settings of the simulator.
        jobs: Number of processes. The results do not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with the shapes done and the total number of shapes.

    Returns:
        For each shape its take of kind `rest`, or the reason why there is none.

    Raises:
        BadBody: There are too many betas, or one is not finite.
        BadDataset: The folder holds another garment's takes.
        BadOutput: The folder cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot make the calls; finished takes are kept.
    """
    setup, done = Setup.of(garment, settings), 0
    all_betas = [tuple(float(beta) for beta in np.asarray(betas, np.float32)) for betas in shapes]
    for betas in all_betas:
        setup.body.shaped(betas)

    def rest(dataset: Dataset, betas: tuple[float, ...]) -> Job[Take | str]:
        nonlocal done
        try:
            result: Take | str = yield from rest_job(dataset, setup, betas)
        except SimulationFailed as reason:
            result = str(reason)
        done += 1
        if report:
            report(done, len(all_betas))
        return result

    with workers(jobs, scheduler) as makers:
        dataset = start_dataset(folder, garment)
        return run_jobs((rest(dataset, betas) for betas in all_betas), makers)

"""The settled drapes of one garment on bodies of many shapes, in a dataset: what a model of shape learns from."""

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

from .start_dataset import start_dataset
from .jobs import Call, Job, Progress, run_jobs
from .build_info import build_info
from .setup import Setup, shaped
from .workers import workers

if TYPE_CHECKING:
    from hemline.bodies import Body

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


def rest_job(dataset: Dataset, setup: Setup, betas: tuple[float, ...]) -> Job[Take]:
    """The settled drape on a body, made and kept where the dataset has none.

    Raises:
        BadDataset: There is one that cannot be read.
        SimulationFailed: It could not be settled.
    """
    body = setup.body.shaped(betas)
    for row in dataset.rest_rows(body.betas):
        if row.simulator == SIMULATOR and (found := dataset.sound(row.name)) is not None:
            return found
    inputs = {
        "garment": setup.garment.hash,
        "body": setup.body.hash,
        "betas": [float(b) for b in body.betas],
        "settings": asdict(setup.settings),
        "simulator": SIMULATOR,
        "clip": "",
        "part": 0,
    }
    take = yield Call(_settled, setup, betas)
    take = replace(take, inputs=inputs)
    dataset.add(take)
    return take


def _settled(setup: Setup, betas: tuple[float, ...], tell: Progress) -> Take:
    return replace(rest_drape(setup.garment, shaped(setup, betas), setup.settings), made_with=build_info())


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
    """Settle a garment on bodies of many shapes into a dataset; what is there already is kept.

    Args:
        folder: The dataset; made when missing.
        garment: The garment, made on the body of `garment.body_name`.
        shapes: Betas of each body; what is left out is 0.
        settings: Settings of the simulator.
        jobs: Processes. What is made does not depend on it.
        scheduler: Address of a dask scheduler whose workers settle instead; see `workers`.
        report: Called with shapes done and shapes in all.

    Returns:
        For each shape its take of kind `rest`, or why there is none.

    Raises:
        BadBody: Betas that are too many or not finite.
        BadDataset: The folder holds another garment's takes.
        BadOutput: It cannot be written.
        BadCluster: No scheduler answers, it went away, or its workers cannot do it; what is done is kept.
    """
    setup, done = Setup.of(garment, settings), 0
    asked = [tuple(float(beta) for beta in np.asarray(betas, np.float32)) for betas in shapes]
    for betas in asked:
        setup.body.shaped(betas)

    def rest(dataset: Dataset, betas: tuple[float, ...]) -> Job[Take | str]:
        nonlocal done
        try:
            found: Take | str = yield from rest_job(dataset, setup, betas)
        except SimulationFailed as reason:
            found = str(reason)
        done += 1
        if report:
            report(done, len(asked))
        return found

    with workers(jobs, scheduler) as those:
        dataset = start_dataset(folder, garment)
        return run_jobs((rest(dataset, betas) for betas in asked), those)

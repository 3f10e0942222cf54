"""Warnings about takes of several simulators, which are not the same ground truth."""

import warnings
from collections import Counter
from collections.abc import Iterable, Sequence

from hemline.errors import HemlineWarning

from .dataset import Dataset
from .row import Row


def count_by_simulator(rows: Iterable[Row]) -> str:
    """Counts the takes of each simulator, such as `12 of number 0, 3 of number 1`."""
    counts = Counter(row.simulator for row in rows)
    return ", ".join(f"{count} of number {number}" for number, count in sorted(counts.items()))


def warn_of_others(dataset: Dataset, rows: Sequence[Row], simulator: int) -> None:
    """Warns if a dataset to which takes are added has takes of other simulators.

    Args:
        dataset: The dataset.
        rows: Rows of the dataset.
        simulator: Number of the simulator that adds takes.
    """
    others = [row for row in rows if row.simulator != simulator]
    if not others:
        return
    what = f"{dataset.folder} has takes of other simulators than this one, number {simulator}"
    cure = "they are kept and what is asked for is made anew beside them, so that a fit mixes both; name a new folder"
    warnings.warn(
        HemlineWarning(what, count_by_simulator(others), f"{cure} for takes of one simulator alone"), stacklevel=1
    )


def warn_of_several(datasets: Sequence[Dataset]) -> None:
    """Warns if the takes of some datasets were made by more than one version of the simulator.

    Args:
        datasets: Datasets to fit to, or to measure against.
    """
    rows = [row for each in datasets for row in each.rows() if row.failed is None]
    if len({row.simulator for row in rows}) < 2:
        return
    folders = ", ".join(str(each.folder) for each in datasets)
    cure = "what is learned or measured mixes them; simulate all clips into new folders for one simulator alone"
    warnings.warn(
        HemlineWarning(f"takes of several simulators in {folders}", count_by_simulator(rows), cure), stacklevel=1
    )


def newest(rows: Sequence[Row], what: str) -> list[Row]:
    """Returns the rows of the newest simulator, with a warning if others are excluded.

    Args:
        rows: Rows of consecutive takes.
        what: Name of what was simulated, for the warning.
    """
    number = max((row.simulator for row in rows), default=0)
    counts = [row for row in rows if row.simulator == number]
    if len(counts) < len(rows):
        cure = f"those of number {number} are measured against, and no others"
        warnings.warn(
            HemlineWarning(f"takes of several simulators of {what}", count_by_simulator(rows), cure), stacklevel=1
        )
    return counts

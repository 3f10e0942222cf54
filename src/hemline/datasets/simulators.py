"""Which simulators made the takes of a dataset: takes of several are not the same ground truth."""

import warnings
from collections import Counter
from collections.abc import Iterable, Sequence

from hemline.errors import HemlineWarning

from .dataset import Dataset
from .row import Row


def counted(rows: Iterable[Row]) -> str:
    """How many takes each simulator made, as `12 of number 0, 3 of number 1`."""
    found = Counter(row.simulator for row in rows)
    return ", ".join(f"{count} of number {number}" for number, count in sorted(found.items()))


def warn_of_others(dataset: Dataset, rows: Sequence[Row], simulator: int) -> None:
    """Warn where a dataset that is added to has takes of other simulators than the one that adds.

    Args:
        dataset: The dataset.
        rows: Its rows.
        simulator: The number of the simulator that adds.
    """
    others = [row for row in rows if row.simulator != simulator]
    if not others:
        return
    what = f"{dataset.folder} has takes of other simulators than this one, number {simulator}"
    cure = "they are kept and what is asked for is made anew beside them, so that a fit mixes both; name a new folder"
    warnings.warn(HemlineWarning(what, counted(others), f"{cure} for takes of one simulator alone"), stacklevel=1)


def warn_of_several(datasets: Sequence[Dataset]) -> None:
    """Warn where the takes of some datasets together were made by more than one simulator.

    Args:
        datasets: What is fitted to, or measured against.
    """
    rows = [row for each in datasets for row in each.rows() if row.failed is None]
    if len({row.simulator for row in rows}) < 2:
        return
    folders = ", ".join(str(each.folder) for each in datasets)
    cure = "what is learned or measured mixes them; simulate all clips into new folders for one simulator alone"
    warnings.warn(HemlineWarning(f"takes of several simulators in {folders}", counted(rows), cure), stacklevel=1)


def newest(rows: Sequence[Row], what: str) -> list[Row]:
    """The rows of the newest simulator among some; a warning where there are others, which are left out.

    Args:
        rows: Rows of takes that follow each other.
        what: What they are takes of, for the warning.
    """
    number = max((row.simulator for row in rows), default=0)
    found = [row for row in rows if row.simulator == number]
    if len(found) < len(rows):
        cure = f"those of number {number} are measured against, and no others"
        warnings.warn(HemlineWarning(f"takes of several simulators of {what}", counted(rows), cure), stacklevel=1)
    return found

"""What every figure gives: a picture, what the paper says of it, what was measured here."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure


@dataclass(frozen=True)
class Drawn:
    """One figure, redrawn."""

    number: str
    """Of the paper's figure."""
    title: str
    paper: str
    """What the paper says of it."""
    measured: str
    """What came out here, numbers and all."""
    holds: str
    """Whether the statement holds here."""
    picture: str
    """Name of the PNG in the folder of the page."""


def axes(rows: int, columns: int, *, width: float = 3.2, height: float = 2.6, **options):
    """A sheet of plots: the sheet, and its axes (rows, columns)."""
    sheet = Figure(figsize=(width * columns, height * rows), layout="constrained")
    return sheet, np.array(sheet.subplots(rows, columns, squeeze=False, **options))


def keep(sheet: Figure, folder: Path, name: str) -> str:
    """Write a sheet of plots; returns its name."""
    folder.mkdir(parents=True, exist_ok=True)
    sheet.savefig(folder / name, dpi=110)
    return name

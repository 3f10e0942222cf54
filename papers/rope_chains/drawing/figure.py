"""Common parts of the figures: picture, statement of the paper, measurement here."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure


@dataclass(frozen=True)
class FigureEntry:
    """A redrawn figure of the paper."""

    number: str
    """Number of the paper's figure."""
    title: str
    paper: str
    """Statement of the paper about it."""
    measured: str
    """Measurement here, with numbers."""
    holds: str
    """Whether the statement holds here."""
    picture: str
    """Name of the PNG in the folder of the page."""


def axes(rows: int, columns: int, *, width: float = 3.2, height: float = 2.6, **options):
    """Returns a sheet of plots and its axes (rows, columns)."""
    sheet = Figure(figsize=(width * columns, height * rows), layout="constrained")
    return sheet, np.array(sheet.subplots(rows, columns, squeeze=False, **options))


def save_sheet(sheet: Figure, folder: Path, name: str) -> str:
    """Writes a sheet of plots and returns its name."""
    folder.mkdir(parents=True, exist_ok=True)
    sheet.savefig(folder / name, dpi=110)
    return name

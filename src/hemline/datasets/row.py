"""What the index of a dataset knows of each take, and how it is read back from `manifest.json`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .take_checks import is_number

MANIFEST_VERSION = 1
LARGEST_MANIFEST = 10**9
"""An index of more bytes is made anew; a million takes need less."""


@dataclass(frozen=True)
class Row:
    """What the index knows of a take."""

    name: str
    """Hash of the inputs; the file is `takes/<name>.safetensors`."""
    kind: str
    """`clip`, `rest` or `anchor`."""
    clip: str
    """Name of the clip; empty for a rest state."""
    subject: str
    """Who was captured: splits keep a subject together."""
    part: int
    """Clips longer than ten seconds are cut into parts; this counts them from 0."""
    frames: int
    """Frames, lead-in included."""
    clip_frames: int
    """Frames after the lead-in."""
    betas: tuple[float, ...]
    failed: str | None
    figures: dict[str, float]
    sha256: str
    """Checksum of the file."""
    bytes: int
    stamp: int
    """The file's time of change [ns]; a different one makes the row stale."""
    simulator: int = 0
    """Number of the simulator that made it; 0: from before takes said it."""


def manifest_rows(file: Path) -> list[Row]:
    """The rows of an index; none where it is missing, stale or damaged, since the takes describe themselves."""
    try:
        if not file.is_file() or file.stat().st_size > LARGEST_MANIFEST:
            return []
        content = json.loads(file.read_text())
        if content["version"] != MANIFEST_VERSION:
            return []
        return [_row(row) for row in content["takes"]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return []


def _row(values: dict[str, Any]) -> Row:
    """A row, if its values are those of one; a `ValueError` or `TypeError` if not."""
    values = {**values, "betas": tuple(values["betas"])}
    row = Row(**values)
    texts = all(isinstance(value, str) for value in (row.name, row.kind, row.clip, row.subject, row.sha256))
    counts = (row.part, row.frames, row.clip_frames, row.bytes, row.stamp, row.simulator)
    numbers = (*row.betas, *row.figures.values())
    if not (texts and all(type(count) is int for count in counts) and all(is_number(value) for value in numbers)):
        raise ValueError("no row of an index")
    if not (row.failed is None or isinstance(row.failed, str)):
        raise ValueError("no row of an index")
    return row

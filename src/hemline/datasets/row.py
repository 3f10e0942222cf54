"""Rows of the index of a dataset, and reading them from `manifest.json`."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .take_checks import is_number
from .take_faults import TakeFaults

MANIFEST_VERSION = 3
LARGEST_MANIFEST = 10**9
"""Size above which an index is rebuilt; a million takes need less [bytes]."""


@dataclass(frozen=True)
class Row:
    """Entry of the index, with the facts about a take."""

    name: str
    """Name of the take, a hash of its inputs; the file is `takes/<name>.safetensors`."""
    kind: str
    """`clip`, `rest` or `anchor`."""
    clip: str
    """Name of the clip; empty for a rest state."""
    subject: str
    """Person who was captured; splits keep a subject on one side."""
    part: int
    """Number of the part, from 0: clips longer than ten seconds are cut into parts."""
    frames: int
    """Number of frames, lead-in included."""
    clip_frames: int
    """Number of frames after the lead-in."""
    betas: tuple[float, ...]
    failed: str | None
    figures: dict[str, float]
    sha256: str
    """Checksum of the file."""
    bytes: int
    stamp: int
    """Time of the last change of the file [ns]; a different one makes the row stale."""
    simulator: int = 0
    """Number of the simulator that made the take; 0 for older takes that do not tell."""
    limbs_through: dict[str, float] = field(default_factory=dict)
    """Frames in which a limb is through the cloth, by name of the limb [percent]; for clips and anchors alone."""
    edge_ratio: float = 1.0
    """Length of the longest edge over its length at rest; for clips and anchors alone."""

    @property
    def faults(self) -> TakeFaults:
        """Faults because of which a take is no ground truth."""
        return TakeFaults(self.limbs_through, self.edge_ratio)


def manifest_rows(file: Path) -> list[Row]:
    """Returns the rows of an index; none if it is missing, stale or damaged, since the takes describe themselves."""
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
    """Makes a row of values; raises a `ValueError` or `TypeError` if they are not those of a row."""
    values = {**values, "betas": tuple(values["betas"])}
    row = Row(**values)
    texts = all(isinstance(value, str) for value in (row.name, row.kind, row.clip, row.subject, row.sha256))
    counts = (row.part, row.frames, row.clip_frames, row.bytes, row.stamp, row.simulator)
    numbers = (*row.betas, *row.figures.values(), *row.limbs_through.values(), row.edge_ratio)
    if not (texts and all(type(count) is int for count in counts) and all(is_number(value) for value in numbers)):
        raise ValueError("no row of an index")
    if not (row.failed is None or isinstance(row.failed, str)):
        raise ValueError("no row of an index")
    return row

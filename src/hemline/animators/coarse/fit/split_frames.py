"""Frames of takes, and what each is for: to learn from, or to choose by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from hemline.arrays import Int
from hemline.datasets.collection import Collection, Entry
from hemline.sim.takes.jobs import Progress, ignore_progress

from .walk import TakeWalk, walk_takes
from .garment_frames import GarmentFrames

HELD_OUT = ("new_clip", "new_garment", "both_new")
"""What epochs are chosen by: takes of subjects, of garments, or of both that are not learned from."""


@dataclass(frozen=True, eq=False)
class SplitFrames:
    """Frames garment by garment and body by body."""

    groups: Sequence[GarmentFrames]
    splits: Sequence[np.ndarray]
    """What each frame is for, in an array for each garment on a body: `train` or one of `HELD_OUT`."""

    @classmethod
    def of(
        cls,
        data: Collection,
        sides: Mapping[str, Sequence[Entry]],
        walk: TakeWalk,
        folder: Path,
        *,
        jobs: int = 1,
        tell: Progress = ignore_progress,
    ) -> Self:
        """Frames of takes, see `walk.walked`.

        Args:
            data: The datasets.
            sides: The takes by what they are for.
            walk: Which frames.
            folder: Where they are kept.
            jobs: Processes that walk.
            tell: Called with the garments on bodies done and in all.
        """
        side_of = {take_id(entry): name for name, entries in sides.items() for entry in entries}
        entries = [entry for each in sides.values() for entry in each]
        worn, takes = walk_takes(data, entries, walk, folder, jobs=jobs, tell=tell)
        found = [np.array([side_of[take_id(each)] for each in own]) for own in takes]
        return cls(worn, [own[np.asarray(each.take)] for each, own in zip(worn, found, strict=True)])

    def part(self, side: str) -> list[tuple[GarmentFrames, Int[np.ndarray, " frames"]]]:
        """The frames of one side: those of each garment on a body that has some, and their numbers."""
        rows = [(each, np.flatnonzero(own == side)) for each, own in zip(self.groups, self.splits, strict=True)]
        return [(each, own) for each, own in rows if len(own)]


def take_id(entry: Entry) -> tuple[int, str]:
    """Which take it is."""
    return entry.dataset, entry.row.name

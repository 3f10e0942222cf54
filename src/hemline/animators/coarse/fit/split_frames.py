"""Frames of takes, split into those to train on and those to choose the best epoch by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from hemline.arrays import Int
from hemline.datasets.collection import Collection, Entry
from hemline.sim.takes.jobs import Progress, ignore_progress

from .garment_frames import GarmentFrames
from .walk import TakeWalk, walk_takes

HELD_OUT = ("new_clip", "new_garment", "both_new")
"""Splits that epochs are chosen by: takes of new subjects, of new garments, or of both."""


@dataclass(frozen=True, eq=False)
class SplitFrames:
    """Frames by garment and body, each with the name of its split."""

    groups: Sequence[GarmentFrames]
    """Frames of each garment on a body."""
    splits: Sequence[np.ndarray]
    """Split of each frame of each group: `train` or one of `HELD_OUT`."""

    @classmethod
    def of(
        cls,
        data: Collection,
        splits: Mapping[str, Sequence[Entry]],
        walk: TakeWalk,
        folder: Path,
        *,
        jobs: int = 1,
        tell: Progress = ignore_progress,
    ) -> Self:
        """Extracts frames from takes, see `walk.walk_takes`.

        Args:
            data: The datasets.
            splits: The takes by the names of their splits.
            walk: Frames to extract.
            folder: Folder for the frames.
            jobs: Number of processes.
            tell: Called with the groups done and the number of groups.
        """
        split_of = {take_id(entry): name for name, entries in splits.items() for entry in entries}
        # in an order that does not depend on the split, so that files of another split are used again
        entries = sorted((entry for each in splits.values() for entry in each), key=take_id)
        groups, takes = walk_takes(data, entries, walk, folder, jobs=jobs, tell=tell)
        names = [np.array([split_of[take_id(each)] for each in own]) for own in takes]
        return cls(groups, [own[np.asarray(each.take)] for each, own in zip(groups, names, strict=True)])

    def part(self, split: str) -> list[tuple[GarmentFrames, Int[np.ndarray, " frames"]]]:
        """Returns the groups that have wanted frames of one split, each with the rows of these frames."""
        pairs = zip(self.groups, self.splits, strict=True)
        rows = [(each, np.flatnonzero((own == split) & np.asarray(each.wanted))) for each, own in pairs]
        return [(each, own) for each, own in rows if len(own)]


def take_id(entry: Entry) -> tuple[int, str]:
    """Returns the number of the dataset and the name of a take."""
    return entry.dataset, entry.row.name

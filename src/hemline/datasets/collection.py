"""Collections of datasets, from which an animator of many garments learns."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hemline.bodies import Body
from hemline.errors import BadDataset
from hemline.garments.garment import Garment

from .dataset import Dataset, open_dataset
from .row import Row
from .simulators import warn_of_several
from .split import FRACTIONS, Fractions, split_by
from .take import Take

By = Literal["subject", "garment", "body"]
"""What two sides of a split do not share: a person's motions, a garment, or a shape of the body."""


@dataclass(frozen=True)
class Entry:
    """A take of a collection."""

    dataset: int
    """Number of the dataset in the collection."""
    row: Row


@dataclass(frozen=True)
class Collection:
    """Datasets of different garments, one for each garment."""

    datasets: tuple[Dataset, ...]

    def __post_init__(self) -> None:
        if not self.datasets:
            raise BadDataset("a collection needs a dataset", "none", "name at least one folder")
        folders: dict[str, Path] = {}
        for each in self.datasets:
            first = folders.setdefault(each.garment.hash, each.folder)
            if first is not each.folder:
                raise BadDataset(
                    f"two datasets hold the same garment, {each.garment.name}",
                    f"{first} and {each.folder}",
                    "copy the takes of one into the other, and name that",
                )

    @property
    def garments(self) -> tuple[Garment, ...]:
        """The garment of each dataset."""
        return tuple(each.garment for each in self.datasets)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The body of each dataset, see `Dataset.body`."""
        return tuple(each.body for each in self.datasets)

    def clips(self) -> list[Entry]:
        """Returns all takes of clips that did not fail, dataset by dataset."""
        return [Entry(number, row) for number, each in enumerate(self.datasets) for row in each.clips()]

    def anchors(self) -> list[Entry]:
        """Returns all anchors that did not fail, dataset by dataset."""
        return [Entry(number, row) for number, each in enumerate(self.datasets) for row in each.anchors()]

    def take(self, entry: Entry) -> Take:
        """Reads a take."""
        return self.datasets[entry.dataset].take(entry.row)

    def split(
        self, which: Literal["train", "val", "test"], *, by: By = "subject", fractions: Fractions = FRACTIONS
    ) -> list[Entry]:
        """Returns the clips of `train`, `val` or `test`, with no subject, garment or shape on two sides.

        Args:
            which: The side.
            by: What sides do not share. With fewer than three subjects, clips are split instead; with fewer than three
                garments or shapes, there is no split.
            fractions: Fractions of the frames.

        Raises:
            BadDataset: There are fewer than three garments or shapes.
        """
        entries = self.clips()
        groups = [self._group(entry, by) for entry in entries]
        if by == "subject" and len(set(groups)) < 3:
            groups = [entry.row.clip for entry in entries]
        elif len(set(groups)) < 3:
            raise BadDataset(f"a split by {by} needs three", len(set(groups)), "simulate more, or split by subject")
        return split_by(entries, groups, [entry.row.clip_frames for entry in entries], fractions)[which]

    def _group(self, entry: Entry, by: By) -> str:
        garment = self.datasets[entry.dataset].garment
        if by == "garment":
            return garment.hash
        return entry.row.subject if by == "subject" else f"{garment.body_name} {entry.row.betas}"


def open_collection(folders: Sequence[str | Path]) -> Collection:
    """Opens datasets together, with a warning if several simulators made their takes.

    Raises:
        BadDataset: A folder is not a dataset, or two datasets hold the same garment.
    """
    collection = Collection(tuple(open_dataset(folder) for folder in folders))
    warn_of_several(collection.datasets)
    return collection

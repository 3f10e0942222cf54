"""Checks of a dataset before takes are made for it, so that no hours are lost."""

from pathlib import Path

from hemline.datasets import Dataset, create, warn_of_others
from hemline.garments.garment import Garment
from hemline.sim.settings import SIMULATOR


def start_dataset(folder: str | Path, garment: Garment) -> Dataset:
    """Creates or opens the dataset that takes are made for.

    Damaged takes are moved aside, with a warning each, and made again when they are needed. Another warning tells how
    many takes another simulator made.

    Args:
        folder: The dataset; created if missing.
        garment: The garment of the dataset.

    Raises:
        BadDataset: The folder holds another garment's takes, or a take that cannot be read.
        BadOutput: The folder cannot be written.
    """
    dataset = create(folder, garment)
    warn_of_others(dataset, dataset.put_damaged_aside(), SIMULATOR)
    return dataset

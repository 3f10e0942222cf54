"""What is looked at in a dataset before anything is made for it, so that no hours are lost."""

from pathlib import Path

from hemline.datasets import Dataset, create, warn_of_others
from hemline.garments.garment import Garment
from hemline.sim.settings import SIMULATOR


def start_dataset(folder: str | Path, garment: Garment) -> Dataset:
    """The dataset that takes are made for: made, or continued.

    Takes that are damaged are put aside, with a warning each, and made again where they are asked for. A warning says,
    too, how many takes another simulator made.

    Args:
        folder: The dataset; made when missing.
        garment: Its garment.

    Raises:
        BadDataset: The folder holds another garment's takes, or a take that cannot be read.
        BadOutput: The folder cannot be written.
    """
    dataset = create(folder, garment)
    warn_of_others(dataset, dataset.put_damaged_aside(), SIMULATOR)
    return dataset

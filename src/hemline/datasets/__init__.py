"""Simulated takes on disk: whole files named by the hash of their inputs, and an index that can always be rebuilt."""

from .collection import Collection as Collection
from .collection import open_collection as open_collection
from .dataset import Dataset as Dataset
from .dataset import Row as Row
from .dataset import create as create
from .dataset import open_dataset as open_dataset
from .take import Take as Take
from .take import read_take as read_take
from .take import take_name as take_name
from .take import write_take as write_take

__all__ = [
    "Collection",
    "Dataset",
    "Row",
    "Take",
    "create",
    "open_collection",
    "open_dataset",
    "read_take",
    "take_name",
    "write_take",
]

"""Datasets of simulated takes on disk: files named by the hash of their inputs, and an index that can be rebuilt."""

from .collection import Collection as Collection
from .collection import open_collection as open_collection
from .dataset import Dataset as Dataset
from .dataset import create as create
from .dataset import open_dataset as open_dataset
from .row import Row as Row
from .simulators import newest as newest
from .simulators import warn_of_others as warn_of_others
from .simulators import warn_of_several as warn_of_several
from .sound import leave_out_faulty as leave_out_faulty
from .take import Take as Take
from .take import read_take as read_take
from .take import take_name as take_name
from .take import write_take as write_take
from .take_faults import TakeFaults as TakeFaults
from .take_faults import take_faults as take_faults

__all__ = [
    "Collection",
    "Dataset",
    "Row",
    "Take",
    "TakeFaults",
    "create",
    "leave_out_faulty",
    "newest",
    "open_collection",
    "open_dataset",
    "read_take",
    "take_faults",
    "take_name",
    "warn_of_others",
    "warn_of_several",
    "write_take",
]

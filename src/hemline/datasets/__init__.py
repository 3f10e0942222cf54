"""Simulated takes on disk: whole files named by the hash of their inputs, and an index that can always be rebuilt."""

from .dataset import Dataset as Dataset
from .dataset import Row as Row
from .dataset import create as create
from .dataset import open_dataset as open_dataset
from .take import Take as Take
from .take import read_take as read_take
from .take import take_name as take_name
from .take import write_take as write_take

__all__ = ["Dataset", "Row", "Take", "create", "open_dataset", "read_take", "take_name", "write_take"]

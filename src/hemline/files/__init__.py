"""Atomic file writing, and the one container format in which hemline stores arrays."""

from .atomic import atomic_write as atomic_write
from .atomic import atomic_writes as atomic_writes
from .atomic import check_folder as check_folder
from .atomic import check_writable as check_writable
from .mapped import create_mapped_array as create_mapped_array
from .npz import Unreadable as Unreadable
from .npz import npz_arrays as npz_arrays
from .npz import npz_names as npz_names
from .reading import read_bytes as read_bytes
from .reading import read_text as read_text
from .tensors import content_hash as content_hash
from .tensors import map_tensors as map_tensors
from .tensors import read_metadata as read_metadata
from .tensors import read_tensors as read_tensors
from .tensors import tensor_bytes as tensor_bytes
from .tensors import write_tensors as write_tensors

__all__ = [
    "Unreadable",
    "atomic_write",
    "atomic_writes",
    "check_folder",
    "check_writable",
    "content_hash",
    "create_mapped_array",
    "map_tensors",
    "npz_arrays",
    "npz_names",
    "read_bytes",
    "read_metadata",
    "read_tensors",
    "read_text",
    "tensor_bytes",
    "write_tensors",
]

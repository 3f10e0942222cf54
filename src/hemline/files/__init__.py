"""Files written whole or not at all, and the one container that hemline stores arrays in."""

from .atomic import check_folder as check_folder
from .atomic import check_writable as check_writable
from .atomic import written_together as written_together
from .atomic import written_whole as written_whole
from .mapped import mapped_array as mapped_array
from .npz import Unreadable as Unreadable
from .npz import npz_arrays as npz_arrays
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
    "check_folder",
    "check_writable",
    "content_hash",
    "map_tensors",
    "mapped_array",
    "npz_arrays",
    "read_bytes",
    "read_metadata",
    "read_tensors",
    "read_text",
    "tensor_bytes",
    "write_tensors",
    "written_together",
    "written_whole",
]

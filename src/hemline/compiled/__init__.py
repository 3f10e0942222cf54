"""The only interface to numba: `kernel` compiles a function and keeps the machine code on disk for the next process.

Kernels live in files named `*kernels.py`, whose stems differ, and import `kernel` from here; nothing else imports
numba. `folder` decides where the machine code is kept and who may write there, `sources` and `cache` when it is
recompiled, `threads` how many threads kernels use. Names of numba that kernels need are re-exported.
"""

from numba import prange as prange
from numba import types as types
from numba.core import cgutils as cgutils
from numba.extending import intrinsic as intrinsic

from .decorator import kernel as kernel
from .folder import cache_folder as cache_folder
from .sources import kernel_files as kernel_files
from .sources import source_hash as source_hash
from .threads import at_most as at_most
from .threads import available as available
from .threads import real_time_threads as real_time_threads
from .threads import threads as threads
from .threads import use_threads as use_threads

__all__ = [
    "at_most",
    "available",
    "cache_folder",
    "cgutils",
    "intrinsic",
    "kernel",
    "kernel_files",
    "prange",
    "real_time_threads",
    "source_hash",
    "threads",
    "types",
    "use_threads",
]

"""Arrays that may be larger than the memory, mapped from files whose room on the disk is taken beforehand."""

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadOutput

CURE = "free some room on that disk, or write to another one"


def mapped_array(path: str | Path, dtype: Any, shape: tuple[int, ...]) -> np.ndarray:
    """An array of zeros that is mapped from a `.npy` file, to be written to in place.

    Where a mapped file has holes, the first write into one needs room on the disk, and where there is none the process
    is killed by a signal, without a word. So all room is taken here.

    Args:
        path: The file; one of that name is replaced.
        dtype: Type of the numbers.
        shape: Lengths of the array.

    Raises:
        BadOutput: The file cannot be written, or the disk has too little room; nothing is left of it then.
    """
    path = Path(path)
    try:
        array = np.lib.format.open_memmap(path, mode="w+", dtype=dtype, shape=shape)
        _reserve(path)
        return array
    except OSError as reason:
        with suppress(OSError):
            path.unlink()
        size = np.dtype(dtype).itemsize * int(np.prod(shape, dtype=np.int64))
        got = f"{reason.strerror or reason}: {size / 1e6:.3g} MB are needed"
        raise BadOutput(f"cannot write {path}", got, CURE) from reason


def _reserve(path: Path) -> None:
    """Take the room that a sparse file needs to be filled.

    Raises:
        OSError: There is too little.
    """
    with path.open("rb+") as stream:
        size = os.fstat(stream.fileno()).st_size
        if hasattr(os, "posix_fallocate"):
            try:
                os.posix_fallocate(stream.fileno(), 0, size)
                return
            except OSError as reason:
                # file systems that cannot, such as some of a network
                if reason.errno not in (errno.EINVAL, errno.EOPNOTSUPP, errno.ENOSYS):
                    raise
    if shutil.disk_usage(path.parent).free < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

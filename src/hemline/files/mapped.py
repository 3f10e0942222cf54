"""Arrays larger than the memory, mapped from files whose disk space is allocated beforehand."""

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadOutput

CURE = "free some room on that disk, or write to another one"


def create_mapped_array(path: str | Path, dtype: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Creates an array of zeros that is mapped from a `.npy` file, to be written in place.

    If a mapped file has holes, the first write into one needs disk space, and without any the process is killed by a
    signal, without a message. Therefore all space is allocated here.

    Args:
        path: The file; an existing one is replaced.
        dtype: Type of the numbers.
        shape: Shape of the array.

    Raises:
        BadOutput: The file cannot be written, or the disk has too little space; then no file is left.
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
    """Allocates the disk space that a sparse file needs.

    Raises:
        OSError: There is too little space.
    """
    with path.open("rb+") as stream:
        size = os.fstat(stream.fileno()).st_size
        if hasattr(os, "posix_fallocate"):
            try:
                os.posix_fallocate(stream.fileno(), 0, size)
                return
            except OSError as reason:
                # some file systems, such as network ones, cannot allocate
                if reason.errno not in (errno.EINVAL, errno.EOPNOTSUPP, errno.ENOSYS):
                    raise
    if shutil.disk_usage(path.parent).free < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

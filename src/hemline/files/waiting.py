"""Hidden folders for files that are being written, and the removal of folders whose writer was killed.

A writer locks its folder for as long as it lives, and the system releases the lock with the process. So a folder whose
lock can be taken is abandoned, and the next writer beside it removes it.
"""

import hashlib
import os
import platform
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

_MACHINE = hashlib.sha256(platform.node().encode()).hexdigest()[:8]
PREFIX = f".hemline-writing-{_MACHINE}-"
"""Prefix of the names of such folders, with the machine, since locks on some network disks hold on one machine only."""


@contextmanager
def waiting_folder(beside: Path) -> Iterator[Path]:
    """Creates a hidden folder for files that are being written; it is removed at the end of the block.

    Folders of killed writers in the same place are removed first; on systems and disks without locks they stay.

    Args:
        beside: The folder in which to create it, on the disk of the final files.

    Yields:
        The hidden folder, which only this user can read.

    Raises:
        OSError: The folder cannot be created.
    """
    remove_abandoned(beside)
    folder, lock = _make_folder(beside)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        release_lock(lock)


def remove_abandoned(beside: Path) -> None:
    """Removes the hidden folders of writers that are no longer alive, as far as that is possible."""
    with suppress(OSError):
        for name in os.listdir(beside):
            if name.startswith(PREFIX):
                _remove_if_abandoned(beside / name)


def take_lock(folder: Path) -> int | None:
    """Takes the lock of a folder, which lasts until `release_lock` or until this process ends.

    Returns:
        The lock for `release_lock`; None if the system or the disk has no locks.

    Raises:
        BlockingIOError: A living process holds the lock.
        OSError: The folder is missing, is a link, or cannot be opened.
    """
    if fcntl is None:
        return None
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise
    except OSError:
        os.close(lock)
        return None
    return lock


def release_lock(lock: int | None) -> None:
    """Releases the lock that `take_lock` returned."""
    if lock is not None:
        os.close(lock)


def _make_folder(beside: Path) -> tuple[Path, int | None]:
    """Creates a folder and locks it; tries again if another writer removes it before it is locked."""
    while True:
        folder = beside / (PREFIX + secrets.token_hex(4))
        with suppress(FileExistsError):
            folder.mkdir(mode=0o700)
            with suppress(FileNotFoundError, BlockingIOError):
                lock = take_lock(folder)
                if folder.exists():
                    return folder, lock
                release_lock(lock)


def _remove_if_abandoned(folder: Path) -> None:
    with suppress(OSError):
        lock = take_lock(folder)
        if lock is not None:
            shutil.rmtree(folder, ignore_errors=True)
            release_lock(lock)

"""Hidden folders in which files wait until they are whole, and what becomes of those whose writer was killed.

A writer holds a lock on its folder for as long as it lives, and the system ends the lock with the process. So a folder
whose lock can be taken is one that nobody will ever finish; the next writer beside it removes it.
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
"""How the name of such a folder begins; it names the machine, since some network disks keep locks to one machine."""


@contextmanager
def waiting_folder(beside: Path) -> Iterator[Path]:
    """Make a hidden folder for files that are being written; it is removed in the end.

    What killed writers left in the same place is removed first. On systems and disks without locks it stays.

    Args:
        beside: The folder to make it in, on the disk that the files will lie on.

    Yields:
        The hidden folder, which only this user can read.

    Raises:
        OSError: It cannot be made.
    """
    remove_abandoned(beside)
    folder, lock = _made(beside)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        release(lock)


def remove_abandoned(beside: Path) -> None:
    """Remove the hidden folders of writers that are no longer alive; what cannot be looked at or removed stays."""
    with suppress(OSError):
        for name in os.listdir(beside):
            if name.startswith(PREFIX):
                _remove_if_abandoned(beside / name)


def held(folder: Path) -> int | None:
    """Take the lock of a folder, which lasts until `release` or until this process ends.

    Returns:
        What `release` takes; None: the system, or the disk, has no locks.

    Raises:
        BlockingIOError: A process that is alive holds it.
        OSError: The folder is not there, is a link, or cannot be opened.
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


def release(lock: int | None) -> None:
    """Give back what `held` took."""
    if lock is not None:
        os.close(lock)


def _made(beside: Path) -> tuple[Path, int | None]:
    """A new folder and its lock; another writer may take it for abandoned before it is locked, then there is a next."""
    while True:
        folder = beside / (PREFIX + secrets.token_hex(4))
        with suppress(FileExistsError):
            folder.mkdir(mode=0o700)
            with suppress(FileNotFoundError, BlockingIOError):
                lock = held(folder)
                if folder.exists():
                    return folder, lock
                release(lock)


def _remove_if_abandoned(folder: Path) -> None:
    with suppress(OSError):
        lock = held(folder)
        if lock is not None:
            shutil.rmtree(folder, ignore_errors=True)
            release(lock)

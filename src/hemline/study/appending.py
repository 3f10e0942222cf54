"""A file that several threads and processes append to, one at a time; what is added is there whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hemline.errors import BadOutput


class Appendable:
    """A file that nobody else writes to meanwhile.

    Args:
        descriptor: The open file.
        content: All that it holds.
    """

    def __init__(self, descriptor: int, content: bytes):
        self.descriptor, self.content = descriptor, content

    def append(self, kept: int, addition: bytes) -> None:
        """Keep the first bytes and add others; on an error the file ends where they did.

        Args:
            kept: How many of the bytes of `content` are kept.
            addition: What follows them.

        Raises:
            OSError: The disk is full, or fails.
        """
        os.ftruncate(self.descriptor, kept)
        try:
            written = os.write(self.descriptor, addition)
            if written != len(addition):
                raise OSError(f"{written} of {len(addition)} bytes were written")
            os.fsync(self.descriptor)
        except BaseException:
            os.ftruncate(self.descriptor, kept)
            raise


@contextmanager
def open_locked(path: str | Path) -> Iterator[Appendable]:
    """Open a file for appending, made where there is none, and keep others out until the block ends.

    Raises:
        BadOutput: It cannot be opened, read or written, or the system has no locks.
    """
    try:
        import fcntl
    except ImportError as reason:
        raise BadOutput(f"cannot lock {path}", "a system without file locks", "use Linux, macOS or WSL") from reason
    cure = "name a file in a folder that exists, can be written and has room"
    try:
        with open(path, "a+b") as stream:
            fcntl.flock(stream, fcntl.LOCK_EX)  # released when the file is closed
            stream.seek(0)
            yield Appendable(stream.fileno(), stream.read())
    except OSError as reason:
        raise BadOutput(f"cannot write {path}", reason.strerror or reason, cure) from reason

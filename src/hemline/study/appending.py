"""A file to which threads and processes append in turn; each addition is written whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hemline.errors import BadOutput


class Appendable:
    """A locked file, which nobody else writes to.

    Args:
        descriptor: The open file.
        content: Present content of the file.
    """

    def __init__(self, descriptor: int, content: bytes):
        self.descriptor, self.content = descriptor, content

    def append(self, length: int, addition: bytes) -> None:
        """Truncates the file and appends bytes; on an error only the truncation remains.

        Args:
            length: Number of bytes of `content` that are kept.
            addition: Bytes that follow them.

        Raises:
            OSError: The disk is full, or fails.
        """
        os.ftruncate(self.descriptor, length)
        try:
            written = os.write(self.descriptor, addition)
            if written != len(addition):
                raise OSError(f"{written} of {len(addition)} bytes were written")
            os.fsync(self.descriptor)
        except BaseException:
            os.ftruncate(self.descriptor, length)
            raise


@contextmanager
def open_locked(path: str | Path) -> Iterator[Appendable]:
    """Opens a file for appending, makes it if missing, and locks it until the block ends.

    Raises:
        BadOutput: The file cannot be opened, read or written, or the system has no locks.
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

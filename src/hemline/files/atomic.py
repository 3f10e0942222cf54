"""Write a file whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hemline.errors import BadOutput


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; on success it takes the final name, on failure nothing is left.

    The temporary file has the same ending, since many writers choose their format by it.

    Args:
        path: The final name. Its folder must exist.

    Yields:
        A path to write to.

    Raises:
        BadOutput: The folder does not exist or cannot be written, or the disk is full.

    Example:
        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> with written_whole(folder + "/a.txt") as temporary:
        ...     _ = temporary.write_text("whole")
        >>> Path(folder, "a.txt").read_text()
        'whole'
    """
    path = Path(path)
    cure = "name a folder that exists, can be written and has room"
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise BadOutput(f"cannot write {path}", error.strerror or error, cure) from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb+") as stream:
            os.fsync(stream.fileno())
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    except OSError as error:
        raise BadOutput(f"cannot write {path}", error.strerror or error, cure) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def check_folder(path: str | Path) -> None:
    """Refuse a folder that could not be made or written to, before hours of work; nothing is made.

    Raises:
        BadOutput: It is a file, or it, or the folder that it would be made in, cannot be written.
    """
    path = Path(path)
    cure = "name a folder that can be made or written to"
    try:
        there = next(each for each in (path.absolute(), *path.absolute().parents) if each.exists())
        if not there.is_dir():
            raise BadOutput(f"cannot write to {path}", f"{there}, which is a file", cure)
        with tempfile.TemporaryFile(dir=there):
            return
    except OSError as error:
        raise BadOutput(f"cannot write to {path}", error.strerror or error, cure) from error


def check_writable(path: str | Path) -> None:
    """Refuse a path that could not be written, before hours of work.

    Raises:
        BadOutput: Its folder does not exist or cannot be written, or the path is a folder.
    """
    path = Path(path)
    if path.is_dir():
        raise BadOutput(f"cannot write {path}", "a folder of that name", "choose another name")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            return
    except OSError as error:
        cure = "name a folder that exists, can be written and has room"
        raise BadOutput(f"cannot write {path}", error.strerror or error, cure) from error

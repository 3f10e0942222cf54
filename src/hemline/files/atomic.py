"""Writes files atomically: complete or not at all."""

import os
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from hemline.errors import BadOutput

from .waiting import waiting_folder

_CURE = "name a folder that exists, can be written and has room"
_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """Yields a temporary path to write to; on success that file takes the final name, on failure nothing is left.

    At each moment, even if this process is killed or the power fails, the final name holds either the complete old file
    or the complete new one. If it is a link, the file that it points to is replaced. A file that is replaced passes on
    its mode. Remains of a killed process are removed by the next process that writes into that folder.

    Args:
        path: The final name. Its folder must exist.

    Yields:
        A path to write to, with the same ending, since many writers select their format by it.

    Raises:
        BadOutput: The folder does not exist or cannot be written, the disk is full, or the name is that of a folder,
            device, pipe or socket.

    Example:
        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> with atomic_write(folder + "/a.txt") as temporary:
        ...     _ = temporary.write_text("whole")
        >>> Path(folder, "a.txt").read_text()
        'whole'
    """
    with atomic_writes([path]) as (temporary,):
        yield temporary


@contextmanager
def atomic_writes(paths: Sequence[str | Path], *, waiting_in: Path | None = None) -> Iterator[list[Path]]:
    """Yields a temporary path for each of several files; when all are written, they take their final names in order.

    Each file is complete or absent, as with `atomic_write`. A process that is killed while names are assigned may leave
    some old files among the new ones.

    Args:
        paths: The final names. Their folders must exist.
        waiting_in: Folder for the temporary files, on the same disk; None: the folder of each file.

    Yields:
        Paths to write to.

    Raises:
        BadOutput: A file cannot be written (see `atomic_write`), or two of the names lead to the same file.
    """
    targets = [_target(Path(path)) for path in paths]
    _refuse_duplicates(paths, targets)
    written: dict[str, str | Path] = {}
    try:
        with ExitStack() as stack:
            beside = [waiting_in or target.parent for target in targets]
            folders = {each: stack.enter_context(waiting_folder(each)) for each in dict.fromkeys(beside)}
            waiting = [folders[each] / f"{place}{targets[place].suffix}" for place, each in enumerate(beside)]
            written = dict(zip(map(str, waiting), paths, strict=True))
            yield waiting
            for temporary, target in zip(waiting, targets, strict=True):
                _make_lasting(temporary)
                _hand_on_mode(target, temporary)
            for temporary, target in zip(waiting, targets, strict=True):
                temporary.replace(target)
            for folder in dict.fromkeys(target.parent for target in targets):
                make_names_lasting(folder)
    except OSError as error:
        path = written.get(str(error.filename), paths[0])
        raise BadOutput(f"cannot write {path}", error.strerror or error, _CURE) from error


def make_names_lasting(folder: Path) -> None:
    """Flushes the names in a folder to disk where possible, so that a power failure does not undo a renaming."""
    with suppress(OSError):  # Windows cannot open folders, and some network disks cannot flush them
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def check_folder(path: str | Path) -> None:
    """Raises before hours of work if a folder cannot be created or written to; creates nothing.

    Raises:
        BadOutput: It is a file, or it, or the folder in which it would be created, cannot be written.
    """
    path = Path(path)
    cure = "name a folder that can be made or written to"
    try:
        there = next(each for each in (path.absolute(), *path.absolute().parents) if os.path.lexists(each))
        if not there.is_dir():
            kind = _KINDS.get(stat.S_IFMT(there.stat().st_mode), "a file") if there.exists() else "a link to nothing"
            raise BadOutput(f"cannot write to {path}", f"{there}, which is {kind}", cure)
        with tempfile.TemporaryFile(dir=there):
            return
    except OSError as error:
        raise BadOutput(f"cannot write to {path}", error.strerror or error, cure) from error


def check_writable(path: str | Path) -> None:
    """Raises before hours of work if a file cannot be written; creates nothing.

    Raises:
        BadOutput: Its folder does not exist or cannot be written, or the path is that of a folder, device, pipe or
            socket.
    """
    path = Path(path)
    folder = _target(path).parent
    try:
        with tempfile.TemporaryFile(dir=folder):
            return
    except OSError as error:
        raise BadOutput(f"cannot write {path}", error.strerror or error, _CURE) from error


def _target(path: Path) -> Path:
    """Returns the file that a path leads to through links; raises if it exists and is no regular file."""
    try:
        kind = stat.S_IFMT(path.stat().st_mode)
    except FileNotFoundError:
        kind = stat.S_IFREG  # to be made
    except OSError as error:
        raise BadOutput(f"cannot write {path}", error.strerror or error, _CURE) from error
    if kind == stat.S_IFDIR:
        raise BadOutput(f"cannot write {path}", "a folder of that name", "choose another name")
    if kind != stat.S_IFREG:
        got = f"{_KINDS.get(kind, 'no regular file')} of that name"
        raise BadOutput(f"cannot write {path}", got, "name a file, which hemline replaces as a whole")
    return Path(os.path.realpath(path))


def _refuse_duplicates(paths: Sequence[str | Path], targets: Sequence[Path]) -> None:
    """Raises if two names lead to one file because one of them is a link."""
    first: dict[Path, str | Path] = {}
    for path, target in zip(paths, targets, strict=True):
        if target in first:
            raise BadOutput(f"cannot write {path}", f"a link to the file of {first[target]}", "remove the link")
        first[target] = path


def _make_lasting(temporary: Path) -> None:
    """Flushes a file to disk before a name leads to it."""
    with temporary.open("rb+") as stream:
        os.fsync(stream.fileno())


def _hand_on_mode(target: Path, temporary: Path) -> None:
    """Gives a new file the mode of the one that it replaces, and its owner and group if that is allowed."""
    try:
        old = target.stat()
    except FileNotFoundError:
        return
    new = temporary.stat()
    if hasattr(os, "chown") and (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
        with suppress(OSError):
            os.chown(temporary, old.st_uid, old.st_gid)
    temporary.chmod(stat.S_IMODE(old.st_mode) & 0o777)

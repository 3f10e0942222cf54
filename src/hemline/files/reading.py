"""Reads files from other programs: only regular files, and only up to a size that their kind can have."""

import codecs
import os
import stat
from pathlib import Path
from typing import IO

from hemline.errors import BadInput

TEXT_MAX = 2**28
"""Largest size of a text file of a clip or mesh [bytes]; as numbers it takes several times as much memory."""


def read_bytes(path: str | Path, most: int, *, error: type[BadInput], cure: str) -> bytes:
    """Returns the content of a file, after checking its size.

    Args:
        path: The file.
        most: Largest size [bytes].
        error: Class of the exception.
        cure: Cure for the message if it cannot be read.

    Raises:
        error: The file is missing, cannot be read, is a folder, a pipe, a socket or a device, or is larger.
    """
    path = Path(path)
    if not _can_be_named(path):
        raise error(f"cannot read {str(path)[:60]}", "a name that no file can have", cure)
    try:
        _refuse_other_sorts(path, path.stat().st_mode, error, cure)  # before opening, which may have side effects
        with open(path, "rb", opener=_without_waiting) as stream:
            _refuse_other_sorts(path, os.fstat(stream.fileno()).st_mode, error, cure)
            return _whole(path, stream, most, error)
    except OSError as reason:
        raise error(f"cannot read {path}", reason.strerror or reason, cure) from reason
    except MemoryError as reason:
        raise error(f"cannot read {path}", "a file larger than the memory that is left", "free some memory") from reason


def read_text(path: str | Path, most: int, *, error: type[BadInput], cure: str, encoding: str, strict: bool) -> str:
    """Returns the text of a file, read by `read_bytes`, with line feeds as line ends.

    A byte order mark at its beginning is dropped, and says where a file is in UTF-16 whatever `encoding` says.

    Args:
        path: The file.
        most: Largest size [bytes].
        error: Class of the exception.
        cure: Cure for the message if it cannot be read.
        encoding: Encoding of the text.
        strict: Whether invalid bytes raise; otherwise each is replaced.

    Raises:
        error: See `read_bytes`.
        UnicodeDecodeError: Bytes are invalid in the encoding.
    """
    content = read_bytes(path, most, error=error, cure=cure)
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    text = content.removeprefix(codecs.BOM_UTF8).decode(encoding, "strict" if strict else "replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _can_be_named(path: Path) -> bool:
    """Tells whether a path is a possible file name; half of a surrogate pair or a zero byte is not."""
    try:
        return b"\0" not in os.fsencode(path)
    except UnicodeEncodeError:
        return False


def _without_waiting(name: str, flags: int) -> int:
    """Opens a file without blocking; a pipe that took its place in the meantime does not wait for a writer."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def _refuse_other_sorts(path: Path, mode: int, error: type[BadInput], cure: str) -> None:
    sorts = {stat.S_IFREG: "", stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
    if sort := sorts.get(stat.S_IFMT(mode), "a device"):
        raise error(f"cannot read {path}", sort, cure)


def _whole(path: Path, stream: IO[bytes], most: int, error: type[BadInput]) -> bytes:
    size = os.fstat(stream.fileno()).st_size
    content = stream.read(size + 1) if size <= most else b""
    if max(size, len(content)) > most:
        raise error(f"{path} is too large", f"{size} bytes", f"name a file of at most {most} bytes")
    return content

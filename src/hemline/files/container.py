"""Opens safetensors files, and never reads more than the header lists.

The header is read and checked before anything else: its length against that of the file, the listed arrays against the
bytes that follow. So a file with a false header costs no memory, however long it is.
"""

import json
import math
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from hemline.errors import BadInput

LARGEST_HEADER = 16_000_000
"""Largest size of a header [bytes]; parsed, it takes about thirty times as much memory."""

MOST_DIMENSIONS = 32
"""Largest number of dimensions of an array, that of NumPy 1."""

_DTYPES = {
    "F64": "<f8",
    "F32": "<f4",
    "F16": "<f2",
    "I64": "<i8",
    "I32": "<i4",
    "I16": "<i2",
    "I8": "|i1",
    "U64": "<u8",
    "U32": "<u4",
    "U16": "<u2",
    "U8": "|u1",
    "BOOL": "|b1",
}
"""Types of NumPy by their names in the format; bfloat16 and eight-bit floats, which NumPy lacks, are refused."""


class InvalidContainer(ValueError):
    """The content of a file does not agree with its header; the text says what was found."""


@dataclass(frozen=True)
class ArrayEntry:
    """One array as the header lists it."""

    name: str
    dtype: np.dtype
    shape: tuple[int, ...]
    begin: int
    """Position of its first byte, counted from the end of the header."""

    @property
    def size(self) -> int:
        """Size of the array [bytes]."""
        return math.prod(self.shape) * self.dtype.itemsize


@dataclass(frozen=True)
class Container:
    """An open file whose header was read, positioned at the first byte of the arrays."""

    stream: BinaryIO
    header: dict[str, Any]
    room: int
    """Number of bytes after the header."""

    def arrays(self) -> dict[str, np.ndarray]:
        """Reads all arrays, writable and C-contiguous.

        Raises:
            InvalidContainer: The header lists an impossible array, or the arrays do not fill the file one after the
                other.
            OSError: The file cannot be read.
            MemoryError: There is not enough memory.
        """
        # in the order of their bytes, so that the file is read sequentially
        return {entry.name: self._array(entry) for entry in self._entries()}

    def map_arrays(self, path: Path) -> dict[str, np.ndarray]:
        """Maps all arrays from the file, read-only; they take memory only when they are accessed.

        Args:
            path: The file.

        Raises:
            InvalidContainer: See `arrays`.
            OSError: The file cannot be read.
        """
        start = self.stream.tell()
        return {
            entry.name: np.memmap(path, entry.dtype, "r", start + entry.begin, entry.shape)
            if entry.size
            else np.empty(entry.shape, entry.dtype)
            for entry in self._entries()
        }

    def _entries(self) -> list[ArrayEntry]:
        """Returns the arrays that the header lists, in the order of their bytes; they must fill the file."""
        entries = [_entry(name, value) for name, value in self.header.items() if name != "__metadata__"]
        end = 0
        for entry in sorted(entries, key=lambda entry: (entry.begin, entry.size)):
            if entry.begin != end:
                raise InvalidContainer("arrays that do not follow each other as its header says")
            end += entry.size
        if end != self.room:
            raise InvalidContainer("arrays that do not fill it as its header says")
        return sorted(entries, key=lambda each: (each.begin, each.size))

    def _array(self, entry: ArrayEntry) -> np.ndarray:
        array = np.empty(entry.shape, entry.dtype)
        content = array.reshape(-1).view(np.uint8)
        if self.stream.readinto(memoryview(content)) != entry.size:  # type: ignore[attr-defined]
            raise InvalidContainer("a file that became shorter while it was read")
        if entry.dtype.kind == "b" and content.size and content.max() > 1:
            raise InvalidContainer(f"truth values in '{entry.name}' that are neither 0 nor 1")
        return array


@contextmanager
def open_container(path: str | Path, error: type[BadInput], cure: str) -> Iterator[Container]:
    """Opens a file of the format and reads its header.

    Args:
        path: The file.
        error: Class of the exception if the file cannot be read.
        cure: Cure for the message.

    Raises:
        error: The file is missing, is a folder, a pipe or a device, or cannot be read.
        InvalidContainer: The file has no readable header.
    """
    path = Path(path)
    try:
        mode = path.stat().st_mode  # before opening, since opening a pipe would wait for a writer
        if not stat.S_ISREG(mode):
            raise error(f"cannot read {path}", _kind_of_path(mode), cure)
        with path.open("rb") as stream:
            yield _container(stream, path.stat().st_size)
    except OSError as reason:
        raise error(f"cannot read {path}", reason.strerror or reason, cure) from reason
    except MemoryError as reason:
        got, more = "arrays larger than the memory", "free memory, or take a machine with more"
        raise error(f"cannot read {path}", got, more) from reason


def _container(stream: BinaryIO, length: int) -> Container:
    start = stream.read(8)
    size = int.from_bytes(start, "little")
    if len(start) < 8 or not 2 <= size <= min(length - 8, LARGEST_HEADER):
        raise InvalidContainer(_kind_of_file(start))
    text = stream.read(size)
    try:
        header = json.loads(text)
    except (ValueError, RecursionError) as reason:
        raise InvalidContainer(_kind_of_file(start)) from reason
    if not isinstance(header, dict):
        raise InvalidContainer(_kind_of_file(start))
    return Container(stream, header, length - 8 - size)


def _entry(name: str, value: Any) -> ArrayEntry:
    try:
        kind, shape, (begin, end) = value["dtype"], value["shape"], value["data_offsets"]
    except (KeyError, TypeError, ValueError) as reason:
        raise InvalidContainer(f"a header that does not say what array '{name}' is") from reason
    if not isinstance(kind, str) or kind not in _DTYPES:
        raise InvalidContainer(f"array '{name}' of numbers of another kind, {str(kind)[:20]}")
    whole = isinstance(shape, list) and len(shape) <= MOST_DIMENSIONS
    if not whole or not all(type(n) is int and 0 <= n < 2**40 for n in (*shape, begin, end)):
        raise InvalidContainer(f"array '{name}' with a shape that none can have")
    entry = ArrayEntry(name, np.dtype(_DTYPES[kind]), tuple(shape), begin)
    if entry.begin + entry.size != end or math.prod(n for n in shape if n) >= 2**60:
        raise InvalidContainer(f"array '{name}' with a shape that does not fit its bytes")
    return entry


def _kind_of_path(mode: int) -> str:
    """Names the kind of something that is no regular file."""
    sorts = {stat.S_ISDIR: "a folder", stat.S_ISFIFO: "a pipe", stat.S_ISSOCK: "a socket"}
    return next((name for test, name in sorts.items() if test(mode)), "a device")


def _kind_of_file(start: bytes) -> str:
    """Names the kind of a file by its first bytes."""
    if not start:
        return "an empty file"
    if start[:2] in (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"):
        return "a pickle, which is never read"
    if start[:2] == b"PK":
        return "a zip archive (npz, or a torch file)"
    return "bytes without a readable header"

"""Reads arrays of npz files from other programs, member by member, with limits on their size."""

import io
import math
import zipfile
from collections.abc import Iterable
from typing import IO

import numpy as np

_BYTES_MAX = 2**30
_MEMBERS_MAX = 10_000
_UNPACKED_FREE = 2**22
_UNPACKED_TIMES = 16
"""Arrays may unpack to `_UNPACKED_FREE` bytes plus this many times the file; recorded motion packs to a fifth."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_HEADER_MAX = 10_000
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


class Unreadable(ValueError):
    """Content that cannot be read as arrays; the text says what was found."""


def npz_names(content: bytes) -> tuple[str, ...]:
    """Returns the names of the arrays that an npz file contains.

    Raises:
        Unreadable: The file is damaged.
    """
    with _archive(content) as archive:
        return tuple(each.filename.removesuffix(".npy") for each in archive.infolist())


def npz_arrays(content: bytes, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Reads the named arrays that an npz file contains; other members are not opened.

    Args:
        content: Content of the file.
        names: Names of arrays to read if present.

    Returns:
        Arrays of numbers by name, read-only.

    Raises:
        Unreadable: The file is damaged, a member holds objects (a pickle) or text or claims more bytes than it has, or
            the arrays are far larger than the file.
    """
    with _archive(content) as archive:
        members = {each.filename: each for each in archive.infolist()}
        wanted = [name for name in names if f"{name}.npy" in members]
        unpacked = sum(members[f"{name}.npy"].file_size for name in wanted)
        if unpacked > _BYTES_MAX:
            raise Unreadable(f"arrays of more than {_BYTES_MAX} bytes")
        if unpacked > _UNPACKED_FREE + _UNPACKED_TIMES * len(content):
            raise Unreadable(f"a file of {len(content)} bytes that unpacks to {unpacked}")
        return {name: _member(archive, members[f"{name}.npy"], name) for name in wanted}


def _archive(content: bytes) -> zipfile.ZipFile:
    if content.count(b"PK\x01\x02") > _MEMBERS_MAX:
        raise Unreadable(f"a zip archive of more than {_MEMBERS_MAX} members")
    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
    except Exception as reason:  # zipfile raises whatever a damaged archive provokes
        raise Unreadable("a damaged npz (no whole zip archive)") from reason
    return archive


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> np.ndarray:
    """Reads one array, after comparing its claimed size with that of the member."""
    if member.compress_type not in _METHODS:
        raise Unreadable(f"'{name}': packed in another way than NumPy does")
    try:
        with archive.open(member) as stream:
            shape, by_columns, dtype = _header(stream, name)
            if dtype.hasobject or dtype.kind not in "fiub":
                raise Unreadable(f"'{name}': an array of {'pickled objects' if dtype.hasobject else dtype}")
            size = math.prod(shape) * dtype.itemsize
            if size > member.file_size or min(shape, default=0) < 0:
                raise Unreadable(f"'{name}': an array that claims shape {shape} in {member.file_size} bytes")
            content = stream.read(size)
            if len(content) != size or stream.read(1):
                raise Unreadable(f"'{name}': an array of shape {shape} with {len(content)} bytes or more")
        return np.frombuffer(content, dtype).reshape(shape, order="F" if by_columns else "C")
    except Unreadable:
        raise
    except Exception as reason:  # zipfile, zlib and lzma do as well
        raise Unreadable(f"a damaged npz ('{name}' cannot be unpacked)") from reason


def _header(stream: IO[bytes], name: str) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Reads shape, whether the order is by columns, and type."""
    start = stream.read(np.lib.format.MAGIC_LEN)
    if start[:-2] != np.lib.format.MAGIC_PREFIX:
        raise Unreadable(f"a damaged npz ('{name}' is no array)")
    version = (start[-2], start[-1])
    if version not in _HEADERS:
        raise Unreadable(f"'{name}': an array of format {version}")
    try:
        return _HEADERS[version](stream, max_header_size=_HEADER_MAX)
    except zipfile.BadZipFile:
        raise
    except Exception as reason:  # numpy reads a header as Python reads source
        raise Unreadable(f"a damaged npz ('{name}' has an unreadable header)") from reason

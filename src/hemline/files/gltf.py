"""Reads glTF 2.0 (GLB, VRM, and glTF with its buffers): the document, and the arrays of its accessors."""

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadInput, HemlineError

from . import fbx
from .beside import beside
from .gltf_compression import decompress, is_fallback
from .reading import read_bytes

ENDINGS = (".glb", ".vrm", ".gltf", ".vrma")
"""File endings of glTF files."""
SCENES = (*ENDINGS, fbx.ENDING)
"""File endings of glTF files, and of those that are read by way of glTF."""

AGAIN = "export it again, as GLB"
_KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_BYTES_MAX = 2**31
_DOCUMENT_MAX = 2**28
_ROWS_MAX = 2_000_000
_FREE = 100_000


@dataclass(eq=False)
class _Read:
    """Cache of the arrays read so far."""

    arrays: dict[int, np.ndarray] = field(default_factory=dict)
    """Arrays by the number of their accessor."""
    numbers: int = 0
    """Total number of numbers in them."""


@dataclass(frozen=True, eq=False)
class Gltf:
    """A glTF file.

    Attributes:
        path: Path of the file.
        document: Its JSON document.
        buffers: Bytes of each buffer.
        error: Class of the exception if a part of it cannot be read.
    """

    path: Path
    document: dict[str, Any]
    buffers: tuple[bytes, ...]
    error: type[BadInput]
    _read: _Read = field(default_factory=_Read, repr=False)

    @cached_property
    def number_limit(self) -> int:
        """Largest number of numbers, or of corners of triangles, that may be made of the file.

        It is the number of bytes of the file, plus a constant. A document may name the same bytes again and again, or
        none at all, and so request any number of arrays; this limit prevents it.
        """
        return _FREE + sum(map(len, self.buffers))

    def all(self, name: str) -> list[dict[str, Any]]:
        """Returns the entries of one of the document's lists; none if there is no such list."""
        return self.document.get(name, [])

    @cached_property
    def extensions(self) -> dict[str, Any]:
        """The extensions of the whole file."""
        return self.document.get("extensions", {})

    def array(self, accessor: int) -> np.ndarray:
        """Returns the rows of an accessor, read-only; normalised integers become float32.

        Args:
            accessor: Number of the accessor.

        Raises:
            BadInput: (as `error`) It points outside of its buffer, has more than 2,000,000 rows, or has,
                together with all accessors read before, more than `number_limit` numbers.
        """
        with self.readable():
            if _index(accessor) not in self._read.arrays:
                entry = self.all("accessors")[accessor]
                count, width = _index(entry["count"]), _WIDTHS[entry["type"]]
                if count > _ROWS_MAX:
                    what = f"{self.path}: a list of vertices or keys may have {_ROWS_MAX} entries"
                    raise self.error(what, count, "reduce its meshes")
                self._read.numbers += count * width
                self.refuse_more(self._read.numbers)
                self._read.arrays[accessor] = self._array(entry, count, width)
            return self._read.arrays[accessor]

    def refuse_more(self, count: int) -> None:
        """Raises if more numbers than `number_limit` are requested.

        Raises:
            BadInput: (as `error`) `count` is larger.
        """
        if count > self.number_limit:
            what = f"{self.path} asks for more numbers than it can hold"
            raise self.error(what, f"{count} of a file of {self.number_limit - _FREE} bytes of them", AGAIN)

    def beside(self, uri: str) -> bytes:
        """Reads a file beside this one that it names.

        Raises:
            BadInput: (as `error`) The file lies elsewhere, or cannot be read.
        """
        return _content(self.path, _place(self.path, uri, "a file", self.error), self.error)

    def _array(self, entry: dict[str, Any], count: int, width: int) -> np.ndarray:
        """Reads the rows of an accessor, whose number was checked before."""
        dtype = np.dtype(_KINDS[entry["componentType"]])
        if "bufferView" in entry:
            rows = self._rows(entry["bufferView"], entry.get("byteOffset", 0), dtype, width, count)
        else:
            rows = np.zeros((count, width), dtype)
        if sparse := entry.get("sparse"):
            where, what = sparse["indices"], sparse["values"]
            kind = np.dtype(_KINDS[where["componentType"]])
            index = self._rows(where["bufferView"], where.get("byteOffset", 0), kind, 1, sparse["count"])[:, 0]
            values = self._rows(what["bufferView"], what.get("byteOffset", 0), dtype, width, sparse["count"])
            rows = rows.copy()
            rows[index] = values
        if entry.get("normalized") and dtype.kind != "f":
            rows = np.maximum(rows.astype(np.float32) / np.iinfo(dtype).max, -1)
        rows.flags.writeable = False
        return rows[:, 0] if width == 1 else rows

    def _rows(self, view: int, offset: int, dtype: np.dtype, width: int, count: int) -> np.ndarray:
        entry = self.all("bufferViews")[_index(view)]
        first = entry.get("byteOffset", 0) + offset
        stride = entry.get("byteStride") or dtype.itemsize * width
        content = self.buffers[_index(entry["buffer"])]
        last = first + (count - 1) * stride + dtype.itemsize * width if count else first
        inside = 0 <= first <= last <= len(content) and offset >= 0 and last - first <= entry["byteLength"]
        if not inside or stride < dtype.itemsize * width:
            raise ValueError("outside of its buffer")
        strides = (stride, dtype.itemsize)
        return np.ndarray((count, width), dtype, content, first, strides)

    @contextmanager
    def readable(self) -> Iterator[None]:
        """Context manager that turns the exceptions of a damaged document into `error`."""
        try:
            yield
        except HemlineError:
            raise
        except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as reason:
            got = "an entry that is missing, of the wrong kind, or points nowhere"
            raise self.error(f"{self.path} is damaged", got, AGAIN) from reason


def read_gltf(path: str | Path, *, error: type[BadInput]) -> Gltf:
    """Reads a GLB, VRM or glTF file; for glTF also the buffers beside it. An FBX is converted first.

    Args:
        path: The file.
        error: Class of the exception.

    Raises:
        MissingExtra: The file is an FBX, and the library that reads it is not installed.
        BadInput: (as `error`) The file is missing, damaged, of another version, or compressed by what is not installed.
    """
    path = Path(path)
    if path.suffix.lower() == fbx.ENDING:
        content = fbx.fbx_as_glb(path, error=error)
    else:
        content = read_bytes(path, _BYTES_MAX, error=error, cure="name a file that exists")
    text, binary = _chunks(path, content, error) if content[:4] == b"glTF" else (content, None)
    if len(text) > _DOCUMENT_MAX:
        raise error(f"{path} has too large a document", f"{len(text)} bytes of text", AGAIN)
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as reason:
        got = "an empty file" if not content else "a damaged file, or one of another format"
        raise error(f"{path} cannot be read as glTF", got, AGAIN) from reason
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise error(f"{path} cannot be read as glTF", "no entry 'asset'", AGAIN)
    version = str(document["asset"].get("version", ""))
    if version.split(".")[0] != "2":
        raise error(f"{path} must be glTF 2.0", f"version {version[:20] or 'none'}", AGAIN)
    gltf = Gltf(path, document, (), error)
    with gltf.readable():
        buffers = tuple(_buffers(path, gltf.all("buffers"), binary, error))
        document, buffers = decompress(path, document, buffers, error)
    return Gltf(path, document, buffers, error)


def _chunks(path: Path, content: bytes, error: type[BadInput]) -> tuple[bytes, bytes | None]:
    """Returns the text and the binary chunk of a GLB."""
    place, found = 12, {}
    while place + 8 <= len(content):
        length, kind = struct.unpack_from("<I4s", content, place)
        chunk = content[place + 8 : place + 8 + length]
        if len(chunk) < length:
            raise error(f"{path} is cut off", f"{len(content)} bytes", "copy it again, or export it again")
        found.setdefault(kind, chunk)
        place += 8 + length
    if b"JSON" not in found:
        raise error(f"{path} cannot be read as GLB", f"{len(content)} bytes without a document", AGAIN)
    return found[b"JSON"], found.get(b"BIN\0")


def _buffers(path: Path, buffers: list[dict], binary: bytes | None, error: type[BadInput]) -> Iterator[bytes]:
    """Yields the content of each buffer; no two buffers may share the binary chunk or a file."""
    named: set[Path | None] = set()
    room = _BYTES_MAX
    for entry in buffers:
        uri, length = entry.get("uri"), _index(entry["byteLength"])
        if uri is None and is_fallback(entry):
            yield b""
            continue
        if uri is not None and uri.startswith("data:"):
            content = _of_base64(path, uri, error)
        else:
            place = None if uri is None else _place(path, uri, "a buffer", error)
            whose = place and place.resolve()
            if whose in named:
                raise error(f"{path} has one file, or its own end, for two buffers", uri or "its own end", AGAIN)
            named.add(whose)
            content = (binary or b"") if place is None else _content(path, place, error, room)
            room -= len(content)
        if length > len(content):
            raise error(f"{path} is cut off", f"a buffer of {len(content)} bytes for {length}", AGAIN)
        yield content[:length]


def _of_base64(path: Path, uri: str, error: type[BadInput]) -> bytes:
    try:
        return base64.b64decode(uri.partition(",")[2], validate=True)
    except binascii.Error as reason:
        raise error(f"{path} is damaged", "a buffer that is no base64", AGAIN) from reason


def _place(path: Path, uri: str, what: str, error: type[BadInput]) -> Path:
    from urllib.parse import unquote

    return beside(path, unquote(uri), what, error=error, cure=AGAIN)


def _content(path: Path, place: Path, error: type[BadInput], most: int = _BYTES_MAX) -> bytes:
    """Reads a file beside a glTF file; its error says which file named it."""
    try:
        return read_bytes(place, most, error=error, cure=AGAIN)
    except BadInput as reason:
        raise error(f"{reason.what}, which {path.name} names", reason.got, reason.cure) from reason


def _index(number: Any) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or number < 0:
        raise ValueError("no index")
    return number

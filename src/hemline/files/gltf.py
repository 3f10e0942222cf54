"""glTF 2.0 as it stands: the document, and the arrays that its accessors name. GLB, VRM and glTF with its buffers."""

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadInput, HemlineError

ENDINGS = (".glb", ".vrm", ".gltf", ".vrma")
"""Endings of such files."""

AGAIN = "export it again, as GLB"
_KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
_BYTES_MAX = 2**31
_NUMBERS_MAX = 2**28


@dataclass(frozen=True, eq=False)
class Gltf:
    """A glTF file.

    Attributes:
        path: Where it was read from.
        document: Its JSON.
        buffers: The bytes of each buffer.
        error: What is raised where a part of it cannot be read.
    """

    path: Path
    document: dict[str, Any]
    buffers: tuple[bytes, ...]
    error: type[BadInput]

    def all(self, name: str) -> list[dict[str, Any]]:
        """The entries of one of the document's lists; none where it has no such list."""
        return self.document.get(name, [])

    @cached_property
    def extensions(self) -> dict[str, Any]:
        """What extensions say of the whole file."""
        return self.document.get("extensions", {})

    def array(self, accessor: int) -> np.ndarray:
        """The rows of an accessor; whole numbers that stand for shares as float32.

        Args:
            accessor: Its number.

        Raises:
            BadInput: (as `error`) It points outside of its buffer, or is compressed.
        """
        with self.readable():
            said = self.all("accessors")[_index(accessor)]
            dtype, width, count = np.dtype(_KINDS[said["componentType"]]), _WIDTHS[said["type"]], said["count"]
            if not isinstance(count, int) or not 0 <= count * width <= _NUMBERS_MAX:
                raise ValueError("count")
            rows = np.zeros((count, width), dtype)
            if "bufferView" in said:
                rows = self._rows(said["bufferView"], said.get("byteOffset", 0), dtype, width, count)
            if sparse := said.get("sparse"):
                where, what = sparse["indices"], sparse["values"]
                kind = np.dtype(_KINDS[where["componentType"]])
                index = self._rows(where["bufferView"], where.get("byteOffset", 0), kind, 1, sparse["count"])[:, 0]
                rows = rows.copy()
                values = self._rows(what["bufferView"], what.get("byteOffset", 0), dtype, width, sparse["count"])
                rows[index] = values
            if said.get("normalized") and dtype.kind != "f":
                rows = np.maximum(rows.astype(np.float32) / np.iinfo(dtype).max, -1)
            return rows[:, 0] if width == 1 else rows

    def beside(self, uri: str) -> bytes:
        """A file beside this one that it names.

        Raises:
            BadInput: (as `error`) It is elsewhere, or cannot be read.
        """
        return _beside(self.path, uri, self.error)

    def _rows(self, view: int, offset: int, dtype: np.dtype, width: int, count: int) -> np.ndarray:
        said = self.all("bufferViews")[_index(view)]
        first = said.get("byteOffset", 0) + offset
        stride = said.get("byteStride") or dtype.itemsize * width
        content = self.buffers[_index(said["buffer"])]
        last = first + (count - 1) * stride + dtype.itemsize * width if count else first
        inside = 0 <= first <= last <= len(content) and offset >= 0 and last - first <= said["byteLength"]
        if not inside or stride < dtype.itemsize * width:
            raise ValueError("outside of its buffer")
        strides = (stride, dtype.itemsize)
        return np.ndarray((count, width), dtype, content, first, strides)

    @contextmanager
    def readable(self) -> Iterator[None]:
        """Turn what a damaged document makes Python raise into an error in our words."""
        try:
            yield
        except HemlineError:
            raise
        except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as reason:
            got = "an entry that is missing, of the wrong kind, or points nowhere"
            raise self.error(f"{self.path} is damaged", got, AGAIN) from reason


def read_gltf(path: str | Path, *, error: type[BadInput]) -> Gltf:
    """Read a GLB, VRM or glTF file; of the latter also the buffers beside it.

    Args:
        path: The file.
        error: What is raised where it cannot be read.

    Raises:
        BadInput: (as `error`) Missing, damaged, another version, or compressed.
    """
    path = Path(path)
    try:
        if path.stat().st_size > _BYTES_MAX:
            raise error(f"{path} is too large", f"{path.stat().st_size} bytes", "reduce its textures")
        content = path.read_bytes()
    except OSError as reason:
        raise error(f"cannot read {path}", reason.strerror or reason, "name a file that exists") from reason
    text, binary = _chunks(path, content, error) if content[:4] == b"glTF" else (content, None)
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
    needed = document.get("extensionsRequired", [])
    compressed = [name for name in _COMPRESSED if isinstance(needed, list) and name in needed]
    if compressed:
        cure = "export it without compression, or run: npx @gltf-transform/cli copy IN.glb OUT.glb"
        raise error(f"{path} is compressed", compressed[0], cure)
    gltf = Gltf(path, document, (), error)
    with gltf.readable():
        buffers = tuple(_buffer(path, said, binary, error) for said in gltf.all("buffers"))
    return Gltf(path, document, buffers, error)


def _chunks(path: Path, content: bytes, error: type[BadInput]) -> tuple[bytes, bytes | None]:
    """The text and the binary chunk of a GLB."""
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


def _buffer(path: Path, said: dict, binary: bytes | None, error: type[BadInput]) -> bytes:
    uri, length = said.get("uri"), said["byteLength"]
    if uri is None:
        content = binary if binary is not None else b""
    elif uri.startswith("data:"):
        try:
            content = base64.b64decode(uri.partition(",")[2], validate=True)
        except binascii.Error as reason:
            raise error(f"{path} is damaged", "a buffer that is no base64", AGAIN) from reason
    else:
        content = _beside(path, uri, error)
    if not 0 <= length <= len(content):
        raise error(f"{path} is cut off", f"a buffer of {len(content)} bytes for {length}", AGAIN)
    return content[:length]


def _beside(path: Path, uri: str, error: type[BadInput]) -> bytes:
    from urllib.parse import unquote

    name = unquote(uri)
    file = path.parent / name
    if "\0" in name or ":" in name or Path(name).is_absolute() or ".." in Path(name).parts:
        raise error(f"{path} names a buffer that is not beside it", name[:60], AGAIN)
    try:
        return file.read_bytes()
    except OSError as reason:
        raise error(f"cannot read {file}, which {path.name} names", reason.strerror or reason, AGAIN) from reason


def _index(number: Any) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or number < 0:
        raise ValueError("no index")
    return number

"""Decompresses glTF files: buffers packed by meshoptimizer, and meshes packed by Draco."""

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from hemline.errors import BadInput

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"

_KINDS = {np.dtype(kind): code for kind, code in (("u1", 5121), ("i1", 5120), ("u2", 5123), ("i2", 5122))}
_KINDS |= {np.dtype("u4"): 5125, np.dtype("f4"): 5126}
_BYTES_MAX = 2**28
"""Largest number of bytes that a file may have once it is decompressed."""
_RATIO_MAX = 256
"""Largest number of bytes that a byte of a compressed file may become."""
_CURE = "run: pip install 'hemline[compressed]', or export it without compression"


class _Budget:
    """Counts the bytes that a file becomes, and refuses more than one of its size can rightly hold."""

    def __init__(self, path: object, size: int, error: type[BadInput]):
        self.path, self.left, self.error = path, min(_BYTES_MAX, _RATIO_MAX * size + 100_000), error

    def take(self, count: int) -> None:
        """Raises if more than the rest of the budget is asked for."""
        self.left -= count
        if self.left < 0:
            what = f"{self.path} becomes too large when it is decompressed"
            raise self.error(what, f"more than {_BYTES_MAX} bytes, or {_RATIO_MAX} for each of its own", "reduce it")


def decompress(
    path: object, document: dict[str, Any], buffers: tuple[bytes, ...], error: type[BadInput]
) -> tuple[dict[str, Any], tuple[bytes, ...]]:
    """Returns the document and buffers of a glTF file with all that was compressed in further buffers of its own.

    Args:
        path: The file, for messages.
        document: Its document, which is not changed.
        buffers: Its buffers.
        error: Class of the exception.

    Raises:
        BadInput: (as `error`) What was compressed is damaged or far too large, or its decoder is not installed.
        KeyError, TypeError, IndexError, ValueError: The document is damaged.
    """
    used = document.get("extensionsUsed", [])
    packed = [name for name in (*MESHOPT, DRACO) if name in used or name in document.get("extensionsRequired", [])]
    if not packed:
        return document, buffers
    document, further = copy.deepcopy(document), list(buffers)
    budget = _Budget(path, sum(map(len, buffers)), error)
    for name in set(packed) - {DRACO}:
        _unpack_views(path, document, further, name, budget)
    if DRACO in packed:
        _unpack_meshes(path, document, further, budget)
    for key in ("extensionsUsed", "extensionsRequired"):
        document[key] = [name for name in document.get(key, []) if name not in packed]
    document["buffers"] = [{"byteLength": len(each)} for each in further]
    return document, tuple(further)


def is_fallback(entry: dict[str, Any]) -> bool:
    """Whether a buffer of a file is only for programs that cannot decompress it, and may be absent."""
    extensions = entry.get("extensions", {})
    return any(name in extensions for name in MESHOPT)


def _unpack_views(path: object, document: dict, buffers: list[bytes], name: str, budget: _Budget) -> None:
    """Decodes the views that meshoptimizer packed."""
    for view in document.get("bufferViews", []):
        packed = view.get("extensions", {}).pop(name, None)
        if packed is None:
            continue
        count, stride, start = (int(packed[key]) for key in ("count", "byteStride", "byteLength"))
        offset, length = int(packed.get("byteOffset", 0)), start
        if min(count, stride, offset, length) < 0 or offset + length > len(buffers[packed["buffer"]]):
            raise ValueError("outside of its buffer")
        budget.take(count * stride)
        try:
            import meshopt
        except ImportError as reason:
            raise budget.error(f"{path} is compressed", name, _CURE) from reason
        content = buffers[packed["buffer"]][offset : offset + length]
        mode, way = packed["mode"], packed.get("filter", "NONE")
        try:
            rows = meshopt.decode_gltf_buffer(content, count, stride, mode, None if way == "NONE" else way)
        except (ValueError, RuntimeError) as reason:
            got = f"a part of {length} bytes that cannot be decoded"
            raise budget.error(f"{path} is damaged", got, "export it again, as GLB") from reason
        _put(view, buffers, np.ascontiguousarray(rows).tobytes())
        if mode == "ATTRIBUTES":
            view["byteStride"] = stride


def _unpack_meshes(path: object, document: dict, buffers: list[bytes], budget: _Budget) -> None:
    """Decodes the primitives that Draco packed."""
    for primitive in _primitives_to_unpack(document):
        packed = primitive["extensions"].pop(DRACO)
        try:
            import DracoPy
        except ImportError as reason:
            raise budget.error(f"{path} is compressed", DRACO, _CURE) from reason
        view, accessors = document["bufferViews"][packed["bufferView"]], document["accessors"]
        start = int(view.get("byteOffset", 0))
        content = buffers[view["buffer"]][start : start + int(view["byteLength"])]
        wanted = [*primitive["attributes"].values(), *([primitive["indices"]] if "indices" in primitive else [])]
        budget.take(sum(16 * int(accessors[each]["count"]) for each in wanted))
        try:
            mesh = DracoPy.decode(bytes(content))
        except Exception as reason:  # its binding raises RuntimeError, ValueError and classes of its own
            got = f"a mesh of {len(content)} bytes that cannot be decoded"
            raise budget.error(f"{path} is damaged", got, "export it again, as GLB") from reason
        by_id = {each["unique_id"]: each["data"] for each in mesh.attributes}
        for attribute, number in packed["attributes"].items():
            if attribute in primitive["attributes"]:
                _replace(document, buffers, primitive["attributes"][attribute], by_id[number])
        if "indices" in primitive:
            faces = np.ascontiguousarray(mesh.faces, np.uint32).reshape(-1)
            _replace(document, buffers, primitive["indices"], faces)
            primitive["mode"] = 4


def _primitives_to_unpack(document: dict) -> Iterator[dict]:
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            if DRACO in primitive.get("extensions", {}):
                yield primitive


def _replace(document: dict, buffers: list[bytes], number: int, rows: np.ndarray) -> None:
    """Lets an accessor name decoded rows; integers that stand for fractions stay so."""
    accessor = document["accessors"][number]
    kind = rows.dtype if rows.dtype in _KINDS else np.dtype("f4")
    if kind.itemsize < 4 and rows.ndim == 2 and (kind.itemsize * rows.shape[1]) % 4:
        kind = np.dtype("f4") if kind.kind == "i" else np.dtype("u4")
    rows = np.ascontiguousarray(rows, kind)
    accessor |= {"componentType": _KINDS[kind], "count": len(rows), "byteOffset": 0}
    if kind.kind == "f":
        accessor.pop("normalized", None)
    accessor["bufferView"] = len(document["bufferViews"])
    view: dict[str, Any] = {}
    _put(view, buffers, rows.tobytes())
    document["bufferViews"].append(view)


def _put(view: dict, buffers: list[bytes], content: bytes) -> None:
    """Puts content into a buffer of its own, which a view then names."""
    view |= {"buffer": len(buffers), "byteOffset": 0, "byteLength": len(content)}
    view.pop("byteStride", None)
    buffers.append(content)

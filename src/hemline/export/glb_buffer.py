"""The one binary buffer of a GLB file, and the accessors that point into it."""

import numpy as np

from hemline.arrays import Faces

_COMPONENTS = {np.dtype(np.float32): 5126, np.dtype(np.uint32): 5125, np.dtype(np.uint16): 5123}
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963


class Buffer:
    """Arrays one after another, each with its own view and accessor."""

    def __init__(self) -> None:
        self._chunks: list[bytes] = []
        self._views: list[dict] = []
        self._accessors: list[dict] = []
        self._length = 0

    def add(self, array: np.ndarray, kind: str, *, bounds: bool = False, target: int | None = None) -> int:
        """Append an array; returns the index of its accessor.

        Args:
            array: float32, or unsigned integers; rows are elements.
            kind: `SCALAR`, `VEC3`, `VEC4` or `MAT4` (column by column).
            bounds: Store minimum and maximum, as positions and times must.
            target: What the array is bound to, where it is an attribute or indices.
        """
        array = np.ascontiguousarray(array)
        content = array.tobytes()
        view = {"buffer": 0, "byteOffset": self._length, "byteLength": len(content)}
        accessor = {"bufferView": len(self._views), "componentType": _COMPONENTS[array.dtype], "type": kind}
        accessor["count"] = len(array)
        if target is not None:
            view["target"] = target
        if bounds:
            rows = array.reshape(len(array), -1).astype(np.float64)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self._views.append(view)
        self._accessors.append(accessor)
        content += b"\0" * (-len(content) % 4)
        self._chunks.append(content)
        self._length += len(content)
        return len(self._accessors) - 1

    def add_attribute(self, array: np.ndarray, kind: str, *, bounds: bool = False) -> int:
        """Append an array with one row a vertex."""
        return self.add(array, kind, bounds=bounds, target=_ARRAY_BUFFER)

    def add_indices(self, faces: Faces) -> int:
        """Append triangles."""
        return self.add(np.asarray(faces).astype(np.uint32).ravel(), "SCALAR", target=_ELEMENT_ARRAY_BUFFER)

    def content(self) -> bytes:
        """All bytes, a multiple of four."""
        return b"".join(self._chunks)

    def described(self) -> dict:
        """The document's entries about buffers."""
        return {"buffers": [{"byteLength": self._length}], "bufferViews": self._views, "accessors": self._accessors}

"""The binary buffer of a GLB file, and the accessors that point into it."""

import numpy as np

from hemline.arrays import Faces

_COMPONENTS = {"f4": 5126, "u4": 5125, "u2": 5123, "i2": 5122, "u1": 5121, "i1": 5120}
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963


class Buffer:
    """Arrays one after another, each with its own view and accessor."""

    def __init__(self) -> None:
        self._chunks: list[bytes] = []
        self._views: list[dict] = []
        self._accessors: list[dict] = []
        self._length = 0

    def add(
        self, array: np.ndarray, kind: str, *, bounds: bool = False, target: int | None = None, normalized: bool = False
    ) -> int:
        """Appends an array; returns the index of its accessor.

        Args:
            array: float32, or whole numbers of one, two or four bytes; rows are elements.
            kind: `SCALAR`, `VEC2`, `VEC3`, `VEC4` or `MAT4` (column by column).
            bounds: Whether to store minimum and maximum, as positions and times require.
            target: Binding target of attributes and indices. Rows of attributes start at multiples of four bytes.
            normalized: Whether whole numbers stand for fractions of the largest number of their type.
        """
        array = np.ascontiguousarray(array)
        view = {"buffer": 0, "byteOffset": self._length}
        accessor = {"bufferView": len(self._views), "componentType": _COMPONENTS[array.dtype.str[1:]], "type": kind}
        accessor["count"] = len(array)
        if normalized:
            accessor["normalized"] = True
        if bounds:
            rows = array.reshape(len(array), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        if target is not None:
            view["target"] = target
        if target == _ARRAY_BUFFER and (spare := -array.strides[0] % 4):
            array = np.pad(array, ((0, 0), (0, spare // array.itemsize)))
            view["byteStride"] = array.strides[0]
        content = array.tobytes()
        self._views.append(view | {"byteLength": len(content)})
        self._accessors.append(accessor)
        content += b"\0" * (-len(content) % 4)
        self._chunks.append(content)
        self._length += len(content)
        return len(self._accessors) - 1

    def add_attribute(self, array: np.ndarray, kind: str, *, bounds: bool = False) -> int:
        """Appends an array with one row per vertex; whole numbers are normalised."""
        return self.add(array, kind, bounds=bounds, target=_ARRAY_BUFFER, normalized=array.dtype.kind != "f")

    def add_numbers(self, array: np.ndarray, kind: str) -> int:
        """Appends whole numbers that are not normalised, one row per vertex."""
        return self.add(array, kind, target=_ARRAY_BUFFER)

    def add_indices(self, faces: Faces) -> int:
        """Appends triangles; indices have two bytes where that is enough."""
        numbers = np.asarray(faces).ravel()
        small = numbers.max() < 0xFFFF
        return self.add(numbers.astype(np.uint16 if small else np.uint32), "SCALAR", target=_ELEMENT_ARRAY_BUFFER)

    def content(self) -> bytes:
        """Returns all bytes, a multiple of four."""
        return b"".join(self._chunks)

    def entries(self) -> dict:
        """Returns the entries of the document about buffers."""
        return {"buffers": [{"byteLength": self._length}], "bufferViews": self._views, "accessors": self._accessors}

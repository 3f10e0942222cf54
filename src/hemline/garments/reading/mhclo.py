"""Reads clothes files of MakeHuman (`.mhclo`), which bind each vertex of a mesh to vertices of a base mesh."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.errors import BadGarment
from hemline.files import read_text
from hemline.files.beside import beside

BASE_MESH = "hm08"
"""Base mesh that clothes must be bound to."""

_CURE = "export it again from MakeHuman or MPFB"
_AXES = ("x_scale", "y_scale", "z_scale")
_SHEARS = tuple(f"{side}shear_{axis}" for side in ("", "l_", "r_") for axis in "xyz")
_COLUMNS = (1, 6, 9)
_BYTES_MAX = 2**25
_LARGEST = 1e6
"""Limit of all numbers in clothes: weights are about one, offsets are decimetres."""


@dataclass(frozen=True, eq=False)
class BoundClothes:
    """Clothes as an `.mhclo` binds them: x_i = sum_k w_ik b_ik + s d_i, with a scale s for each axis."""

    name: str
    """Name in the file, or else its stem."""
    mesh: Path
    """The OBJ beside the file, which has the faces."""
    corners: Int[np.ndarray, "verts 3"]
    """Three vertices b of the base mesh that each vertex is bound to."""
    weights: Float[np.ndarray, "verts 3"]
    """Weights w of these vertices, with sum 1."""
    offsets: Float[np.ndarray, "verts 3"]
    """Offset d of each vertex in the unit of the file, decimetres on the body that the clothes were made on."""
    spans: Int[np.ndarray, "axes 2"]
    """For each axis the two vertices of the base mesh whose distance along it scales the offsets."""
    lengths: Float[np.ndarray, " axes"]
    """Distance of these two vertices on the body that the clothes were made on, in the unit of the file."""
    notes: tuple[str, ...] = ()
    """What was assumed, one sentence each."""

    def on(self, base: Vertices) -> Vertices:
        """Returns the vertices of the clothes on a base mesh of any shape, in the unit of that mesh, float64.

        Args:
            base: All vertices of the base mesh.

        Source: the team of MakeHuman, "MakeHuman", 2020, version 1.2, `shared/proxy.py` (`Proxy.getCoords`, `TMatrix`).
        """
        spans = np.abs(base[self.spans[:, 0], range(3)] - base[self.spans[:, 1], range(3)])
        return np.einsum("vk,vkx->vx", self.weights, base[self.corners]) + spans / self.lengths * self.offsets


def read_mhclo(path: str | Path, base_count: int) -> BoundClothes:
    """Reads the bindings of an `.mhclo` file; materials, hidden vertices and the like are skipped.

    Args:
        path: The file.
        base_count: Number of vertices of the base mesh.

    Raises:
        BadGarment: The file is missing, empty or of another kind; it is bound to another base mesh, or to vertices
            that it does not have; a line cannot be parsed; a weight, offset or scale is impossible; or the file does
            not name an OBJ beside it.
    """
    path = Path(path)
    entries, rows = _sections(path)
    base = entries.get("basemesh", [BASE_MESH])
    if base != [BASE_MESH]:
        cure = f"bind the clothes to {BASE_MESH}, or export them as a mesh on the body"
        raise BadGarment(f"{path} must be bound to the base mesh {BASE_MESH}", f"'{' '.join(base)[:60]}'", cure)
    if sheared := [key for key in _SHEARS if key in entries]:
        raise BadGarment(f"{path} must not shear its offsets", sheared[0], "bind the clothes with scales alone")
    if len(entries.get("obj_file", ())) != 1:
        raise BadGarment(f"{path} must name its mesh", "no file after 'obj_file'", "add: obj_file FILE.obj")
    obj = entries["obj_file"][0]
    cure = "put the OBJ into the folder of the clothes file, or below"
    mesh = beside(path, obj, "a mesh", error=BadGarment, cure=cure)
    if mesh.suffix.lower() != ".obj":
        raise BadGarment(f"{path} must name an OBJ", f"'{obj[:60]}'", "add: obj_file FILE.obj")
    corners, weights, offsets = _bindings(path, rows, base_count)
    spans, lengths = _scales(path, entries, base_count)
    notes = () if "basemesh" in entries else (f"base mesh: {BASE_MESH}, as none was named",)
    return BoundClothes(
        name=" ".join(entries.get("name", ())) or path.stem,
        mesh=mesh,
        corners=corners,
        weights=weights,
        offsets=offsets,
        spans=spans,
        lengths=lengths,
        notes=notes,
    )


def _sections(path: Path) -> tuple[dict[str, list[str]], list[tuple[int, list[str]]]]:
    """Returns the words after each key that comes before the bindings, and the numbered lines of the bindings."""
    cure = "name an .mhclo file that exists"
    try:
        text = read_text(path, _BYTES_MAX, error=BadGarment, cure=cure, encoding="utf-8-sig", strict=True)
    except UnicodeDecodeError as error:
        raise BadGarment(f"{path} is no clothes file", "bytes that are no text", _CURE) from error
    lines = text.splitlines()
    entries: dict[str, list[str]] = {}
    numbered = iter([(number, line.split()) for number, line in enumerate(lines, 1) if line.split("#", 1)[0].strip()])
    for _, words in numbered:
        if words[0] == "verts":
            return entries, list(_rows(numbered))
        entries[words[0]] = words[1:]
    got = f"{len(lines)} lines without a line 'verts'" if entries else "nothing in it"
    raise BadGarment(f"{path} is no clothes file", got, _CURE)


def _rows(numbered: Iterator[tuple[int, list[str]]]) -> Iterator[tuple[int, list[str]]]:
    """Yields lines up to the next key."""
    for number, words in numbered:
        if words[0][0].isalpha() and words[0].lower() not in ("nan", "inf"):
            return
        yield number, words


def _bindings(path: Path, rows: list[tuple[int, list[str]]], base_count: int) -> tuple[np.ndarray, ...]:
    table = np.zeros((len(rows), 9))
    table[:, 3] = 1
    for row, (number, words) in enumerate(rows):
        if len(words) not in _COLUMNS:
            what = f"{path}, line {number}: a binding must be a vertex, or three, three weights and an offset"
            raise BadGarment(what, f"{len(words)} columns", _CURE)
        try:
            table[row, : len(words)] = [int(word) for word in words[:3]] + [float(word) for word in words[3:]]
        except (ValueError, OverflowError) as error:  # a whole number may have hundreds of digits
            raise BadGarment(f"{path}, line {number} cannot be read", f"'{' '.join(words)[:60]}'", _CURE) from error
    what = f"weights and offsets must be finite, below {_LARGEST:g}"
    odd = ~(np.abs(table[:, 3:]) < _LARGEST)  # also of NaN
    _refuse(path, rows, np.any(odd, axis=1), what, "NaN, infinity or more")
    beyond = (table[:, :3] < 0) | (table[:, :3] >= base_count)
    got = f"vertex {int(table[:, :3][beyond][0])}" if beyond.any() else ""
    _refuse(path, rows, np.any(beyond, axis=1), f"{BASE_MESH} has the vertices 0 to {base_count - 1}", got)
    off = np.abs(table[:, 3:6].sum(axis=1) - 1)
    _refuse(path, rows, off > 0.01, "weights must sum to 1", f"{off.max(initial=0):.3g} more or less")
    return table[:, :3].astype(np.int32), table[:, 3:6], table[:, 6:]


def _refuse(path: Path, rows: list[tuple[int, list[str]]], bad: np.ndarray, what: str, got: str) -> None:
    if bad.any():
        raise BadGarment(f"{path}, line {rows[int(bad.argmax())][0]}: {what}", got, _CURE)


def _scales(path: Path, entries: dict[str, list[str]], base_count: int) -> tuple[np.ndarray, np.ndarray]:
    spans, lengths = np.zeros((3, 2), np.int32), np.zeros(3)
    for axis, key in enumerate(_AXES):
        words = entries.get(key, [])
        try:
            first, second, length = int(words[0]), int(words[1]), float(words[2])
            good = len(words) == 3 and min(first, second) >= 0 and max(first, second) < base_count and 0 < length < 1e3
        except (IndexError, ValueError):
            good = False
        if not good:
            what = f"{path}: '{key}' must be two vertices of {BASE_MESH} and their distance"
            raise BadGarment(what, f"'{' '.join(words)[:60]}'", _CURE)
        spans[axis], lengths[axis] = (first, second), length
    return spans, lengths

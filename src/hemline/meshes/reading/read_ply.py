"""Reads PLY files, as text and binary, with polygons of any size."""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.errors import BadMesh
from hemline.files.reading import TEXT_MAX, read_bytes

from .mesh import ReadMesh
from .polygons import cut_polygons

_KINDS = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_LETTERS = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_FACE_LISTS = ("vertex_indices", "vertex_index")
_COLOURS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
_CURE = "export it again, or as .obj"
_PROPERTIES_MAX = 200


@dataclass(eq=False)
class _Property:
    """A property of an element: a number, or a list of numbers."""

    name: str
    kind: str
    count_kind: str | None = None
    """Kind of the number before a list; None for a single number."""


@dataclass(eq=False)
class _Element:
    """A kind of element, such as vertices."""

    name: str
    count: int
    properties: list[_Property]


def read_ply(path: str | Path) -> ReadMesh:
    """Reads all vertices and faces of a PLY file as one mesh; polygons are cut into triangles, and a note says so.

    Colours of vertices are read. Other numbers of vertices become marks: vertices where they are above one half.

    Args:
        path: The file.

    Returns:
        The mesh, in the unit of the file.

    Raises:
        BadMesh: The file is missing, too large, damaged or without triangles.
    """
    path = Path(path)
    content = read_bytes(path, TEXT_MAX, error=BadMesh, cure="name a mesh file that exists")
    try:
        order, elements, start = _header(content)
        read = _ascii(content[start:], elements) if not order else _binary(content, start, elements, order)
        columns, lists = read
        vertices = np.stack([columns["vertex"][axis] for axis in "xyz"], axis=1).astype(np.float64)
        corners, sizes = next(
            (lists["face"][name] for name in _FACE_LISTS if name in lists.get("face", {})), (None, None)
        )
    except (KeyError, IndexError, ValueError, OverflowError, UnicodeDecodeError, struct.error, MemoryError) as error:
        got = "a damaged file, or one of another format" if content else "an empty file"
        raise BadMesh(f"{path} cannot be read as .ply", got, _CURE) from error
    if corners is None or sizes is None or not (sizes >= 3).any():
        raise BadMesh(f"{path} must have triangles", "none", "export the mesh again with faces")
    if (sizes < 3).any():
        corners = corners[np.repeat(sizes >= 3, sizes)]
        sizes = sizes[sizes >= 3]
    if corners.min() < 0 or corners.max() >= len(vertices):
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise BadMesh(f"{path}: a face names vertex {wrong}", f"{len(vertices)} vertices", "export the mesh again")
    cut = int((sizes > 3).sum())
    notes = (f"{cut} polygons of more than three corners were cut into triangles",) if cut else ()
    faces = corners[cut_polygons(vertices, corners, sizes)]
    colours, marks = _attributes(columns["vertex"])
    return ReadMesh(vertices, np.ascontiguousarray(faces, np.int32), colours=colours, marks=marks, notes=notes)


def _header(content: bytes) -> tuple[str, list[_Element], int]:
    """Returns the byte order (empty for text), the elements, and where they begin."""
    end = content.find(b"end_header")
    if not content.startswith(b"ply") or not 0 < end < 100_000:
        raise ValueError("header")
    start = content.index(b"\n", end) + 1 if b"\n" in content[end : end + 12] else end + len(b"end_header\r")
    order, elements = None, []
    for line in content[:end].decode("latin-1").replace("\r", "\n").split("\n"):
        words = line.split()
        if words[:1] == ["format"]:
            order = _ORDERS[words[1]]
        elif words[:1] == ["element"]:
            elements.append(_Element(words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            listed = words[1] == "list"
            kinds = [_KINDS[word] for word in (words[2:4] if listed else words[1:2])]
            elements[-1].properties.append(_Property(words[-1], kinds[-1], kinds[0] if listed else None))
            if len(elements[-1].properties) > _PROPERTIES_MAX:
                raise ValueError("properties")
    if order is None or any(not 0 <= element.count <= len(content) for element in elements):
        raise ValueError("header")
    return order, elements, start


def _ascii(content: bytes, elements: list[_Element]) -> tuple[dict, dict]:
    """Returns the columns of numbers, and the lists, of each element of a text."""
    lines = [line for line in content.decode("latin-1").replace("\r", "\n").split("\n") if line.strip()]
    columns: dict[str, dict[str, np.ndarray]] = {}
    lists: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    first = 0
    for element in elements:
        rows = [line.split() for line in lines[first : first + element.count]]
        first += element.count
        if len(rows) < element.count:
            raise ValueError("cut off")
        if all(each.count_kind is None for each in element.properties):
            table = np.array([row[: len(element.properties)] for row in rows], np.float64)
            table = table.reshape(len(rows), len(element.properties))
            columns[element.name] = {each.name: table[:, k] for k, each in enumerate(element.properties)}
            continue
        found: dict[str, list[list[float]]] = {each.name: [] for each in element.properties if each.count_kind}
        for row in rows:
            at = 0
            for each in element.properties:
                if each.count_kind is None:
                    at += 1
                    continue
                count = int(row[at])
                if count < 0 or at + 1 + count > len(row):
                    raise ValueError("list")
                found[each.name].append([float(word) for word in row[at + 1 : at + 1 + count]])
                at += 1 + count
        lists[element.name] = {name: _flat(each) for name, each in found.items()}
    return columns, lists


def _binary(content: bytes, at: int, elements: list[_Element], order: str) -> tuple[dict, dict]:
    """Returns the columns of numbers, and the lists, of each element of a binary file."""
    columns: dict[str, dict[str, np.ndarray]] = {}
    lists: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    for element in elements:
        if all(each.count_kind is None for each in element.properties):
            kind = np.dtype([(f"{k}", order + each.kind) for k, each in enumerate(element.properties)])
            table = np.frombuffer(content, kind, element.count, at) if element.count else np.zeros(0, kind)
            columns[element.name] = {
                each.name: table[f"{k}"].astype(np.float64) for k, each in enumerate(element.properties)
            }
            at += element.count * kind.itemsize
            continue
        found: dict[str, list] = {each.name: [] for each in element.properties if each.count_kind}
        for _ in range(element.count):
            for each in element.properties:
                if each.count_kind is None:
                    at += np.dtype(each.kind).itemsize
                    continue
                (count,) = struct.unpack_from(order + _LETTERS[each.count_kind], content, at)
                at += np.dtype(each.count_kind).itemsize
                size = np.dtype(each.kind).itemsize
                if not 0 <= count <= (len(content) - at) // size:
                    raise ValueError("list")
                found[each.name].append(struct.unpack_from(f"{order}{count}{_LETTERS[each.kind]}", content, at))
                at += count * size
        lists[element.name] = {name: _flat(each) for name, each in found.items()}
        if at > len(content):
            raise ValueError("cut off")
    return columns, lists


def _flat(rows: list) -> tuple[np.ndarray, np.ndarray]:
    """Returns the numbers of lists one after another, and the length of each."""
    sizes = np.array([len(row) for row in rows], np.int64)
    return np.array([number for row in rows for number in row], np.int64), sizes


def _attributes(columns: dict[str, np.ndarray]) -> tuple[np.ndarray | None, dict[str, np.ndarray]]:
    """Returns colours from 0 to 1, and which vertices each other number marks."""
    colours = None
    for names in _COLOURS:
        if all(name in columns for name in names):
            colours = np.stack([columns[name] for name in names], axis=1)
            colours = np.clip(np.nan_to_num(colours) / (255.0 if colours.max(initial=0) > 1 else 1.0), 0, 1)
            break
    known = {
        "x",
        "y",
        "z",
        "nx",
        "ny",
        "nz",
        "s",
        "t",
        "u",
        "v",
        "alpha",
        *(name for each in _COLOURS for name in each),
    }
    return colours, {name.strip("_").lower(): each > 0.5 for name, each in columns.items() if name not in known}

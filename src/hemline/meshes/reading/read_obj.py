"""Reads Wavefront OBJ without changing vertex ids or their order."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hemline.errors import BadMesh
from hemline.files.reading import TEXT_MAX, read_text

from .mesh import ReadMesh
from .polygons import cut_polygons

_CURE = "export the mesh again as OBJ with triangles"
_NAMES = {"o": 0, "g": 1, "usemtl": 2}
_COMMA = re.compile(r"(?<=\d),(?=\d)")
_LABELS_MAX = 100_000


class _OddLine(ValueError):
    """A line that is wrong; the text says what is wrong with it."""


@dataclass(eq=False)
class _Lines:
    """What the lines of a file say."""

    points: list[tuple[float, ...]] = field(default_factory=list)
    """Positions, with a colour behind those that have one."""
    texture: list[tuple[float, float]] = field(default_factory=list)
    """Texture coordinates."""
    corners: list[tuple[int, int]] = field(default_factory=list)
    """Vertex and texture coordinate of the corners of all polygons."""
    sizes: list[int] = field(default_factory=list)
    """Number of corners of each polygon."""
    labels: dict[tuple[str, ...], int] = field(default_factory=dict)
    """Object, group and material of polygons, by number."""
    owners: list[int] = field(default_factory=list)
    """Number of the label of each polygon."""


def read_obj(path: str | Path) -> ReadMesh:
    """Reads all vertices and faces of an OBJ file as one mesh.

    `v` lines become vertices in their order, used or not, with the colour behind a position; `vt` lines become the
    pattern; negative indices count from the last line so far; polygons are cut into triangles, and a note says so;
    objects, groups and materials become labels; normals, lines and smoothing are skipped. Weights behind a position
    are ignored. Decimal commas are read as points.

    Args:
        path: The file.

    Returns:
        The mesh, in the unit of the file.

    Raises:
        BadMesh: The file is missing or too large, has no vertices or no faces, or a line that cannot be read.
    """
    path = Path(path)
    cure = "name an OBJ file that exists"
    text = read_text(path, TEXT_MAX, error=BadMesh, cure=cure, encoding="utf-8", strict=False)
    lines = text.replace("\\\n", " ").splitlines()
    notes: tuple[str, ...] = ()
    commas = next((line for line in lines if line.startswith("v ")), "")
    if _COMMA.search(commas):
        lines = [_COMMA.sub(".", line) if line[:1] == "v" else line for line in lines]
        notes += ("decimal commas were read as points",)
    found = _parse(lines, path)
    if not found.points:
        raise BadMesh(f"{path} must have vertices", "no line 'v'", _CURE)
    if not found.sizes:
        raise BadMesh(f"{path} must have faces", "no line 'f'", _CURE)
    corners, sizes = np.array(found.corners, np.int64).reshape(-1, 2), np.array(found.sizes)
    vertices = np.array([point[:3] for point in found.points], np.float64)
    _check_range(corners[:, 0], sizes, len(vertices), "vertex", path)
    rows = cut_polygons(vertices, corners[:, 0], sizes)
    if (sizes > 3).any():
        notes += (f"{int((sizes > 3).sum())} polygons of more than three corners were cut into triangles",)
    faces = corners[rows]
    owner = np.repeat(np.array(found.owners), sizes - 2)
    mesh = ReadMesh(
        vertices,
        np.ascontiguousarray(faces[..., 0], np.int32),
        labels=tuple(found.labels),
        face_labels=owner if any(any(label) for label in found.labels) else None,
        colours=_colours(found.points),
        notes=notes,
    )
    if not found.texture or (faces[..., 1] < 0).any():
        partial = ("texture coordinates were dropped: some corners have none",) if found.texture else ()
        return replace(mesh, notes=mesh.notes + partial)
    _check_range(corners[:, 1], sizes, len(found.texture), "texture coordinate", path)
    pattern_faces = np.ascontiguousarray(faces[..., 1], np.int32)
    return replace(mesh, pattern=np.array(found.texture, np.float64), pattern_faces=pattern_faces)


def _parse(lines: list[str], path: Path) -> _Lines:
    found, label = _Lines(), ("", "", "")
    points, texture, corners, sizes, owners = found.points, found.texture, found.corners, found.sizes, found.owners
    number_of_label = found.labels.setdefault(label, 0)
    for number, line in enumerate(lines, 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        try:
            if words[0] == "v":
                if len(words) >= 7:
                    points.append(tuple(map(float, words[1:7])))
                else:
                    points.append((float(words[1]), float(words[2]), float(words[3])))
            elif words[0] == "vt":
                texture.append((float(words[1]), float(words[2]) if len(words) > 2 else 0.0))
            elif words[0] == "f":
                if len(words) < 4:
                    raise _OddLine("a face with fewer than three corners")
                corners += [_corner(word, len(points), len(texture)) for word in words[1:]]
                sizes.append(len(words) - 1)
                owners.append(number_of_label)
            elif words[0] in _NAMES and len(found.labels) < _LABELS_MAX:
                name = " ".join(line.split()[1:])
                label = tuple(name if _NAMES[words[0]] == row else each for row, each in enumerate(label))
                number_of_label = found.labels.setdefault(label, len(found.labels))
        except (ValueError, IndexError) as error:
            got = f"'{line.strip()[:60]}'" + (f" ({error})" if isinstance(error, _OddLine) else "")
            raise BadMesh(f"{path}, line {number} cannot be read", got, _CURE) from error
    return found


def _corner(word: str, points: int, texture: int) -> tuple[int, int]:
    parts = word.split("/")
    return _absolute(int(parts[0]), points), _absolute(int(parts[1]), texture) if len(parts) > 1 and parts[1] else -1


def _absolute(index: int, count: int) -> int:
    if index == 0 or not -count <= index < 2**31:
        raise _OddLine("OBJ counts from 1, or back from -1")
    return index - 1 if index > 0 else count + index


def _colours(points: list[tuple[float, ...]]) -> np.ndarray | None:
    """Returns the colours behind the positions, 0 to 1, if all positions have one."""
    if min(map(len, points)) < 6:
        return None
    colours = np.array([point[3:6] for point in points], np.float64)
    if not np.isfinite(colours).all():
        return None
    return np.clip(colours / (255.0 if colours.max() > 1 else 1.0), 0, 1)


def _check_range(indices: np.ndarray, sizes: np.ndarray, count: int, what: str, path: Path) -> None:
    if indices.size and indices.max() >= count:
        face = int(np.searchsorted(np.cumsum(sizes), int(np.argmax(indices >= count)), side="right"))
        raise BadMesh(
            f"{path}: face {face} names {what} {indices.max() + 1}", f"{count} in the file", "export the mesh again"
        )

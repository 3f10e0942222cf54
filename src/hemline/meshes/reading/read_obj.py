"""Reads Wavefront OBJ without changing vertex ids or their order."""

from pathlib import Path

import numpy as np

from hemline.errors import BadMesh
from hemline.files.reading import TEXT_MAX, read_text

from .mesh import ReadMesh

_CURE = "export the mesh again as OBJ with triangles"


class _OddLine(ValueError):
    """A line that is wrong; the text says what is wrong with it."""


def read_obj(path: str | Path) -> ReadMesh:
    """Reads all vertices and faces of an OBJ file as one mesh.

    `v` lines become vertices in their order, used or not; `vt` lines become the pattern; negative indices count from
    the last line so far; polygons are cut into fans, and a note says so; groups, objects, materials, normals,
    lines and smoothing are skipped. Weights and colours behind a position are ignored.

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
    points, texture, corners, sizes = _parse(lines, path)
    if not points:
        raise BadMesh(f"{path} must have vertices", "no line 'v'", _CURE)
    if not sizes:
        raise BadMesh(f"{path} must have faces", "no line 'f'", _CURE)
    faces, cut = _fans(np.array(corners, np.int64).reshape(-1, 2), np.array(sizes))
    notes = (f"{cut} polygons of more than three corners were cut into triangles",) if cut else ()
    vertices = np.array(points, np.float64)
    triangles = _in_range(faces[..., 0], len(points), "vertex", path)
    if not texture or (faces[..., 1] < 0).any():
        partial = ("texture coordinates were dropped: some corners have none",) if texture else ()
        return ReadMesh(vertices, triangles, notes=notes + partial)
    pattern_faces = _in_range(faces[..., 1], len(texture), "texture coordinate", path)
    return ReadMesh(vertices, triangles, np.array(texture, np.float64), pattern_faces, notes)


def _parse(lines: list[str], path: Path) -> tuple[list, list, list[tuple[int, int]], list[int]]:
    points: list[tuple[float, float, float]] = []
    texture: list[tuple[float, float]] = []
    corners: list[tuple[int, int]] = []
    sizes: list[int] = []
    for number, line in enumerate(lines, 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        try:
            if words[0] == "v":
                points.append((float(words[1]), float(words[2]), float(words[3])))
            elif words[0] == "vt":
                texture.append((float(words[1]), float(words[2]) if len(words) > 2 else 0.0))
            elif words[0] == "f":
                if len(words) < 4:
                    raise _OddLine("a face with fewer than three corners")
                corners += [_corner(word, len(points), len(texture)) for word in words[1:]]
                sizes.append(len(words) - 1)
        except (ValueError, IndexError) as error:
            got = f"'{line.strip()[:60]}'" + (f" ({error})" if isinstance(error, _OddLine) else "")
            raise BadMesh(f"{path}, line {number} cannot be read", got, _CURE) from error
    return points, texture, corners, sizes


def _corner(word: str, points: int, texture: int) -> tuple[int, int]:
    parts = word.split("/")
    return _absolute(int(parts[0]), points), _absolute(int(parts[1]), texture) if len(parts) > 1 and parts[1] else -1


def _absolute(index: int, count: int) -> int:
    if index == 0 or not -count <= index < 2**31:
        raise _OddLine("OBJ counts from 1, or back from -1")
    return index - 1 if index > 0 else count + index


def _fans(corners: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, int]:
    """Cuts polygons into fans around their first corner; returns (faces, 3, 2) and the number of polygons cut."""
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    per_polygon = sizes - 2
    start = np.repeat(first, per_polygon)
    step = np.arange(len(start)) - np.repeat(np.cumsum(per_polygon) - per_polygon, per_polygon)
    return corners[np.stack([start, start + step + 1, start + step + 2], axis=1)], int((sizes > 3).sum())


def _in_range(indices: np.ndarray, count: int, what: str, path: Path) -> np.ndarray:
    if indices.size and indices.max() >= count:
        face = int(np.argmax((indices >= count).any(axis=1)))
        raise BadMesh(
            f"{path}: face {face} names {what} {indices.max() + 1}", f"{count} in the file", "export the mesh again"
        )
    return np.ascontiguousarray(indices, np.int32)

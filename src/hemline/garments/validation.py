"""Checks that the parts of a garment agree with each other."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hemline.arrays import Faces, Float, Vertices
from hemline.errors import BadGarment
from hemline.motions.motion import JOINT_NAMES

from .material import Material
from .pieces import Piece
from .pins import Pins


def validate_mesh(
    name: str, vertices: Vertices, faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]
) -> tuple[Vertices, Faces, Float[np.ndarray, "faces 2 2"]]:
    """Checks the mesh of a garment and returns vertices, faces and rest triangles, contiguous and in their own types.

    Raises:
        BadGarment: A wrong shape, NaN, an index that points nowhere, or a rest triangle without area.
    """
    vertices = _array(vertices, np.float32, (None, 3), f"{name}: vertices")
    faces = _array(faces, np.int32, (None, 3), f"{name}: faces")
    if len(faces) == 0:
        raise BadGarment(f"{name} must have faces", "none", "export the mesh again with faces")
    rest_edges = _array(rest_edges, np.float64, (len(faces), 2, 2), f"{name}: rest_edges")
    _within(faces, len(vertices), f"{name}: faces name a vertex", "vertices")
    flat = np.abs(rest_edges[:, 0, 0] * rest_edges[:, 1, 1] - rest_edges[:, 0, 1] * rest_edges[:, 1, 0]) <= 0
    if flat.any():
        raise BadGarment(
            f"{name}: rest triangles must have an area", f"none in face {int(flat.argmax())}", "check the pattern"
        )
    return vertices, faces, rest_edges


def validate_pins(name: str, pins: Pins, vertex_count: int) -> Pins:
    """Checks the pins of a garment and returns them, contiguous and in their own types.

    Raises:
        BadGarment: A wrong shape, NaN, an index that points nowhere, or a vertex pinned twice.
    """
    count = len(pins.vertices)
    pinned = Pins(
        _array(pins.vertices, np.int32, (None,), f"{name}: pin vertices"),
        _array(pins.body_faces, np.int32, (count,), f"{name}: pin body_faces"),
        _array(pins.barycentric, np.float32, (count, 3), f"{name}: pin barycentric"),
        _array(pins.heights, np.float32, (count,), f"{name}: pin heights"),
        _array(pins.joints, np.int32, (count,), f"{name}: pin joints"),
        _array(pins.offsets, np.float32, (count, 3), f"{name}: pin offsets"),
        _stiffness(pins.stiffness, count, f"{name}: pin stiffness"),
    )
    _within(pinned.vertices, vertex_count, f"{name}: pins name a vertex", "vertices")
    if len(np.unique(pinned.vertices)) != count:
        raise BadGarment(f"{name}: each vertex must be pinned once", "a vertex pinned twice", "name it once")
    if count and pinned.body_faces.min() < 0:
        raise BadGarment(f"{name}: pins name a body face", int(pinned.body_faces.min()), "count from 0")
    if count and not (pinned.joints.min() >= -1 and pinned.joints.max() < len(JOINT_NAMES)):
        worst = int(pinned.joints.min() if pinned.joints.min() < -1 else pinned.joints.max())
        raise BadGarment(f"{name}: pins name a joint that does not exist", worst, "use 0 to 23, or -1 for the surface")
    return pinned


def check_pieces(name: str, pieces: Sequence[Piece], material: Material, faces: Faces, vertex_count: int) -> None:
    """Checks the pieces of a garment.

    Raises:
        BadGarment: The pieces do not make up the mesh, share a triangle, or the innermost one is of another material
            than the garment.
    """
    if not pieces:
        return
    counts = [piece.vertex_count for piece in pieces]
    if min(counts) < 1 or sum(counts) != vertex_count:
        raise BadGarment(f"{name}: pieces must make up its {vertex_count} vertices", counts, "wear its parts together")
    owner = np.searchsorted(np.cumsum(counts), faces, side="right")
    if (owner != owner[:, :1]).any() or (np.diff(owner[:, 0]) < 0).any():
        raise BadGarment(f"{name}: faces must follow each other piece by piece", "mixed", "wear its parts together")
    if material != pieces[0].material:
        got = f"{material.name}, the innermost is {pieces[0].material.name}"
        raise BadGarment(
            f"{name}: material must be that of the innermost piece", got, "change the piece's own material"
        )


def check_chains(chains: Sequence[Sequence[int]], vertex_count: int, name: str) -> None:
    """Checks rope chains.

    Raises:
        BadGarment: A chain has fewer than two vertices, names a vertex that does not exist, or shares one with another.
    """
    used: set[int] = set()
    for number, chain in enumerate(chains):
        if len(chain) < 2:
            raise BadGarment(f"{name}: chain {number} must have at least two vertices", len(chain), "name root and tip")
        for vertex in chain:
            if not 0 <= vertex < vertex_count:
                got = f"vertex {vertex}; the mesh has {vertex_count} vertices"
                raise BadGarment(f"{name}: chain {number} names a vertex that does not exist", got, "count from 0")
            if vertex in used:
                raise BadGarment(f"{name}: chains must not share vertices", f"vertex {vertex} twice", "name it once")
            used.add(vertex)


def _array(value: Any, dtype: type, shape: tuple[int | None, ...], what: str) -> np.ndarray:
    array = np.asarray(value)
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = f"({', '.join('any' if each is None else str(each) for each in shape)})"
        raise BadGarment(f"{what} must have the shape {wanted}", array.shape, "make the garment again")
    if (array.dtype.kind not in "iu") if np.issubdtype(dtype, np.integer) else (array.dtype.kind not in "iuf"):
        raise BadGarment(
            f"{what} must be numbers of the kind {np.dtype(dtype).name}", array.dtype, "make the garment again"
        )
    if not np.isfinite(array).all():
        raise BadGarment(f"{what} must be finite", "NaN or infinity", "make the garment again")
    return np.ascontiguousarray(array, dtype)


def _stiffness(value: Any, count: int, what: str) -> np.ndarray:
    hard = np.isposinf(np.asarray(value, np.float64))
    soft = _array(np.where(hard, 1.0, value), np.float32, (count,), what)
    if (bad := np.flatnonzero(soft <= 0)).size:
        raise BadGarment(f"{what} must be positive", soft[bad[0]], "use infinity for a hard pin")
    return np.where(hard, np.float32(np.inf), soft)


def _within(indices: np.ndarray, count: int, what: str, of: str) -> None:
    if indices.size and (indices.min() < 0 or indices.max() >= count):
        worst = int(indices.min() if indices.min() < 0 else indices.max())
        raise BadGarment(f"{what} that does not exist", f"{worst}; the mesh has {count} {of}", "count from 0")

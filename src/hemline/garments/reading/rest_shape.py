"""Chooses the flat rest triangles of a garment that was read: from its pattern, or from the mesh itself."""

import numpy as np

from hemline.arrays import Faces, Float
from hemline.errors import BadGarment
from hemline.garments.rest_metric import rest_edges_of_mesh, rest_edges_of_pattern
from hemline.meshes import ReadMesh, edge_strains

from .units import UNITS

_PATTERN_OFF = 0.15
_PATTERN_UNITS = ("m", "dm", "cm", "mm", "in")
"""Units that programs write patterns in."""


def rest_shape(
    mesh: ReadMesh, scale: float, use_pattern: bool | None, name: str
) -> tuple[Float[np.ndarray, "faces 2 2"], bool, tuple[str, ...]]:
    """Chooses the flat rest triangles of a mesh.

    The pattern is taken if at least half of its edges are as long as those of the mesh, within 15 %: patterns are often
    exported before their seams are closed. Its unit is that of the mesh, or another one with which it fits.

    Args:
        mesh: The mesh [m]; its pattern is as in the file.
        scale: Length of a unit of the file [m].
        use_pattern: True: the pattern; False: the mesh; None: guess.
        name: Name of the garment in error messages.

    Returns:
        The triangles [m], whether they come from the pattern, and a note where that was guessed.

    Raises:
        BadGarment: The pattern is to be used, but there is none or it is not to scale.
    """
    of_mesh = rest_edges_of_mesh(mesh.vertices, mesh.faces)
    guessed = use_pattern is None
    if mesh.pattern is None or mesh.pattern_faces is None:
        if use_pattern:
            what, cure = f"{name}: 'pattern' asks for texture coordinates", "remove 'pattern', or export them"
            raise BadGarment(what, "a mesh without any", cure)
        return of_mesh, False, ("rest shape: the mesh itself, as it has no pattern",) * guessed
    if use_pattern is False:
        return of_mesh, False, ()
    flat = rest_edges_of_pattern(mesh.pattern, mesh.pattern_faces)
    degenerate = bool((np.linalg.det(flat) <= 0).any())
    least = np.inf
    for length in () if degenerate else (scale, *(UNITS[unit] for unit in _PATTERN_UNITS if UNITS[unit] != scale)):
        off = float(np.median(np.abs(edge_strains(mesh.vertices, mesh.faces, length * flat))))
        least = min(least, off)
        if off < _PATTERN_OFF:
            unit = next((unit for unit, each in UNITS.items() if each == length), "")
            other = "" if length == scale else f", in {unit}"
            note = f"rest shape: the pattern (vt{other}), as its edges are as long as the mesh's"
            return length * flat, True, (note,) * (guessed or length != scale)
    if use_pattern:
        got = "triangles without an area" if degenerate else f"edges that differ by {100 * least:.0f} % in the median"
        what = f"{name}: texture coordinates must be the pattern, in {', '.join(_PATTERN_UNITS)}"
        raise BadGarment(what, got, "set pattern = false")
    return of_mesh, False, ("rest shape: the mesh itself, as its texture coordinates (vt) are no pattern to scale",)


def rewind_rest_edges(
    rest_edges: Float[np.ndarray, "faces 2 2"], before: Faces, after: Faces
) -> Float[np.ndarray, "faces 2 2"]:
    """Returns flat triangles for faces whose second and third corners were swapped in part, with positive areas.

    Args:
        rest_edges: Flat triangles of the faces `before`.
        before: Triangles.
        after: The same triangles, some of them turned over.
    """
    swapped = (before != after).any(axis=1)
    result = rest_edges.copy()
    result[swapped] = rest_edges[swapped][:, :, ::-1]
    result[swapped, 1] *= -1
    return result

"""Garments cut as a grid of rows and columns: their size and their pinned upper rows."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.errors import BadGarment
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.garments.pins import Pins
from hemline.garments.rest_metric import rest_edges_of_mesh
from hemline.meshes import ClosestTree

from .sector import grid_size

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

PINNED_ROWS = 2
"""Number of rows at the top that follow the skin."""


def rows_and_columns(
    kind: str, vertex_count: int, rows: int | None, columns: int | None, *, aspect: float, least: tuple[int, int]
) -> tuple[int, int]:
    """Returns rows and columns of a grid, from its size or from its number of vertices.

    Args:
        kind: Kind of garment in error messages.
        vertex_count: Number of vertices wanted; the nearest grid is taken.
        rows: Number of rows; with `columns` in place of `vertex_count`.
        columns: Number of columns.
        aspect: Columns divided by rows, about.
        least: Least number of rows and columns.

    Raises:
        BadGarment: Only one of rows and columns is given, or there are too few.
    """
    if (rows is None) != (columns is None):
        what = f"a {kind}'s size must be rows and columns, or vertex_count"
        raise BadGarment(what, "only one of the two", "give both")
    if rows is None or columns is None:
        rows, columns = grid_size(vertex_count, aspect) if vertex_count > 0 else (0, 0)
    if rows < least[0] or columns < least[1]:
        what = f"a {kind} needs at least {least[0]} rows and {least[1]} columns"
        raise BadGarment(what, f"{rows} rows, {columns} columns", "ask for more vertices")
    return rows, columns


def grid_garment(
    vertices: Vertices,
    faces: Faces,
    *,
    flat: np.ndarray,
    flat_faces: Faces,
    columns: int,
    shaped: "ShapedBody",
    tree: ClosestTree,
    requested_count: int | None,
    material: Material | str,
    **options: Any,
) -> Garment:
    """Makes a garment that is cut flat, with its upper rows pinned to the skin.

    Positions are rounded, so that another machine's last bits give the same garment and hash.

    Args:
        vertices: Start positions, row by row [m].
        faces: Triangles.
        flat: Flat cut (flat_verts, 2) [m].
        flat_faces: The same triangles in it.
        columns: Number of vertices of a row.
        shaped: The body.
        tree: Surface of the body at rest.
        requested_count: Number of vertices that was asked for; None: the usual one, which needs no note.
        material: What it is made of, or its name.
        options: `name`, `key_joint`, `chains` of the garment.
    """
    ids = np.arange(PINNED_ROWS * columns)
    pins = Pins.bind(ids, vertices[ids], tree, shaped.normals)
    vertices[ids] = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    count = len(vertices)
    note = f"size: {requested_count} vertices were asked for, {count // columns} rows of {columns} are {count}"
    cut = np.concatenate([flat.round(8), np.zeros((len(flat), 1))], axis=1)
    return Garment(
        vertices=vertices.round(6).astype(np.float32),
        faces=faces,
        rest_edges=rest_edges_of_mesh(cut, flat_faces),
        material=material if isinstance(material, Material) else Material.of(material),
        pins=pins,
        body_name=shaped.body.name,
        body_betas=np.array(shaped.betas, np.float32),
        flat_rest=True,
        notes=() if requested_count in (None, count) else (note,),
        **options,
    )

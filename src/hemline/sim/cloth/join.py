"""Joins several pieces of cloth, each of its own material, into one sheet."""

from collections.abc import Sequence

import numpy as np

from hemline.errors import BadMesh

from .rows import Rows
from .sheet import Sheet


def join_sheets(sheets: Sequence[Sheet]) -> Sheet:
    """Joins several pieces of cloth into one sheet: vertices, faces and edges of each piece follow those of the one
    before.

    Args:
        sheets: The pieces from the skin outwards, at least one. If one of them is curved at rest, flat ones get hinges
            with a rest angle of 0, which bend as before as long as the cloth does not stretch.

    Raises:
        BadMesh: There is no piece.
    """
    if not sheets:
        raise BadMesh("a sheet must have a piece", "none", "give at least one")
    verts, faces, ring, far, pieces = (
        np.cumsum([0, *map(size, sheets[:-1])])
        for size in (
            lambda s: s.vertex_count,
            lambda s: len(s.faces),
            lambda s: len(s.ring.columns),
            lambda s: len(s.far.columns),
            lambda s: int(s.piece.max()) + 1,
        )
    )
    curved = any(len(sheet.hinge_rest) for sheet in sheets)
    rests = [s.hinge_rest if len(s.hinge_rest) else np.zeros(curved * len(s.hinges)) for s in sheets]

    def shift_and_join(name: str, by: np.ndarray) -> np.ndarray:
        """Joins the arrays of all sheets, each shifted by a number."""
        arrays = [getattr(sheet, name) for sheet in sheets]
        return np.concatenate([array + array.dtype.type(shift) for array, shift in zip(arrays, by, strict=True)])

    def rows(name: str, entries: np.ndarray, columns: np.ndarray) -> Rows:
        """Joins the sparse patterns of all sheets."""
        parts = [getattr(sheet, name) for sheet in sheets]
        ends = [part.starts[1:] + np.uint32(entry) for part, entry in zip(parts, entries, strict=True)]
        values = [part.columns + np.uint32(column) for part, column in zip(parts, columns, strict=True)]
        return Rows(np.concatenate([np.zeros(1, np.uint32), *ends]), np.concatenate(values))

    same = (
        "shape",
        "area",
        "vertex_area",
        "mass",
        "edge_length",
        "ring_bending",
        "far_bending",
        "hinge_weight",
        "density",
        "lame",
        "shear",
        "damping",
        "drag",
        "lift",
        "friction",
    )
    return Sheet(
        faces=shift_and_join("faces", verts),
        corners=rows("corners", 3 * faces, 3 * faces),
        edges=shift_and_join("edges", verts),
        edge_corners=rows("edge_corners", 3 * faces, 9 * faces),
        edge_slots=shift_and_join("edge_slots", ring),
        ring=rows("ring", ring, verts),
        far=rows("far", far, verts),
        hinges=shift_and_join("hinges", verts),
        hinge_rest=np.concatenate(rests),
        piece=shift_and_join("piece", pieces),
        **{name: np.concatenate([getattr(sheet, name) for sheet in sheets]) for name in same},
    )

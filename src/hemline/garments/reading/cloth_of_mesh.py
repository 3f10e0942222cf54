"""Finds the cloth in the mesh of a garment's file, in metres: one sheet, whole, without what is no cloth."""

from dataclasses import replace

import numpy as np

from hemline.meshes import ReadMesh, clean, close_joints, consistent_winding, weld

from .layers import single_layer
from .no_cloth import leave_out_details, leave_out_named, leave_out_solids, leave_out_trims, refuse_several
from .part_shapes import part_shapes
from .sewn_on import sew_on
from .units import UNIT_NAMES, UNITS, unit_of

_LARGEST = 1e30
"""Limit of positions, whose cubes are volumes."""
_MAIN_AREA = 0.01
"""Parts with less than this fraction of the area do not count for the size of a garment."""


def cloth_of_mesh(mesh: ReadMesh, unit: str | None, name: str, file: str) -> tuple[ReadMesh, str, tuple[str, ...]]:
    """Returns the cloth of a mesh in metres; the notes of the result say what was done.

    Triangles without area, doubled triangles and loose vertices go, seams are welded, further levels of detail, bodies,
    buttons and the like are left out, thick or doubled cloth becomes one sheet, and sheets that meet at edges of three
    triangles are sewn together.

    Args:
        mesh: The mesh as read, in the unit of the file.
        unit: A name of `UNITS`, or None to guess.
        name: Name of the garment in messages.
        file: Name of the file in messages.

    Returns:
        The mesh [m], the unit of the file, and a note if that was guessed.

    Raises:
        BadGarment: The unit contradicts the size, or the file has no cloth, or several garments.
    """
    if not len(mesh.faces) or not (np.abs(mesh.vertices[mesh.faces]) < _LARGEST).all():
        return mesh, "m", ()  # for the checks to refuse
    mesh = close_joints(weld(clean(leave_out_details(mesh))))
    wound = replace(mesh, faces=consistent_winding(mesh.faces)[0])
    rows = np.arange(len(mesh.faces), dtype=np.int32)
    wound = replace(wound, pattern=None, pattern_faces=np.stack([rows] * 3, axis=1))
    solid_free, body_unit = leave_out_solids(leave_out_named(wound), file)
    single = refuse_several(solid_free, file)
    guessed, unit_notes = unit_of(_main_points(single), unit or body_unit, name)
    if unit is None and body_unit:
        unit_notes = (
            f"unit: {UNIT_NAMES.get(body_unit, body_unit)}, as the body in the file is as tall as a person in it",
        )
    scaled = replace(single, vertices=single.vertices * UNITS[guessed])
    one = single_layer(leave_out_trims(scaled))
    chosen = np.asarray(one.pattern_faces)[:, 0]
    kept = mesh.with_faces(chosen, *one.notes[len(mesh.notes) :])
    return sew_on(replace(kept, vertices=kept.vertices * UNITS[guessed])), guessed, unit_notes


def _main_points(mesh: ReadMesh) -> np.ndarray:
    """Returns the vertices of all parts that are not tiny."""
    shapes = part_shapes(mesh)
    main = shapes.areas >= _MAIN_AREA * shapes.areas.sum()
    return mesh.vertices[main[shapes.vertex_parts]]

"""A garment as point masses with springs along its edges, laid out for the kernels of small steps."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Faces, Float, Int
from hemline.collide.whole.models import sweep_order
from hemline.sim.cloth.sheet import Sheet


class SpringSheet(NamedTuple):
    """A garment, as kernels take it: vertices in their order, edges so that most neighbours share no vertex."""

    edges: Int[np.ndarray, "edges 2"]
    """Vertices of each edge; an edge between two hard pins is left out."""
    lengths: Float[np.ndarray, " edges"]
    """Length of each edge on the pattern [m]."""
    compliances: Float[np.ndarray, " edges"]
    """Inverse stiffness of each edge [m/N]."""
    inverse_masses: Float[np.ndarray, " verts"]
    """Inverse mass of each vertex [1/kg]; 0 for hard pins."""
    friction: Float[np.ndarray, " verts"]
    """Coulomb's coefficient against the body."""
    faces: Faces
    """Triangles."""
    drag: Float[np.ndarray, " faces"]
    """Drag coefficient of each triangle."""
    lift: Float[np.ndarray, " faces"]
    """Lift coefficient of each triangle."""
    hinges: Int[np.ndarray, "hinges 4"]
    """Inner edges with the two vertices opposite."""
    hinge_weights: Float[np.ndarray, " hinges"]
    """Stiffness of each hinge [N m], see `Sheet`."""
    hinge_rests: Float[np.ndarray, " hinges"]
    """2 sin(angle / 2) of each hinge at rest."""
    bending_stiffness: Float[np.ndarray, " verts"]
    """Diagonal of the bending matrix [N/m]."""
    pins: Int[np.ndarray, " pins"]
    """Pinned vertices."""
    pin_compliances: Float[np.ndarray, " pins"]
    """Inverse stiffness of each pin [m/N]; 0 for hard ones."""


def spring_sheet(
    sheet: Sheet,
    pins: Int[np.ndarray, " pins"],
    pin_stiffness: Float[np.ndarray, " pins"],
    order: Int[np.ndarray, " verts"],
) -> SpringSheet:
    r"""Lays out a sheet.

    The stiffness of an edge is $k_e = Y \sum A / l^2$, with the areas $A$ of its triangles and its length $l$. On
    equilateral triangles these springs have Young's modulus $Y$ and Poisson's ratio 1/3. Bending is that of the sheet.

    Args:
        sheet: The sheet.
        pins: Pinned vertices.
        pin_stiffness: Spring stiffness of each pin; infinite for hard ones [N/m].
        order: Vertices in the order of the kernels.

    Source: Van Gelder, "Approximate simulation of elastic membranes by triangulated spring meshes", 1998, Eq. 20,
        without its correction for other Poisson's ratios.
    """
    count = sheet.vertex_count
    number = np.empty(count, np.int64)
    number[order] = np.arange(count)
    inverse_masses = 1 / sheet.mass[order]
    inverse_masses[number[pins[np.isinf(pin_stiffness)]]] = 0
    edges = np.sort(number[sheet.edges], axis=1)
    turn = sweep_order(edges, count)
    turn = turn[(inverse_masses[edges[turn]] > 0).any(axis=1)]
    rests = sheet.hinge_rest if len(sheet.hinge_rest) else np.zeros(len(sheet.hinges))
    return SpringSheet(
        edges=edges[turn].astype(np.int32),
        lengths=sheet.edge_length[turn].astype(np.float32),
        compliances=(1 / _edge_stiffness(sheet))[turn].astype(np.float32),
        inverse_masses=inverse_masses.astype(np.float32),
        friction=sheet.friction[order].astype(np.float32),
        faces=number[sheet.faces].astype(np.int32),
        drag=sheet.drag.astype(np.float32),
        lift=sheet.lift.astype(np.float32),
        hinges=number[sheet.hinges].astype(np.int32),
        hinge_weights=sheet.hinge_weight.astype(np.float32),
        hinge_rests=(2 * np.sin(0.5 * rests)).astype(np.float32),
        bending_stiffness=_bending_diagonal(sheet)[order].astype(np.float32),
        pins=number[pins].astype(np.int32),
        pin_compliances=(1 / pin_stiffness).astype(np.float32),
    )


def _edge_stiffness(sheet: Sheet) -> Float[np.ndarray, " edges"]:
    """Returns the stiffness of each edge [N/m]."""
    young = 4 * sheet.shear * (sheet.lame + sheet.shear) / (sheet.lame + 2 * sheet.shear)
    rows = np.repeat(np.arange(len(sheet.edges)), np.diff(sheet.edge_corners.starts))
    faces = (sheet.edge_corners.columns // 9).astype(np.int64)
    _, once = np.unique(np.stack([rows, faces]), axis=1, return_index=True)
    weights = np.bincount(rows[once], (young * sheet.area)[faces[once]], minlength=len(sheet.edges))
    return weights / sheet.edge_length**2


def _bending_diagonal(sheet: Sheet) -> Float[np.ndarray, " verts"]:
    """Returns the diagonal of the bending matrix [N/m], minus the sum of the other entries of each row."""
    diagonal = np.zeros(sheet.vertex_count)
    for rows, values in ((sheet.ring, sheet.ring_bending), (sheet.far, sheet.far_bending)):
        diagonal -= np.bincount(
            np.repeat(np.arange(sheet.vertex_count), np.diff(rows.starts)), values, minlength=sheet.vertex_count
        )
    return diagonal

"""A garment as point masses with springs along its edges, laid out for the kernels of small steps."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Faces, Float, Int
from hemline.collide.whole.models import fine_model
from hemline.garments.garment import Garment
from hemline.sim.cloth.sheet import Sheet


class SpringSheet(NamedTuple):
    """A garment, as kernels take it: vertices in their order, springs so that neighbours in the list share no vertex."""

    edges: Int[np.ndarray, "edges 2"]
    """Vertices of each edge."""
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


def spring_sheet(garment: Garment, sheet: Sheet, order: Int[np.ndarray, " verts"]) -> SpringSheet:
    r"""Lays out a garment.

    The stiffness of an edge is $k_e = Y \sum A / l^2$, with the areas $A$ of its triangles and its length $l$. On
    equilateral triangles these springs have Young's modulus $Y$ and Poisson's ratio 1/3. Bending is that of `Sheet`.

    Args:
        garment: The garment.
        sheet: Its sheet, see `make_garment_sheet`.
        order: Vertices in the order of the kernels.

    Source: Van Gelder, "Approximate simulation of elastic membranes by triangulated spring meshes", 1998, Eq. 20,
        without its correction for other Poisson's ratios.
    """
    count = len(order)
    number = np.empty(count, np.int64)
    number[order] = np.arange(count)
    stiff = np.isinf(garment.pins.stiffness)
    fine = fine_model(number[garment.faces], garment.rest_edges, np.sort(number[garment.pins.vertices[stiff]]))
    stiffness = _edge_stiffness(sheet, number, fine.edges)
    inverse_masses = 1 / sheet.mass[order]
    inverse_masses[number[garment.pins.vertices[stiff]]] = 0
    rests = sheet.hinge_rest if len(sheet.hinge_rest) else np.zeros(len(sheet.hinges))
    return SpringSheet(
        edges=fine.edges,
        lengths=fine.lengths,
        compliances=(1 / stiffness).astype(np.float32),
        inverse_masses=inverse_masses.astype(np.float32),
        friction=sheet.friction[order].astype(np.float32),
        faces=number[garment.faces].astype(np.int32),
        drag=sheet.drag.astype(np.float32),
        lift=sheet.lift.astype(np.float32),
        hinges=number[sheet.hinges].astype(np.int32),
        hinge_weights=sheet.hinge_weight.astype(np.float32),
        hinge_rests=(2 * np.sin(0.5 * rests)).astype(np.float32),
        bending_stiffness=_bending_diagonal(sheet)[order].astype(np.float32),
        pins=number[garment.pins.vertices].astype(np.int32),
        pin_compliances=(1 / garment.pins.stiffness).astype(np.float32),
    )


def _edge_stiffness(
    sheet: Sheet, number: Int[np.ndarray, " verts"], edges: Int[np.ndarray, "edges 2"]
) -> Float[np.ndarray, " edges"]:
    """Returns the stiffness of each edge [N/m]."""
    young = 4 * sheet.shear * (sheet.lame + sheet.shear) / (sheet.lame + 2 * sheet.shear)
    rows = np.repeat(np.arange(len(sheet.edges)), np.diff(sheet.edge_corners.starts))
    face = (sheet.edge_corners.columns // 9).astype(np.int64)
    _, once = np.unique(np.stack([rows, face]), axis=1, return_index=True)
    weight = np.bincount(rows[once], (young * sheet.area)[face[once]], minlength=len(sheet.edges))
    stiffness = weight / sheet.edge_length**2
    keys = np.sort(number[sheet.edges], axis=1) @ np.array([len(number), 1])
    rank = np.argsort(keys)
    wanted = np.sort(edges.astype(np.int64), axis=1) @ np.array([len(number), 1])
    return stiffness[rank[np.searchsorted(keys[rank], wanted)]]


def _bending_diagonal(sheet: Sheet) -> Float[np.ndarray, " verts"]:
    """Returns the diagonal of the bending matrix [N/m], minus the sum of the other entries of each row."""
    diagonal = np.zeros(sheet.vertex_count)
    for rows, values in ((sheet.ring, sheet.ring_bending), (sheet.far, sheet.far_bending)):
        diagonal -= np.bincount(
            np.repeat(np.arange(sheet.vertex_count), np.diff(rows.starts)), values, minlength=sheet.vertex_count
        )
    return diagonal

"""Cloth that crosses itself at rest: said where, and refused."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Mask, Vertices
from hemline.errors import SimulationFailed
from hemline.meshes import components, crossing_edges
from hemline.motions.motion import JOINT_NAMES
from hemline.sim.cloth.sheet import Sheet

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

MAX_CROSSING_RATIO = 0.002
"""Share of the edges that may go through a triangle of a garment that is not refused."""


def refuse_tangles(
    name: str, sheet: Sheet, vertices: Vertices, posed: "PosedBody", pinched: Mask, *, most: float = MAX_CROSSING_RATIO
) -> float:
    """The share of edges that go through a triangle, where it is small.

    Where the body cuts through itself there may be no other place for the cloth: edges of pinched vertices excuse
    themselves, and no others.

    Args:
        name: How errors call the garment.
        sheet: Its cloth.
        vertices: Where it is [m].
        posed: The body that wears it.
        pinched: Vertices that have no free place.
        most: The share that is small.

    Raises:
        SimulationFailed: It is not small; the message names the places.
    """
    crossed = crossing_edges(vertices, sheet.faces.astype(np.int32))
    share = len(crossed) / len(sheet.edges)
    crossed = crossed[~pinched[crossed].any(axis=1)]
    if len(crossed) > most * len(sheet.edges):
        raise SimulationFailed(
            f"'{name}' is tangled: {len(crossed)} of {len(sheet.edges)} edges go through its own cloth, "
            f"{_places(sheet, crossed, vertices, posed)}; lay its panels apart there, or leave out 'self_contact'"
        )
    return share


def _places(sheet: Sheet, crossed: np.ndarray, vertices: Vertices, posed: "PosedBody") -> str:
    """The three largest places, each with the joint that is nearest to it."""
    count = sheet.vertex_count
    near = np.isin(sheet.faces, crossed).any(axis=1)
    # crossings whose edges are neighbours in the mesh are one place
    part = components(sheet.faces[near].astype(np.int32), count)[crossed[:, 0]]
    numbers, sizes = np.unique(part, return_counts=True)
    named = []
    for number in numbers[np.argsort(-sizes, kind="stable")][:3]:
        centre = vertices[crossed[part == number].ravel()].mean(axis=0)
        joint = JOINT_NAMES[int(np.linalg.norm(posed.joints - centre, axis=1).argmin())]
        named.append(f"near the {joint} at ({', '.join(f'{value:.2f}' for value in centre)})")
    return " and ".join(named)

"""Refusal of cloth that crosses itself at rest; the error names the places."""

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
"""Maximum fraction of edges that may cross a triangle of the garment."""
MOST_CROSSING_WORN = 0.02
"""Maximum fraction of such edges of a garment that is worn and played nevertheless, with a warning."""


class TangledCloth(SimulationFailed):
    """A garment settled, but goes through itself in too many places.

    Attributes:
        vertices: Where it settled [m]; None in another process than that of the simulation.
    """

    vertices: Vertices | None = None


def refuse_tangles(
    name: str, sheet: Sheet, vertices: Vertices, posed: "PosedBody", pinched: Mask, *, limit: float = MAX_CROSSING_RATIO
) -> float:
    """Returns the fraction of edges that cross a triangle of the cloth, if it is small enough.

    Where the body intersects itself there may be no other place for the cloth, so edges of pinched vertices are not
    held against the garment.

    Args:
        name: Name of the garment in errors.
        sheet: The cloth.
        vertices: Positions of the cloth [m].
        posed: The body that wears it.
        pinched: Vertices without a free place.
        limit: Maximum fraction of crossing edges without pinched vertices.

    Raises:
        TangledCloth: Too many edges cross the cloth; the message names the places.
    """
    crossed = crossing_edges(vertices, sheet.faces.astype(np.int32))
    fraction = len(crossed) / len(sheet.edges)
    crossed = crossed[~pinched[crossed].any(axis=1)]
    if len(crossed) > limit * len(sheet.edges):
        failure = TangledCloth(
            f"'{name}' is tangled: {len(crossed)} of {len(sheet.edges)} edges go through its own cloth, "
            f"{_places(sheet, crossed, vertices, posed)}; lay its panels apart there, or leave out 'self_contact'"
        )
        failure.vertices = vertices
        raise failure
    return fraction


def _places(sheet: Sheet, crossed: np.ndarray, vertices: Vertices, posed: "PosedBody") -> str:
    """Describes the three largest places, each by the joint that is nearest to it."""
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

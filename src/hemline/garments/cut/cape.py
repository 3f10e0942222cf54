"""Makes capes on any shape of a body."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment
from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import CLEARANCE, body_tree
from hemline.garments.garment import Garment
from hemline.garments.material import Material

from .body_lines import joint
from .cape_drape import fold_sheet, hanging_columns
from .cape_rim import cape_rim
from .grid_garment import grid_garment, rows_and_columns
from .sector import grid_faces, sector_pattern

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

PAPER_VERTEX_COUNT = 12690
"""Number of vertices of the cape of Jin et al. 2024 (Fig. 2): here 90 rows of 141."""
LIGHT_VERTEX_COUNT = 4000
"""Number of vertices of the light cape: 50 rows of 80."""

_ASPECT = 141 / 90
_FOLD_START = 0.06
"""Distance behind the pins over which folds begin [m]."""


@dataclass(frozen=True)
class CapeCut:
    """Cut of a cape, and its shape at the start."""

    opening: float = 1.1
    """Angle of the flat ring sector, which flares the cape [rad]."""
    spread: float = 0.7
    """Half of the angle by which the cape fans out on the back, seen from above [rad]."""
    tilt: float = 0.32
    """Angle to the vertical at which the cape hangs at the start [rad]."""
    folds: int = 8
    """Number of folds at the start; each needs at least ten columns."""
    height: float = 0.004
    """Height of the pinned rim above the skin [m]."""
    length: float | None = None
    """Length from the rim to the hem [m]; None: to the middle of the calf."""


def make_cape(
    shaped: "ShapedBody",
    *,
    vertex_count: int = PAPER_VERTEX_COUNT,
    rows: int | None = None,
    columns: int | None = None,
    material: Material | str = "cotton",
    cut: CapeCut | None = None,
    name: str = "cape",
) -> Garment:
    """Makes a cape that is open in front: a flat ring sector in folds, pinned across the shoulders and the nape.

    Vertex r * columns + c lies in row r (0 is the rim, pinned with the row below) and column c, from the wearer's
    right to the left. The rest metric is the flat cut, so the cloth is flat at rest.

    Args:
        shaped: The body to wear it, any shape.
        vertex_count: Number of vertices wanted; the nearest grid of rows and columns is made.
        rows: Number of rows; with `columns` in place of `vertex_count`.
        columns: Number of columns.
        material: A material, or the name of one.
        cut: Cut of the cape; None: `CapeCut()`.
        name: Name of the garment.

    Returns:
        The cape at its start: outside the body by at least 3 mm, edges within a few percent of the cut.

    Raises:
        BadGarment: Fewer than 6 rows or 10 columns, a cut that cannot be made, or a body without shoulders.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Fig. 2 (12,690 vertices; its cut is not given, this one is ours).
    """
    cut = cut or CapeCut()
    rows, columns = rows_and_columns("cape", vertex_count, rows, columns, aspect=_ASPECT, least=(6, 10))
    if not (0.3 <= cut.opening <= 3.0 and 0 < cut.tilt < 1.2 and cut.folds >= 1 and cut.height >= 0.001):
        raise BadGarment("a cape's cut cannot be made", cut, "stay near the defaults of CapeCut")
    tree = body_tree(shaped)
    rim = cape_rim(shaped, tree, columns, cut.height)
    length = cut.length or float(
        rim[:, 1].mean() - (joint(shaped, "left_knee")[1] + joint(shaped, "left_ankle")[1]) / 2
    )
    step, clearance = length / (rows - 1), max(cut.height, CLEARANCE) + 0.0015
    sheet = hanging_columns(rim, tree, step=step, count=rows, spread=cut.spread, tilt=cut.tilt, clearance=clearance)
    width = float(np.linalg.norm(np.diff(rim, axis=0), axis=1).sum())
    distances = length * np.linspace(0, 1, rows)
    ease = np.clip((distances - step) / _FOLD_START, 0, 1)
    folded = fold_sheet(
        sheet, width + cut.opening * distances, ease * ease * (3 - 2 * ease), min(cut.folds, columns // 10)
    )
    vertices = push_out_of_body(folded.reshape(-1, 3), tree, CLEARANCE + 0.0002)
    faces = grid_faces(rows, columns)
    return grid_garment(
        vertices,
        faces,
        flat=sector_pattern(rows, columns, rim=width, length=length, opening=cut.opening),
        flat_faces=faces,
        columns=columns,
        shaped=shaped,
        tree=tree,
        material=material,
        name=name,
        key_joint="neck",
        requested_count=None if vertex_count == PAPER_VERTEX_COUNT else vertex_count,
    )

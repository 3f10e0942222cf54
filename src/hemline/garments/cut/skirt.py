"""Makes flared skirts on any shape of a body."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadGarment
from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import CLEARANCE, body_tree
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.meshes import ClosestTree

from .body_lines import joint
from .cone import cone_chains, cone_faces, cone_pattern, row_distances
from .grid_garment import PINNED_ROWS, grid_garment, rows_and_columns
from .skirt_drape import hang_rows, line_tilts, outward_of, pleat_sheet
from .waist import waist_line

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

PAPER_SIZE = (66, 281)
"""Rows and columns of the skirt of Jin et al. 2024 (Fig. 2): 18,546 vertices."""
LIGHT_SIZE = (34, 117)
"""Rows and columns of the light skirt: 3,978 vertices."""
CHAINS, NODES = 26, 9
"""Number of rope chains around the skirt, and of vertices of each (Fig. 2)."""

_BAND = 0.005
"""Distance between the two pinned rows [m]."""
_PLEAT_START = 0.06
"""Distance below the pins over which pleats begin [m]."""
_BELOW_KNEE = 0.25
_WIDEST, _WIDER = 5.8, 1.05
"""Widest opening that a body may need of a skirt without a cut, and by how much its opening exceeds it [rad, 1]."""


@dataclass(frozen=True)
class SkirtCut:
    """Cut of a skirt, and its shape at the start."""

    opening: float = 4.2
    """Angle of the flat ring sector that is closed to a cone: pi is a half circle, 2 pi a full one [rad]."""
    tilt: float = 0.3
    """Least angle to the vertical at which the skirt hangs at the start [rad]."""
    folds: int = 9
    """Number of pleats at the start; each needs at least eight columns."""
    height: float = 0.004
    """Height of the pinned rim above the skin [m]."""
    length: float | None = None
    """Length from the rim to the hem [m]; None: to a quarter of the distance from the knee to the ankle."""


def make_skirt(
    shaped: "ShapedBody",
    *,
    vertex_count: int = PAPER_SIZE[0] * PAPER_SIZE[1],
    rows: int | None = None,
    columns: int | None = None,
    material: Material | str = "cotton",
    cut: SkirtCut | None = None,
    name: str = "skirt",
) -> Garment:
    """Makes a flared skirt without a seam: a flat ring sector closed to a cone, pinned around the natural waist.

    Vertex r * columns + c lies in row r (0 is the rim, pinned with the row 5 mm below) and column c, from the middle of
    the back over the wearer's left side and the front. The rest metric is the flat cut, so the cloth is flat at rest,
    across the line where the sector closes, too. 26 rope chains of 9 vertices run from the second row to the hem.

    Args:
        shaped: The body to wear it, any shape.
        vertex_count: Number of vertices wanted; the nearest grid of rows and columns is made.
        rows: Number of rows; with `columns` in place of `vertex_count`.
        columns: Number of columns.
        material: A material, or the name of one.
        cut: Cut of the skirt; None: `SkirtCut()`, with an opening as wide as the hips of the body need.
        name: Name of the garment.

    Returns:
        The skirt at its start: outside the body by at least 3 mm, edges within a few percent of the cut.

    Raises:
        BadGarment: Fewer than 10 rows or 52 columns, a cut that cannot be made or does not pass the hips, or a body
            without a waist.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Fig. 2 (18,546 vertices, 26 chains of 9 bones; its cut is not given, this one is ours).
    """
    widened, cut = cut is None, cut or SkirtCut()
    aspect, least = PAPER_SIZE[1] / PAPER_SIZE[0], (NODES + 1, 2 * CHAINS)
    rows, columns = rows_and_columns("skirt", vertex_count, rows, columns, aspect=aspect, least=least)
    _check(cut)
    tree = body_tree(shaped)
    rim = waist_line(shaped, tree, columns, cut.height)
    width = float(np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum())
    distances = row_distances(rows, band=_BAND, length=cut.length or _length_to_calf(shaped, float(rim[:, 1].mean())))
    tilts, sheet = _hang(rim, distances, cut, tree)
    least = (float(np.linalg.norm(sheet[-1] - np.roll(sheet[-1], 1, axis=0), axis=1).sum()) - width) / distances[-1]
    if widened and cut.opening < least < _WIDEST:
        cut = replace(cut, opening=_WIDER * least)
    if cut.opening < least:
        what = f"a skirt of this length must open by {least:.2f} rad or more to pass the body"
        raise BadGarment(what, f"{cut.opening} rad", "ask for a wider opening, a smaller tilt or a shorter cut")
    draped = _pleat(rim, width, distances, cut, tilts, sheet)
    vertices = push_out_of_body(draped.reshape(-1, 3), tree, CLEARANCE + 0.0002)
    faces, unrolled = cone_faces(rows, columns)
    return grid_garment(
        vertices,
        faces,
        flat=cone_pattern(distances, columns, rim=width, opening=cut.opening),
        flat_faces=unrolled,
        columns=columns,
        shaped=shaped,
        tree=tree,
        material=material,
        name=name,
        key_joint="pelvis",
        chains=cone_chains(rows, columns, first=PINNED_ROWS - 1, chains=CHAINS, nodes=NODES),
        requested_count=None if vertex_count == PAPER_SIZE[0] * PAPER_SIZE[1] else vertex_count,
    )


def _check(cut: SkirtCut) -> None:
    good = 0.5 <= cut.opening <= 6.2 and 0 <= cut.tilt < 1.0 and cut.folds >= 1 and 0.001 <= cut.height <= 0.02
    if not (good and (cut.length is None or 0.1 <= cut.length <= 1.5)):
        raise BadGarment("a skirt's cut cannot be made", cut, "stay near the defaults of SkirtCut")


def _length_to_calf(shaped: "ShapedBody", waist: float) -> float:
    knee, ankle = joint(shaped, "left_knee")[1], joint(shaped, "left_ankle")[1]
    return float(waist - knee + _BELOW_KNEE * (knee - ankle))


def _hang(rim: np.ndarray, distances: np.ndarray, cut: SkirtCut, tree: ClosestTree) -> tuple[np.ndarray, np.ndarray]:
    """Returns the angle at which each column hangs clear of the body, and the smooth sheet of these lines."""
    outward, clearance = outward_of(rim), max(cut.height, CLEARANCE) + 0.001
    tilts = line_tilts(rim, outward, tree, length=float(distances[-1]), tilt=cut.tilt, clearance=clearance)
    return tilts, hang_rows(rim, outward, tilts, distances)


def _pleat(
    rim: np.ndarray, width: float, distances: np.ndarray, cut: SkirtCut, tilts: np.ndarray, sheet: np.ndarray
) -> np.ndarray:
    """Lays the sheet in pleats, as the cloth of the cut is longer around than the body."""
    outward = outward_of(rim)
    ease = np.clip((distances - _BAND) / _PLEAT_START, 0, 1)
    lean = outward * np.cos(tilts)[:, None] + np.array([0.0, 1.0, 0.0]) * np.sin(tilts)[:, None]
    folds = min(cut.folds, len(rim) // 8)
    return pleat_sheet(sheet, lean, width + cut.opening * distances, ease * ease * (3 - 2 * ease), folds)

"""Builds the solid whose surface is a garment, as a field on a grid over the left half of the body."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Points
from hemline.garments.cut.body_lines import joint
from hemline.garments.dressing import body_tree
from hemline.motions.motion import JOINT_NAMES

from .design import Design
from .lines import BodyLines
from .tapes import ARMS, FEET, tapes, triangles_of

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

SPACING = 0.008
"""Spacing of the grid [m]."""
SKIN_DISTANCE = 0.007
"""Least distance of cloth from the body's tape [m]."""
LEG_GAP = 0.006
"""Least distance of a trouser leg from the plane x = 0 [m]."""
_HALF = np.linspace(-np.pi / 2, np.pi / 2, 37)
_FULL = np.linspace(-np.pi, np.pi, 72, endpoint=False)


@dataclass(frozen=True)
class SampleGrid:
    """A field on a grid, negative inside the garment."""

    values: Float[np.ndarray, "nx ny nz"]
    """The field [m]."""
    origin: Float[np.ndarray, "3"]
    """Position of the first node; x is 0 [m]."""


@dataclass(frozen=True)
class Arm:
    """The left arm as a tube: points of its axis, from the shoulder on, and the radius of the sleeve at each."""

    points: Points
    radii: Float[np.ndarray, " points"]
    distances: Float[np.ndarray, " points"]
    """Distance of each point along the arm from the shoulder joint [m]."""

    def nearest(self, points: Points) -> tuple[np.ndarray, np.ndarray]:
        """Returns the distance of each point along the arm, and its height above the sleeve's surface [m]."""
        distance, height = np.zeros(len(points)), np.full(len(points), np.inf)
        for k in range(len(self.points) - 1):
            start, axis = self.points[k], self.points[k + 1] - self.points[k]
            fraction = np.clip((points - start) @ axis / (axis @ axis), 0, 1)
            radius = self.radii[k] + fraction * (self.radii[k + 1] - self.radii[k])
            here = np.linalg.norm(points - start - fraction[:, None] * axis, axis=1) - radius
            nearer = here < height
            height[nearer] = here[nearer]
            distance[nearer] = (self.distances[k] + fraction * (self.distances[k + 1] - self.distances[k]))[nearer]
        return distance, height


def solid(design: Design, shaped: "ShapedBody", lines: BodyLines) -> tuple[SampleGrid, Arm]:
    """Builds the field of a design, and the arm inside its sleeves.

    Args:
        design: Kind and measures of the garment.
        shaped: The body.
        lines: Heights on this body.
    """
    arm = _arm(design, shaped)
    heights = np.arange(lines.hem - 3 * SPACING, lines.top + 8 * SPACING, SPACING)
    trunk = _trunk(design, shaped, lines, heights)
    leg = _leg(design, shaped, lines, heights) if design.has_legs else None
    widest = max(trunk.max(), 0 if leg is None else leg.max(), arm.points[:, 0].max() + 0.15 if design.has_top else 0)
    deepest = max(trunk.max(), 0.35 if design.has_top else 0, 0 if leg is None else leg.max())
    x = SPACING * np.arange(int(widest / SPACING) + 4)
    z = np.arange(-deepest - 3 * SPACING, deepest + 4 * SPACING, SPACING)
    flat = np.stack([each.reshape(-1) for each in np.meshgrid(x, z, indexing="ij")], axis=1)
    tree = body_tree(shaped)
    values = np.empty((len(x), len(heights), len(z)))
    for row, y in enumerate(heights):
        field = (flat @ np.stack([np.cos(_HALF), np.sin(_HALF)]) - trunk[row]).max(axis=1)
        if leg is not None:
            field = _with_legs(field, flat, leg[row], float(y), lines.crotch - design.rise)
        if design.has_top:
            points = np.stack([flat[:, 0], np.full(len(flat), y), flat[:, 1]], axis=1)
            _add_arm(field, points, arm)
            near = np.flatnonzero((np.abs(field) < 0.05) & (flat[:, 0] < arm.points[2, 0]))
            if y > lines.armpit - 0.05 and len(near):
                field[near] = _union(field[near], tree.signed_distances(points[near]) - SKIN_DISTANCE, 0.01)
        values[:, row] = field.reshape(len(x), len(z))
    return SampleGrid(values, np.array([0.0, heights[0], z[0]])), arm


def _add_arm(field: np.ndarray, points: Points, arm: Arm) -> None:
    """Unites a field with the sleeve, in place. Points are of one level, and only those near the sleeve change."""
    reach = float(arm.radii.max()) + 0.1
    near = np.abs(arm.points[:, 1] - points[0, 1]) < reach
    if not near.any():
        return
    first, last = max(int(near.argmax()) - 1, 0), len(near) - int(near[::-1].argmax()) + 1
    part = Arm(*(each[first:last] for each in (arm.points, arm.radii, arm.distances)))
    low, high = part.points.min(axis=0) - reach, part.points.max(axis=0) + reach
    here = np.flatnonzero(((points > low) & (points < high))[:, [0, 2]].all(axis=1))
    field[here] = _union(field[here], part.nearest(points[here])[1], 0.03)


def _union(a: np.ndarray, b: np.ndarray, blend: float) -> np.ndarray:
    """Returns the smooth minimum of two fields, at most a quarter of `blend` below either [m]."""
    near = np.maximum(blend - np.abs(a - b), 0) / blend
    return np.minimum(a, b) - near * near * blend / 4


def _trunk(design: Design, shaped: "ShapedBody", lines: BodyLines, heights: np.ndarray) -> np.ndarray:
    """Returns the support function of the cloth around the trunk, or around trunk and legs, by height and direction."""
    from scipy.ndimage import gaussian_filter1d

    body = tapes(triangles_of(shaped, without=ARMS), heights, _HALF)
    body = _fill_rows(body)
    girth = design.ease / (2 * np.pi)
    if design.has_top:
        waist = design.waist_ease / (2 * np.pi)
        fraction = np.exp(-(((heights - lines.waist) / 0.09) ** 2))
        girth = girth + fraction * (waist - girth)
        full = np.clip((lines.shoulder - heights) / (lines.shoulder - lines.armpit), 0, 1)
        girth = girth * full * full * (3 - 2 * full)
    else:
        full = np.clip((lines.top - heights) / 0.12, 0, 1)
        girth = girth * full * full * (3 - 2 * full)
    if design.has_legs:
        fraction = np.clip((lines.waist - heights) / (lines.waist - lines.crotch), 0, 1)
        girth = girth + fraction * fraction * (3 - 2 * fraction) * (_at_crotch(design) - girth)
    cloth = body + SKIN_DISTANCE + np.reshape(girth, (-1, 1)) * np.ones((len(heights), 1))
    begin = lines.waist + (design.waist_height if design.has_top else 1.0)
    slope = 0.0 if design.has_legs else np.tan(design.flare)
    for row in range(len(heights) - 2, -1, -1):
        if heights[row] < begin and (not design.has_top or heights[row] < lines.waist):
            cloth[row] = np.maximum(cloth[row], cloth[row + 1] + slope * SPACING)
    smooth = gaussian_filter1d(cloth, 0.012 / SPACING, axis=0, mode="nearest")
    return np.maximum(smooth, body + 0.6 * SKIN_DISTANCE)


def _at_crotch(design: Design) -> float:
    """Returns the radius that the ease adds where trunk and legs meet [m]."""
    return min(design.ease, design.leg_ease) / (2 * np.pi)


def _leg(design: Design, shaped: "ShapedBody", lines: BodyLines, heights: np.ndarray) -> np.ndarray:
    """Returns the support function of the cloth around the left leg, by height and direction."""
    from scipy.ndimage import gaussian_filter1d

    corners = triangles_of(shaped, without=(*ARMS, *FEET))
    corners = corners[(corners[:, :, 0] > -0.002).all(axis=1)]
    hip, ankle = joint(shaped, "left_hip"), joint(shaped, "left_ankle")
    body = _fill_rows(tapes(corners, heights, _FULL))
    at = hip + ((heights - hip[1]) / (ankle[1] - hip[1]))[:, None] * (ankle - hip)
    centre = at[:, [0, 2]] @ np.stack([np.cos(_FULL), np.sin(_FULL)])
    own = body - centre
    first = int(np.searchsorted(heights, lines.crotch + 0.05))
    own[first:] = own[min(first, len(own) - 1)]
    straight = np.maximum.accumulate(own[::-1], axis=0)[::-1]
    taper = design.leg_taper * np.clip((lines.crotch - heights) / (lines.crotch - lines.knee), 0, 1)
    # at their top the legs are no wider than the trunk, else there would be a ledge around the hips
    begun = np.clip((lines.crotch + 0.05 - heights) / 0.15, 0, 1)
    girth = _at_crotch(design)
    girth = girth + begun * begun * (3 - 2 * begun) * (design.leg_ease / (2 * np.pi) - girth)
    cloth = straight + taper[:, None] * (own - straight) + SKIN_DISTANCE + girth[:, None]
    slope = np.tan(design.flare)
    for row in range(len(heights) - 2, -1, -1):
        if heights[row] < lines.knee:
            cloth[row] = np.maximum(cloth[row], cloth[row + 1] + slope * SPACING)
    return (
        np.maximum(gaussian_filter1d(cloth, 0.02 / SPACING, axis=0, mode="nearest"), own + 0.6 * SKIN_DISTANCE) + centre
    )


def _with_legs(field: np.ndarray, flat: np.ndarray, leg: np.ndarray, y: float, crotch: float) -> np.ndarray:
    """Unites the trunk above the crotch with a leg below it."""
    tube = (flat @ np.stack([np.cos(_FULL), np.sin(_FULL)]) - leg).max(axis=1)
    tube = np.maximum(-_union(-tube, flat[:, 0] - LEG_GAP, 0.01), y - crotch - 0.06)
    trunk = -_union(-field, np.full(len(field), y - crotch), 0.03)
    return _union(trunk, tube, 0.02)


def _fill_rows(rows: np.ndarray) -> np.ndarray:
    """Fills rows without a section with the nearest row that has one."""
    there = np.flatnonzero(np.isfinite(rows).all(axis=1))
    nearest = there[np.abs(there[None, :] - np.arange(len(rows))[:, None]).argmin(axis=1)]
    return rows[nearest]


def _arm(design: Design, shaped: "ShapedBody") -> Arm:
    from scipy.ndimage import gaussian_filter1d

    names = ("left_shoulder", "left_elbow", "left_wrist", "left_hand")
    knots = np.stack([joint(shaped, name) for name in names])
    knot_distances = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    distances = np.linspace(0, knot_distances[-1], 21)
    points = np.stack([np.interp(distances, knot_distances, knots[:, axis]) for axis in range(3)], axis=1)
    body = shaped.body
    strongest = body.weight_indices[np.arange(len(body.weights)), body.weights.argmax(axis=1)]
    skin = np.asarray(shaped.vertices, np.float64)[np.isin(strongest, [JOINT_NAMES.index(n) for n in names[:3]])]
    away = np.linalg.norm(skin[:, None] - points, axis=2)
    nearest = away.argmin(axis=1)
    radii = np.zeros(len(distances))
    np.maximum.at(radii, nearest, away.min(axis=1))
    radii = np.maximum(radii, np.minimum(np.roll(radii, 1), np.roll(radii, -1)))
    radii[:3] = np.minimum(radii[:3], 0.062)
    radii = gaussian_filter1d(radii, 1.0, mode="nearest")
    ramp = np.clip(distances / 0.1, 0, 1)
    radii += SKIN_DISTANCE + ramp * design.sleeve_ease / (2 * np.pi) + np.tan(design.sleeve_flare) * distances
    return Arm(points, radii, distances)

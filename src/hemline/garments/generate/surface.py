"""Triangulates the left half of a garment finely, cut at neckline, sleeves, waistband and hem."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Points, Vertices
from hemline.garments.cut.body_lines import joint
from hemline.meshes import boundary_loops, components

from .clip_mesh import clip_mesh, drop_unused_vertices
from .design import Design
from .lines import BodyLines
from .marching import zero_surface
from .solid import SPACING, Arm, solid

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_PINHOLE = 0.1
"""Rims shorter than this are pinholes, which are closed [m]."""
_POWERS = {"v": 1.0, "round": 2.0, "square": 5.0}


def half_surface(design: Design, shaped: "ShapedBody", lines: BodyLines) -> tuple[Vertices, Faces]:
    """Triangulates the half at x >= 0; along the cut in the middle, x is 0.

    Args:
        design: Kind and measures of the garment.
        shaped: The body.
        lines: Heights on this body.
    """
    grid, arm = solid(design, shaped, lines)
    vertices, faces = zero_surface(grid.values, grid.origin, SPACING)
    vertices, faces = clip_mesh(vertices, faces, lines.hem - vertices[:, 1])
    if not design.has_top:
        return _largest(*clip_mesh(vertices, faces, vertices[:, 1] - lines.top))
    vertices, faces = clip_mesh(vertices, faces, _neckline(vertices, design, shaped, lines))
    sleeve = _sleeve_end if design.sleeve > 0 else _armhole
    return _largest(*clip_mesh(vertices, faces, sleeve(vertices, design, arm, lines)))


def _neckline(points: Points, design: Design, shaped: "ShapedBody", lines: BodyLines) -> np.ndarray:
    """Returns a function that is positive within the neckline: 1 - (|x / half width|^p + |depth|^p)^(1 / p), scaled."""
    middle = float(joint(shaped, "neck")[2]) - 0.02
    front = np.clip((points[:, 2] - middle) / 0.06 + 0.5, 0, 1)
    front = front * front * (3 - 2 * front)
    depth = design.neck_back + front * (design.neck_front - design.neck_back)
    power = 2.0 + front * (_POWERS[design.neckline] - 2.0)
    above = np.maximum(points[:, 1] - lines.shoulder, 0)
    across = np.maximum(np.abs(points[:, 0]) - above, 0) / (design.neck_width / 2)
    down = np.maximum(lines.shoulder - points[:, 1], 0) / depth
    return (design.neck_width / 2) * (1 - (across**power + down**power) ** (1 / power))


def _sleeve_end(points: Points, design: Design, arm: Arm, lines: BodyLines) -> np.ndarray:
    distance, height = arm.nearest(points)
    return np.minimum(distance - design.sleeve, 0.03 - height)


def _armhole(points: Points, design: Design, arm: Arm, lines: BodyLines) -> np.ndarray:
    """Returns a function that is positive on the arm, and beyond a plane from strap to side below the armpit."""
    distance, height = arm.nearest(points)
    low = lines.armpit - 0.02
    side = (np.abs(points[:, 1] - low) < 0.01) & (height > 0.02)
    inner = points[side, 0].max(initial=arm.points[0, 0])
    shoulder = design.neck_width / 2 + design.strap
    fraction = (points[:, 1] - low) / (lines.shoulder - low)
    beyond = points[:, 0] - inner - fraction * (shoulder - inner)
    return np.maximum(np.minimum(beyond, points[:, 1] - low), np.minimum(distance - 0.1, 0.02 - height))


def _largest(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces]:
    """Returns the largest connected part, with pinholes closed where two cuts meet."""
    labels = components(faces, len(vertices))
    best = np.bincount(labels[faces[:, 0]]).argmax()
    vertices, faces = drop_unused_vertices(vertices, faces[labels[faces[:, 0]] == best])
    for loop in boundary_loops(faces):
        rim = vertices[loop]
        if np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum() < _PINHOLE:
            fan = np.stack([loop, np.roll(loop, -1), np.full(len(loop), len(vertices))], axis=1)
            vertices = np.concatenate([vertices, rim.mean(axis=0, keepdims=True)])
            faces = np.concatenate([faces, fan.astype(np.int32)])
    return vertices, faces

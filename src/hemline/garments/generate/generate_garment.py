"""Generates a garment from its measures, on any shape of a body."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Vertices
from hemline.errors import BadInput
from hemline.garments.clearance import push_out_of_body
from hemline.garments.dressing import CLEARANCE, body_tree
from hemline.garments.garment import Garment
from hemline.garments.material import Material
from hemline.garments.pin_rules import NO_PINS
from hemline.garments.pins import Pins
from hemline.garments.rest_metric import rest_edges_of_mesh
from hemline.meshes import boundary_loops, face_areas, subdivide

from .design import Design
from .even_mesh import even_mesh
from .lines import lines_of
from .solid import SPACING
from .surface import half_surface

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

MIDDLE_TOLERANCE = 1e-9
"""Vertices nearer to the plane x = 0 lie in it [m]."""
SHORTEST_EDGE, LONGEST_EDGE = 0.008, 0.05
"""Range of edge lengths [m]."""


def generate_garment(
    design: Design,
    shaped: "ShapedBody",
    *,
    edge: float = 0.02,
    vertex_count: int | None = None,
    name: str | None = None,
) -> Garment:
    """Generates a garment without a seam, whose left half is the mirror image of its right one.

    The garment is the surface of a solid: convex level sections of the body widened by the ease, cones below the waist,
    tubes around arms and legs, blended where they meet. That smooth surface is also its rest shape. Skirts
    and trousers are pinned along the waistband, all others rest on the shoulders.

    Args:
        design: Kind and measures of the garment.
        shaped: The body to wear it, any shape.
        edge: Edge length [m].
        vertex_count: Number of vertices, which is met within some percent; in place of `edge`.
        name: Name of the garment; None: its kind.

    Returns:
        The garment at its start: outside the body by at least 3 mm.

    Raises:
        BadInput: `edge`, or the edge that `vertex_count` asks for, is not from 0.008 to 0.05 m.
        BadGarment: The edges are too long for the shape, or the body has no waist.
    """
    _check(edge)
    lines = lines_of(design, shaped)
    fine, triangles = half_surface(design, shaped, lines)
    if vertex_count is not None:
        edge = _edge_of(vertex_count, fine, triangles)
        _check(edge)
    if edge < 3 * SPACING:
        faces, ends = subdivide(triangles, len(fine))
        fine, triangles = np.concatenate([fine, fine[ends].mean(axis=1)]), faces
    vertices, faces = mirror_half(*even_mesh(fine, triangles, edge, fine[:, 0] <= MIDDLE_TOLERANCE))
    tree = body_tree(shaped)
    rest_edges = rest_edges_of_mesh(vertices.round(6), faces)
    start = push_out_of_body(vertices, tree, CLEARANCE + 0.0002)
    pins = NO_PINS
    if not design.has_top:
        ids = np.flatnonzero(vertices[:, 1] > lines.top - 1e-6).astype(np.int32)
        pins = Pins.bind(ids, start[ids], tree, shaped.normals)
        start[ids] = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    return Garment(
        name=name or design.kind,
        vertices=start.round(6).astype(np.float32),
        faces=faces,
        rest_edges=rest_edges,
        material=Material.of(design.material),
        pins=pins,
        key_joint="pelvis",
        body_name=shaped.body.name,
        body_betas=np.array(shaped.betas, np.float32),
        flat_rest=True,
        notes=(f"generated: {design}",),
    )


def _check(edge: float) -> None:
    if not SHORTEST_EDGE <= edge <= LONGEST_EDGE:
        what = f"edges of a generated garment must be from {SHORTEST_EDGE} to {LONGEST_EDGE} m"
        raise BadInput(what, f"{edge:.4g} m", "ask for edges of 0.02 m, or for 600 to 12,000 vertices")


def _edge_of(vertex_count: int, vertices: Vertices, faces: Faces) -> float:
    """Returns the edge e that gives a number of vertices N = 2 (A / (sqrt(3) / 2 e^2) + L / 2 e).

    A and L are the area and the length of the rims of a half.
    """
    if vertex_count < 1:
        raise BadInput("a generated garment must have vertices", vertex_count, "ask for 600 to 12,000")
    loops = boundary_loops(faces)
    ends = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    off = (vertices[ends, 0] > MIDDLE_TOLERANCE).any(axis=1)
    rim = float(np.linalg.norm(np.diff(vertices[ends[off]], axis=1), axis=2).sum())
    area = float(face_areas(vertices, faces).sum()) / (np.sqrt(3) / 4)
    return (rim + np.sqrt(rim * rim + 4 * vertex_count * area)) / (2 * vertex_count)


def mirror_half(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces]:
    """Joins a half at x >= 0 with its mirror image where x is 0."""
    own = np.where(vertices[:, 0] <= MIDDLE_TOLERANCE, 0, vertices[:, 0])
    vertices = np.concatenate([own[:, None], vertices[:, 1:]], axis=1)
    off = np.flatnonzero(own > 0)
    image = np.arange(len(vertices))
    image[off] = len(vertices) + np.arange(len(off))
    both = np.concatenate([vertices, vertices[off] * [-1, 1, 1]])
    return both, np.concatenate([faces, image[faces][:, ::-1]]).astype(np.int32)

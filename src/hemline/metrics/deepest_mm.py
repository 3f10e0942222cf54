"""Depth of the deepest vertex inside the body."""

from hemline.arrays import BodyFaces, BodyVertices, Mask, Vertices
from hemline.meshes import closest_points_on_mesh


def deepest_mm(body_vertices: BodyVertices, body_faces: BodyFaces, vertices: Vertices, inside: Mask) -> float:
    """Returns the largest distance to the body's surface among the vertices inside, in one frame; 0 if none is inside.

    A vertex is inside if the winding number of the posed mesh exceeds 0.5 (`collide.inside`).

    Args:
        body_vertices: The posed body [m].
        body_faces: Triangles of the body.
        vertices: The garment [m].
        inside: Whether each vertex is inside the body.

    Returns:
        The distance [mm]; a clip takes the maximum over its frames.
    """
    if not inside.any():
        return 0.0
    return 1e3 * float(closest_points_on_mesh(vertices[inside], body_vertices, body_faces).distances.max())

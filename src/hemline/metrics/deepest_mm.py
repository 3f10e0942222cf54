"""How deep the deepest vertex is inside the body."""

from hemline.arrays import BodyFaces, BodyVertices, Mask, Vertices
from hemline.meshes import closest_points_on_mesh


def deepest_mm(body_vertices: BodyVertices, body_faces: BodyFaces, vertices: Vertices, inside: Mask) -> float:
    """Largest distance to the body's surface among the vertices inside, in one frame; 0 if none is.

    Inside is what has a winding number of the posed mesh above 0.5 (`collide.inside`).

    Args:
        body_vertices: The posed body [m].
        body_faces: Its triangles.
        vertices: The garment [m].
        inside: Which of its vertices are inside the body.

    Returns:
        The distance [mm]; the largest of a clip is that of its frames.
    """
    if not inside.any():
        return 0.0
    return 1e3 * float(closest_points_on_mesh(vertices[inside], body_vertices, body_faces).distances.max())

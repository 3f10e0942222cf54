"""Closest points on given triangles."""

from hemline.compiled import kernel
from hemline.sim.contact.body.touch_kernels import closest_on_triangle


@kernel
def closest_on_faces(x, face, vertices, faces, weights_out):
    """Finds the point closest to each vertex on its own triangle.

    Reads: x (verts, 3); face (verts,): -1 for none; vertices, faces: the mesh of the triangles.
    Writes: weights_out (verts, 2): barycentric weights of corners 1 and 2; 0 without a triangle.
    """
    for i in range(x.shape[0]):
        f = face[i]
        weights_out[i, 0], weights_out[i, 1] = 0.0, 0.0
        if f >= 0:
            v, w, _ = closest_on_triangle(
                x[i, 0], x[i, 1], x[i, 2], vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
            )
            weights_out[i, 0], weights_out[i, 1] = v, w


__all__ = ["closest_on_faces"]

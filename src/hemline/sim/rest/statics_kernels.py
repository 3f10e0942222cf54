"""Closest points on triangles that are known."""

from hemline.compiled import kernel
from hemline.sim.contact.body.touch_kernels import closest_on_triangle


@kernel
def closest_on_faces(x, face, vertices, faces, weights_out):
    """Barycentric weights of corners 1 and 2 of the point of each vertex's own triangle closest to it; face -1: 0."""
    for i in range(x.shape[0]):
        f = face[i]
        weights_out[i, 0], weights_out[i, 1] = 0.0, 0.0
        if f >= 0:
            v, w, _ = closest_on_triangle(
                x[i, 0], x[i, 1], x[i, 2], vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
            )
            weights_out[i, 0], weights_out[i, 1] = v, w


__all__ = ["closest_on_faces"]

"""Compiled: slides places over the skin, and decides which of them keep a cloth vertex outside the body."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.touch_kernels import SkinMesh, closest_around

MAX_WALK_STEPS = 16
"""Maximum number of body vertices on a walk over the skin."""


class Places(NamedTuple):
    """The first and the second place on the body that keep each vertex off.

    Attributes:
        nearest: Vertices of the body at the places.
        face: Faces of the body at the places, -1 for none.
        weights: Barycentric weights of the corners 1 and 2.
    """

    nearest: Int[np.ndarray, "2 verts"]
    face: Int[np.ndarray, "2 verts"]
    weights: Float[np.ndarray, "2 verts 2"]


@kernel
def walk_downhill(x, i, centre, vertices, faces, star_starts, star):
    """Walks over the skin from a vertex of the body to where the skin is closest to cloth vertex i.

    Returns: vertex, face, two weights.
    """
    px, py, pz = x[i, 0], x[i, 1], x[i, 2]
    best = 1e30
    for _ in range(MAX_WALK_STEPS):
        found = centre
        for entry in range(star_starts[centre], star_starts[centre + 1]):
            for corner in range(3):
                j = faces[star[entry], corner]
                d0, d1, d2 = vertices[j, 0] - px, vertices[j, 1] - py, vertices[j, 2] - pz
                d = d0 * d0 + d1 * d1 + d2 * d2
                if d < best:
                    best, found = d, j
        if found == centre:
            break
        centre = found
    face, v, w = closest_around(px, py, pz, centre, vertices, faces, star_starts, star)
    return centre, face, v, w


@kernel
def share_no_corner(faces, a, b):
    """Returns whether two faces share no corner; False if one of them is -1, no face."""
    if a < 0 or b < 0:
        return False
    for k in range(3):
        for l in range(3):
            if faces[a, k] == faces[b, l]:
                return False
    return True


@kernel
def height_over(x, i, vertices, normals, faces, face, v, w):
    """Returns the height of a vertex over the skin at a place, the distance to the place [m], and the unit normal
    there.
    """
    a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
    u = 1.0 - v - w
    n0 = u * normals[a, 0] + v * normals[b, 0] + w * normals[c, 0]
    n1 = u * normals[a, 1] + v * normals[b, 1] + w * normals[c, 1]
    n2 = u * normals[a, 2] + v * normals[b, 2] + w * normals[c, 2]
    over = 1.0 / max((n0 * n0 + n1 * n1 + n2 * n2) ** 0.5, 1e-12)
    r0 = x[i, 0] - (u * vertices[a, 0] + v * vertices[b, 0] + w * vertices[c, 0])
    r1 = x[i, 1] - (u * vertices[a, 1] + v * vertices[b, 1] + w * vertices[c, 1])
    r2 = x[i, 2] - (u * vertices[a, 2] + v * vertices[b, 2] + w * vertices[c, 2])
    height = (r0 * n0 + r1 * n1 + r2 * n2) * over
    return height, (r0 * r0 + r1 * r1 + r2 * r2) ** 0.5, n0 * over, n1 * over, n2 * over


@kernel(parallel=True)
def move_places(
    x, skin: SkinMesh, limb, rest_limb, closest: SkinPoints, max_depth, forget_height, max_skew, out: Places
):
    """Updates the first and the second place of each vertex after cloth and body have moved.

    Reads: x (verts, 3) float64; limb (faces,); rest_limb (verts,); closest: the closest places; max_depth,
        forget_height [m]; max_skew.
    Writes: out: the places, updated in place.
    """
    vertices, normals, faces, star_starts, star = skin
    closest_nearest, closest_face, closest_weights = closest
    nearest_out, face_out, weights_out = out
    for i in prange(x.shape[0]):
        nearby, second = closest_face[i], face_out[1, i]
        left, refused = share_no_corner(faces, face_out[0, i], nearby), False
        n0 = f0 = n1 = f1 = -1
        v0 = w0 = v1 = w1 = 0.0
        if left:
            n0, f0, v0, w0 = walk_downhill(x, i, nearest_out[0, i], vertices, faces, star_starts, star)
            left = share_no_corner(faces, f0, nearby)
        if second >= 0:
            n1, f1, v1, w1 = walk_downhill(x, i, nearest_out[1, i], vertices, faces, star_starts, star)
        if left and not (second >= 0 and not share_no_corner(faces, f1, nearby)):
            v, w = closest_weights[i, 0], closest_weights[i, 1]
            height, _, a0, a1, a2 = height_over(x, i, vertices, normals, faces, nearby, v, w)
            _, _, b0, b1, b2 = height_over(x, i, vertices, normals, faces, f0, v0, w0)
            opposed = a0 * b0 + a1 * b1 + a2 * b2 < 0.0
            returns = limb[nearby] == rest_limb[i] and limb[f0] != rest_limb[i]
            refused = height < 0.0 and (opposed or height < -max_depth) and not returns
        if left and not refused:
            # the place that is left becomes the second one
            n1, f1, v1, w1 = n0, f0, v0, w0
        if not refused:
            n0, f0, v0, w0 = closest_nearest[i], nearby, closest_weights[i, 0], closest_weights[i, 1]
        if f1 >= 0:
            height, distance, _, _, _ = height_over(x, i, vertices, normals, faces, f1, v1, w1)
            if not (
                share_no_corner(faces, f0, f1)
                and height < forget_height
                and distance < max_skew * abs(height) + max_depth
            ):
                f1 = -1
        nearest_out[0, i], face_out[0, i], weights_out[0, i, 0], weights_out[0, i, 1] = n0, f0, v0, w0
        nearest_out[1, i], face_out[1, i], weights_out[1, i, 0], weights_out[1, i, 1] = n1, f1, v1, w1


@kernel(parallel=True)
def share_stiffness(
    x, skin: SkinMesh, limb, rest_limb, pinched, places: Places, stiffness, yielding, yield_depth, stiffness_out
):
    """Computes the contact stiffness of the first and of the second place, softened on a limb that is not its own.

    Reads: x (verts, 3) float64; limb (faces,); rest_limb (verts,); pinched (verts,) bool; stiffness (verts,) [N/m];
        yielding: fraction of the stiffness that remains; yield_depth [m].
    Writes: stiffness_out (2, verts) [N/m].
    """
    vertices, normals, faces = skin.vertices, skin.normals, skin.faces
    face, weights = places.face, places.weights
    for i in prange(x.shape[0]):
        stiffness_out[0, i] = stiffness_out[1, i] = stiffness[i]
        first, second = face[0, i], face[1, i]
        own_first, own_second = first >= 0 and limb[first] == rest_limb[i], second >= 0 and limb[second] == rest_limb[i]
        if own_first == own_second or second < 0:
            if pinched[i] and not own_first and not own_second:
                stiffness_out[0, i] = yielding * stiffness[i]
            continue
        own = 0 if own_first else 1
        height, _, _, _, _ = height_over(
            x, i, vertices, normals, faces, face[own, i], weights[own, i, 0], weights[own, i, 1]
        )
        if pinched[i] or height < -yield_depth:
            stiffness_out[1 - own, i] = yielding * stiffness[i]


__all__ = ["Places", "height_over", "move_places", "share_no_corner", "share_stiffness", "walk_downhill"]

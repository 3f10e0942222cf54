"""Compiled: slides places over the skin, and decides which of them keep a cloth vertex outside the body."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.touch_kernels import SkinMesh, closest_around

MAX_WALK_STEPS = 16
"""Maximum number of body vertices on a walk over the skin."""

MAX_DEPTH = 0.005
"""A closest place that a vertex would lie deeper behind than this is refused: contact does not let cloth sink that far
[m]."""

FORGET_HEIGHT = 0.015
"""Height over a second place above which that place is forgotten [m]."""

MAX_SKEW = 2.0
"""A second place is also forgotten if its distance exceeds the height times this factor plus `MAX_DEPTH`, because it
then lies beside the vertex."""

YIELD_DEPTH = 0.002
"""If a vertex lies deeper in its own limb than this, contact with the other limb is softened [m]."""


class LimbLabels(NamedTuple):
    """The limbs that decide between two places.

    Attributes:
        face: Limb of each face of the body.
        rest: Limb that each vertex of the cloth lies on at rest.
    """

    face: Int[np.ndarray, " faces"]
    rest: Int[np.ndarray, " verts"]


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
def walk_downhill(x, i, centre, skin: SkinMesh):
    """Walks over the skin to where it is closest to a vertex of the cloth.

    Reads: x (verts, 3) [m]; i: the vertex; centre: vertex of the body where the walk begins; skin.
    Returns: The vertex and the face of the body where the walk ends, and the weights of the face's corners 1 and 2.
    """
    vertices, faces, star_starts, star = skin.vertices, skin.faces, skin.star_starts, skin.star
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
    face, v, w = closest_around(px, py, pz, centre, skin)
    return centre, face, v, w


@kernel
def share_no_corner(faces, a, b):
    """Tells whether two faces are apart.

    Reads: faces (faces, 3); a, b: numbers of two faces, -1 for none.
    Returns: Whether they share no corner; False if one of them is -1.
    """
    if a < 0 or b < 0:
        return False
    for k in range(3):
        for l in range(3):
            if faces[a, k] == faces[b, l]:
                return False
    return True


@kernel
def height_over(x, i, skin: SkinMesh, face, v, w):
    """Computes the height of a vertex over the skin at a place.

    Reads: x (verts, 3) [m]; i: the vertex; skin; face, v, w: the place, with the weights of the face's corners 1 and 2.
    Returns: The height, the distance to the place [m], and the three coordinates of the unit normal there.
    """
    vertices, normals, faces = skin.vertices, skin.normals, skin.faces
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
def move_places(x, skin: SkinMesh, limbs: LimbLabels, closest: SkinPoints, out: Places):
    """Updates the first and the second place of each vertex after cloth and body have moved.

    Reads: x (verts, 3) float64 [m]; skin; limbs; closest: the closest places.
    Writes: out: the places, updated in place.
    """
    faces, limb, rest_limb = skin.faces, limbs.face, limbs.rest
    closest_nearest, closest_face, closest_weights = closest
    nearest_out, face_out, weights_out = out.nearest, out.face, out.weights
    for i in prange(x.shape[0]):
        nearby, second = closest_face[i], face_out[1, i]
        left, refused = share_no_corner(faces, face_out[0, i], nearby), False
        n0 = f0 = n1 = f1 = -1
        v0 = w0 = v1 = w1 = 0.0
        if left:
            n0, f0, v0, w0 = walk_downhill(x, i, nearest_out[0, i], skin)
            left = share_no_corner(faces, f0, nearby)
        if second >= 0:
            n1, f1, v1, w1 = walk_downhill(x, i, nearest_out[1, i], skin)
        if left and not (second >= 0 and not share_no_corner(faces, f1, nearby)):
            v, w = closest_weights[i, 0], closest_weights[i, 1]
            height, _, a0, a1, a2 = height_over(x, i, skin, nearby, v, w)
            _, _, b0, b1, b2 = height_over(x, i, skin, f0, v0, w0)
            opposed = a0 * b0 + a1 * b1 + a2 * b2 < 0.0
            returns = limb[nearby] == rest_limb[i] and limb[f0] != rest_limb[i]
            refused = height < 0.0 and (opposed or height < -MAX_DEPTH) and not returns
        if left and not refused:
            # the place that is left becomes the second one
            n1, f1, v1, w1 = n0, f0, v0, w0
        if not refused:
            n0, f0, v0, w0 = closest_nearest[i], nearby, closest_weights[i, 0], closest_weights[i, 1]
        if f1 >= 0:
            height, distance, _, _, _ = height_over(x, i, skin, f1, v1, w1)
            if not (
                share_no_corner(faces, f0, f1)
                and height < FORGET_HEIGHT
                and distance < MAX_SKEW * abs(height) + MAX_DEPTH
            ):
                f1 = -1
        nearest_out[0, i], face_out[0, i], weights_out[0, i, 0], weights_out[0, i, 1] = n0, f0, v0, w0
        nearest_out[1, i], face_out[1, i], weights_out[1, i, 0], weights_out[1, i, 1] = n1, f1, v1, w1


@kernel(parallel=True)
def share_stiffness(x, skin: SkinMesh, limbs: LimbLabels, pinched, places: Places, stiffness, yielding, stiffness_out):
    """Computes the contact stiffness of the first and of the second place, softened on a limb that is not its own.

    Reads: x (verts, 3) float64 [m]; skin; limbs; pinched (verts,) bool; places; stiffness (verts,) [N/m]; yielding:
        fraction of the stiffness that remains.
    Writes: stiffness_out (2, verts) [N/m].
    """
    limb, rest_limb, face, weights = limbs.face, limbs.rest, places.face, places.weights
    for i in prange(x.shape[0]):
        stiffness_out[0, i] = stiffness_out[1, i] = stiffness[i]
        first, second = face[0, i], face[1, i]
        own_first, own_second = first >= 0 and limb[first] == rest_limb[i], second >= 0 and limb[second] == rest_limb[i]
        if own_first == own_second or second < 0:
            if pinched[i] and not own_first and not own_second:
                stiffness_out[0, i] = yielding * stiffness[i]
            continue
        own = 0 if own_first else 1
        height, _, _, _, _ = height_over(x, i, skin, face[own, i], weights[own, i, 0], weights[own, i, 1])
        if pinched[i] or height < -YIELD_DEPTH:
            stiffness_out[1 - own, i] = yielding * stiffness[i]


__all__ = ["LimbLabels", "Places", "height_over", "move_places", "share_no_corner", "share_stiffness", "walk_downhill"]

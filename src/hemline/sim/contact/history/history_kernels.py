"""Places of the body that slide over its skin, and which of them hold a vertex of the cloth off: compiled code."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hemline.compiled import kernel, prange
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.touch_kernels import SkinMesh, closest_around

MAX_WALK_STEPS = 16
"""Vertices of the body that a walk over the skin goes along, at most."""


class Places(NamedTuple):
    """The first and the second place of the body that holds each vertex off.

    Attributes:
        nearest: Vertices of the body at them.
        face: Their faces, -1 for none.
        weights: Of the corners 1 and 2.
    """

    nearest: Int[np.ndarray, "2 verts"]
    face: Int[np.ndarray, "2 verts"]
    weights: Float[np.ndarray, "2 verts 2"]


@kernel
def walk_downhill(x, i, centre, vertices, faces, star_starts, star):
    """From a vertex of the body downhill over its skin to where it is closest: vertex, face, two weights."""
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
    """Whether two faces share no corner; -1, no face, is apart from none."""
    if a < 0 or b < 0:
        return False
    for k in range(3):
        for l in range(3):
            if faces[a, k] == faces[b, l]:
                return False
    return True


@kernel
def height_over(x, i, vertices, normals, faces, face, v, w):
    """Height of a vertex over the skin at a place, distance to the place [m], the unit normal there."""
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
def move_places(x, skin: SkinMesh, limb, home, found: SkinPoints, deep, far, skew, out: Places):
    """The first and the second place of each vertex after cloth and body have moved.

    # in:  x (verts, 3) float64; limb (faces,), home (verts,); found: the closest places; `deep` and `far` [m], `skew`
    # in and out: the first and second places
    """
    vertices, normals, faces, star_starts, star = skin
    found_nearest, found_face, found_weights = found
    nearest_out, face_out, weights_out = out
    for i in prange(x.shape[0]):
        closest, second = found_face[i], face_out[1, i]
        left, refused = share_no_corner(faces, face_out[0, i], closest), False
        n0 = f0 = n1 = f1 = -1
        v0 = w0 = v1 = w1 = 0.0
        if left:
            n0, f0, v0, w0 = walk_downhill(x, i, nearest_out[0, i], vertices, faces, star_starts, star)
            left = share_no_corner(faces, f0, closest)
        if second >= 0:
            n1, f1, v1, w1 = walk_downhill(x, i, nearest_out[1, i], vertices, faces, star_starts, star)
        if left and not (second >= 0 and not share_no_corner(faces, f1, closest)):
            v, w = found_weights[i, 0], found_weights[i, 1]
            height, _, a0, a1, a2 = height_over(x, i, vertices, normals, faces, closest, v, w)
            _, _, b0, b1, b2 = height_over(x, i, vertices, normals, faces, f0, v0, w0)
            opposed = a0 * b0 + a1 * b1 + a2 * b2 < 0.0
            returns = limb[closest] == home[i] and limb[f0] != home[i]
            refused = height < 0.0 and (opposed or height < -deep) and not returns
        if left and not refused:
            # the place that is left becomes the second one
            n1, f1, v1, w1 = n0, f0, v0, w0
        if not refused:
            n0, f0, v0, w0 = found_nearest[i], closest, found_weights[i, 0], found_weights[i, 1]
        if f1 >= 0:
            height, distance, _, _, _ = height_over(x, i, vertices, normals, faces, f1, v1, w1)
            if not (share_no_corner(faces, f0, f1) and height < far and distance < skew * abs(height) + deep):
                f1 = -1
        nearest_out[0, i], face_out[0, i], weights_out[0, i, 0], weights_out[0, i, 1] = n0, f0, v0, w0
        nearest_out[1, i], face_out[1, i], weights_out[1, i, 0], weights_out[1, i, 1] = n1, f1, v1, w1


@kernel(parallel=True)
def share_stiffness(
    x, skin: SkinMesh, limb, home, pinched, places: Places, stiffness, yielding, pressed, stiffness_out
):
    """Contact stiffness of the first and of the second place of each vertex: what is not its own limb may yield.

    # in:  x (verts, 3) float64; limb (faces,), home (verts,), pinched (verts,) bool; stiffness (verts,) [N/m]; the
    #      share that yields; `pressed` [m]
    # out: stiffness_out (2, verts)
    """
    vertices, normals, faces = skin.vertices, skin.normals, skin.faces
    face, weights = places.face, places.weights
    for i in prange(x.shape[0]):
        stiffness_out[0, i] = stiffness_out[1, i] = stiffness[i]
        first, second = face[0, i], face[1, i]
        own_first, own_second = first >= 0 and limb[first] == home[i], second >= 0 and limb[second] == home[i]
        if own_first == own_second or second < 0:
            if pinched[i] and not own_first and not own_second:
                stiffness_out[0, i] = yielding * stiffness[i]
            continue
        own = 0 if own_first else 1
        height, _, _, _, _ = height_over(
            x, i, vertices, normals, faces, face[own, i], weights[own, i, 0], weights[own, i, 1]
        )
        if pinched[i] or height < -pressed:
            stiffness_out[1 - own, i] = yielding * stiffness[i]


__all__ = ["Places", "share_no_corner", "height_over", "move_places", "share_stiffness", "walk_downhill"]

"""Bounds of the patches of a cloth mesh, and the pairs of patches that could touch within a step.

Patches are compared by box, swept by their motion, and by the cone of their normals: a patch, or two joined patches,
cannot touch themselves while all normals agree within 90 degrees (Volino and Magnenat-Thalmann 1994, without their
contour test).
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hemline.compiled import kernel, prange
from hemline.sim.cloth.rows import Rows

FAST = {"contract", "nsz", "arcp"}


class ElementBounds(NamedTuple):
    """Bounds of each triangle, edge and vertex: centre (3), radius, normal (3; unit at vertices only), mean motion (3)
    and the largest difference of a corner's motion from it.
    """

    faces: Float[np.ndarray, "faces 11"]
    edges: Float[np.ndarray, "edges 11"]
    vertices: Float[np.ndarray, "verts 11"]


class PatchRows(NamedTuple):
    """The vertices, edges and triangles of each patch."""

    vertices: Rows
    edges: Rows
    faces: Rows


class PatchBounds(NamedTuple):
    """Bounds of each patch.

    Attributes:
        box: Low and high corner of all its elements [m].
        motion: Mean motion, and the largest difference of a vertex of its elements from it [m].
        cone: Axis and angle of a cone around its normals [rad].
    """

    box: Float[np.ndarray, "patches 6"]
    motion: Float[np.ndarray, "patches 4"]
    cone: Float[np.ndarray, "patches 4"]


class GroupBounds(NamedTuple):
    """Box and motion of groups of patches, see `PatchBounds`."""

    box: Float[np.ndarray, "groups 6"]
    motion: Float[np.ndarray, "groups 4"]


@kernel(parallel=True, fastmath=FAST)
def element_bounds(x, moved, faces, edges, at: Rows, out: ElementBounds):
    """Computes centre, radius, normal and motion of each triangle, edge and vertex.

    Reads: x, moved (verts, 3) float64: positions, and motion within the step [m]; faces (faces, 3); edges (edges, 2);
        at: corners of each vertex, 3 face + corner.
    Writes: out.
    """
    corner_starts, corners = at
    face_out, edge_out, vertex_out = out.faces, out.edges, out.vertices
    for f in prange(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        radius = spread = 0.0
        for c in range(3):
            face_out[f, c] = (x[i, c] + x[j, c] + x[k, c]) / 3.0
            face_out[f, 7 + c] = (moved[i, c] + moved[j, c] + moved[k, c]) / 3.0
        for corner in range(3):
            v, d, m = faces[f, corner], 0.0, 0.0
            for c in range(3):
                d += (x[v, c] - face_out[f, c]) ** 2
                m += (moved[v, c] - face_out[f, 7 + c]) ** 2
            radius, spread = max(radius, d), max(spread, m)
        face_out[f, 3], face_out[f, 10] = radius**0.5, spread**0.5
        a0, a1, a2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        b0, b1, b2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        face_out[f, 4], face_out[f, 5], face_out[f, 6] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    for i in prange(x.shape[0]):
        n0 = n1 = n2 = 0.0
        for entry in range(corner_starts[i], corner_starts[i + 1]):
            f = corners[entry] // 3
            n0 += face_out[f, 4]
            n1 += face_out[f, 5]
            n2 += face_out[f, 6]
        over = 1.0 / max((n0 * n0 + n1 * n1 + n2 * n2) ** 0.5, 1e-30)
        vertex_out[i, 3] = vertex_out[i, 10] = 0.0
        vertex_out[i, 4], vertex_out[i, 5], vertex_out[i, 6] = over * n0, over * n1, over * n2
        for c in range(3):
            vertex_out[i, c], vertex_out[i, 7 + c] = x[i, c], moved[i, c]
    for e in prange(edges.shape[0]):
        i, j, d, m = edges[e, 0], edges[e, 1], 0.0, 0.0
        for c in range(3):
            edge_out[e, c] = 0.5 * (x[i, c] + x[j, c])
            edge_out[e, 7 + c] = 0.5 * (moved[i, c] + moved[j, c])
            d += (x[i, c] - x[j, c]) ** 2
            m += (moved[i, c] - moved[j, c]) ** 2
            edge_out[e, 4 + c] = vertex_out[i, 4 + c] + vertex_out[j, 4 + c]
        edge_out[e, 3], edge_out[e, 10] = 0.5 * d**0.5, 0.5 * m**0.5


@kernel(parallel=True, fastmath=FAST)
def patch_bounds(x, moved, faces, edges, face_frames, rows: PatchRows, out: PatchBounds):
    """Computes box, motion and cone of normals of each patch.

    Reads: x, moved, faces, edges: see `element_bounds`; face_frames (faces, 11): from `element_bounds`; rows: the
        elements of each patch.
    Writes: out.
    """
    vertex_starts, vertices = rows.vertices
    edge_starts, patch_edges = rows.edges
    face_starts, patch_faces = rows.faces
    box_out, motion_out, cone_out = out.box, out.motion, out.cone
    for p in prange(vertex_starts.shape[0] - 1):
        box, motion, cone = box_out[p], motion_out[p], cone_out[p]
        box[0:3], box[3:6] = 1e30, -1e30
        motion[:], cone[:] = 0.0, 0.0
        first, end = vertex_starts[p], vertex_starts[p + 1]
        for entry in range(first, end):
            i = vertices[entry]
            for c in range(3):
                motion[c] += moved[i, c] / (end - first)
                box[c], box[3 + c] = min(box[c], x[i, c]), max(box[3 + c], x[i, c])
        most = 0.0
        for entry in range(first, end):
            i = vertices[entry]
            most = max(most, _differs(moved, i, motion))
        for entry in range(face_starts[p], face_starts[p + 1]):
            f = patch_faces[entry]
            n0, n1, n2 = face_frames[f, 4], face_frames[f, 5], face_frames[f, 6]
            over = 1.0 / max((n0 * n0 + n1 * n1 + n2 * n2) ** 0.5, 1e-30)
            cone[0] += n0 * over
            cone[1] += n1 * over
            cone[2] += n2 * over
            for corner in range(3):
                i = faces[f, corner]
                most = max(most, _differs(moved, i, motion))
                for c in range(3):
                    box[c], box[3 + c] = min(box[c], x[i, c]), max(box[3 + c], x[i, c])
        for entry in range(edge_starts[p], edge_starts[p + 1]):
            i = edges[patch_edges[entry], 1]
            most = max(most, _differs(moved, i, motion))
            for c in range(3):
                box[c], box[3 + c] = min(box[c], x[i, c]), max(box[3 + c], x[i, c])
        motion[3] = most**0.5
        length = (cone[0] ** 2 + cone[1] ** 2 + cone[2] ** 2) ** 0.5
        widest = 1.0 if length > 1e-12 else -1.0
        for c in range(3):
            cone[c] /= max(length, 1e-12)
        for entry in range(face_starts[p], face_starts[p + 1]):
            f = patch_faces[entry]
            n0, n1, n2 = face_frames[f, 4], face_frames[f, 5], face_frames[f, 6]
            over = 1.0 / max((n0 * n0 + n1 * n1 + n2 * n2) ** 0.5, 1e-30)
            widest = min(widest, over * (n0 * cone[0] + n1 * cone[1] + n2 * cone[2]))
        cone[3] = np.arccos(min(max(widest, -1.0), 1.0))


@kernel(inline="always")
def _differs(moved, i, motion):
    """Computes the squared difference of a motion from a mean motion.

    Reads: moved (elements, 3) [m]; i: the element; motion (3,): the mean [m].
    Returns: The square [m^2].
    """
    return (moved[i, 0] - motion[0]) ** 2 + (moved[i, 1] - motion[1]) ** 2 + (moved[i, 2] - motion[2]) ** 2


@kernel
def group_bounds(bounds: PatchBounds, size, out: GroupBounds):
    """Computes box and motion of groups of `size` consecutive patches.

    Reads: bounds; size.
    Writes: out.
    """
    box, motion = bounds.box, bounds.motion
    box_out, motion_out = out
    for group in range(box_out.shape[0]):
        first, end = group * size, min(box.shape[0], (group + 1) * size)
        box_out[group, 0:3], box_out[group, 3:6], motion_out[group] = 1e30, -1e30, 0.0
        for p in range(first, end):
            for c in range(3):
                box_out[group, c] = min(box_out[group, c], box[p, c])
                box_out[group, 3 + c] = max(box_out[group, 3 + c], box[p, 3 + c])
                motion_out[group, c] += motion[p, c] / (end - first)
        for p in range(first, end):
            spread = motion[p, 3] + _differs(motion, p, motion_out[group]) ** 0.5
            motion_out[group, 3] = max(motion_out[group, 3], spread)


@kernel(inline="always")
def _pass(box, motion, p, q, margin):
    """Compares two boxes in motion.

    Reads: box (boxes, 6), motion (boxes, 4): of `PatchBounds` or `GroupBounds` [m]; p, q: the boxes; margin [m].
    Returns: Whether they stay farther apart than the margin.
    """
    slack = margin + motion[p, 3] + motion[q, 3]
    for c in range(3):
        relative = motion[p, c] - motion[q, c]
        if box[p, c] + min(relative, 0.0) - box[q, 3 + c] > slack:
            return True
        if box[q, c] - box[p, 3 + c] - max(relative, 0.0) > slack:
            return True
    return False


@kernel(parallel=True)
def patch_pairs(bounds: PatchBounds, groups: GroupBounds, size, joined, margin, capacity, count_out, pairs_out):
    """Finds for each patch the patches, itself or later ones, that it could touch within the step.

    Reads: bounds; groups, size: groups of patches and their size; joined (patches, patches): see `ClothMesh`; margin
        [m]; capacity: results per patch in pairs_out.
    Writes: count_out (patches,): number of results, possibly more than there is room for; pairs_out (patches,
        capacity).
    """
    box, motion, cone = bounds
    group_box, group_motion = groups
    for group in prange(group_box.shape[0]):
        count_out[group * size : (group + 1) * size] = 0
        for other in range(group, group_box.shape[0]):
            if _pass(group_box, group_motion, group, other, margin):
                continue
            for p in range(group * size, min(box.shape[0], (group + 1) * size)):
                for q in range(max(p, other * size), min(box.shape[0], (other + 1) * size)):
                    if _pass(box, motion, p, q, margin):
                        continue
                    if joined[p, q]:
                        along = cone[p, 0] * cone[q, 0] + cone[p, 1] * cone[q, 1] + cone[p, 2] * cone[q, 2]
                        if np.arccos(min(max(along, -1.0), 1.0)) + cone[p, 3] + cone[q, 3] < 0.5 * np.pi:
                            continue
                    if count_out[p] < capacity:
                        pairs_out[p, count_out[p]] = q
                    count_out[p] += 1


__all__ = [
    "ElementBounds",
    "GroupBounds",
    "PatchBounds",
    "PatchRows",
    "element_bounds",
    "group_bounds",
    "patch_bounds",
    "patch_pairs",
]

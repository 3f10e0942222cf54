"""Compiled: half-spaces over the skin, in which the samples of the cloth are to stay.

A sample remembers the face of the body that constrained it last. The face follows the sample by a walk over the skin,
so that cloth stays on the side of a limb where it was, however deep the animator has put it. All positions are in the
frame of the key bone.
"""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Int, Points, UInt
from hemline.collide.surface.search_kernels import search_buffers, seek_place
from hemline.collide.surface.surface_kernels import interpolate_normal, plane_height, point_on_face, vertex_normal, walk
from hemline.compiled import kernel

_index = np.uintp
WALK_STEPS = 8
"""Faces that the walk of a sample passes each time, at most."""
NEARER = np.float32(0.9)
"""Another place takes over where its squared distance is below this fraction of the old one's."""
LEAST_AGREEMENT = np.float32(0.2)
"""Least cosine between cloth and skin at a place that takes over a sample which is inside there."""
FAR_HEIGHT = np.float32(0.035)
"""A sample that was higher over the skin is skipped in most frames, unless it came down to its face [m]."""
FAR_INTERVAL = 4
"""Frames between two visits of such a sample."""
SEARCH_INTERVAL = 8
"""Frames between two searches for the skin of other limbs."""


class Limbs(NamedTuple):
    """The limb of each body vertex."""

    number: Int[np.ndarray, " body_verts"]
    """Number of the limb."""
    bit: UInt[np.ndarray, " body_verts"]
    """Bit of the limb, uint32."""


class LimbGrid(NamedTuple):
    """A grid over the body that tells which limbs may be near."""

    bits: UInt[np.ndarray, "x y z"]
    """Bits of the limbs that may be near each cell, uint32."""
    low: Float[np.ndarray, " 3"]
    """Lowest corner of the grid [m]."""
    size: np.float32
    """Edge length of a cell [m]."""


class ShiftedCloth(NamedTuple):
    """The garment of one frame, and how far its control vertices were moved."""

    points: Points
    """Positions as the animator made them [m]."""
    shifts: Float[np.ndarray, "controls 3"]
    """Shift of each control vertex [m]."""


class Samples(NamedTuple):
    """The samples that are visited, and how high over the skin they are constrained."""

    listed: Int[np.ndarray, " listed"]
    """Samples to visit."""
    margins: Float[np.ndarray, " samples"]
    """Least height of each sample over the skin [m]."""
    reach: np.float32
    """A sample is constrained up to this height above its margin [m]."""
    frame: int
    """Frame number."""
    again: bool
    """Whether samples only walk and do not search."""


class SampleMemory(NamedTuple):
    """State of the samples between frames; kernels write to all arrays."""

    faces: Int[np.ndarray, " samples"]
    """Face of the body that constrained the sample last."""
    heights: Float[np.ndarray, " samples"]
    """Height over that face when last measured [m]."""
    fresh: Bool[np.ndarray, " samples"]
    """Whether the sample was away from all skin; it searches for the nearest skin when it comes back."""

    def copy(self) -> "SampleMemory":
        """Returns a copy that shares no array."""
        return SampleMemory(self.faces.copy(), self.heights.copy(), self.fresh.copy())


class HalfSpaces(NamedTuple):
    """The half-spaces in which samples are to stay; kernels write to them."""

    planes: Float[np.ndarray, "samples 4"]
    """Unit normal, and least height along it [m]."""
    constrained: Int[np.ndarray, " samples"]
    """The samples that have a half-space come first."""


@kernel
def grid_around(patch_box, size, widen, low_out, counts_out):
    """Places a grid around the body.

    Reads: patch_box (6, patches) [m]; size: edge length of a cell [m]; widen: boxes are widened by it [m].
    Writes: low_out (3,): lowest corner [m]; counts_out (3,): cells along each axis.
    """
    for axis in range(3):
        low, high = np.float32(np.inf), np.float32(-np.inf)
        for k in range(patch_box.shape[1]):
            low, high = min(low, patch_box[axis, k]), max(high, patch_box[3 + axis, k])
        low_out[axis] = low - widen
        counts_out[axis] = max(np.int64(np.ceil((high + widen - low_out[axis]) / size)), 1)


@kernel
def fill_cells(patch_box, patch_bit, low, size, widen, cells_out):
    """Marks in each cell of a grid which limbs may be near.

    Reads: patch_box (6, patches) [m]; patch_bit (patches,): bit of the limb; low (3,): lowest corner of the grid [m];
        size: edge length of a cell [m]; widen: boxes are widened by it [m].
    Writes: cells_out (x, y, z), uint32, zero before.
    """
    nx, ny, nz = cells_out.shape
    for k in range(patch_box.shape[1]):
        x0 = max(np.int64((patch_box[0, k] - widen - low[0]) / size), 0)
        y0 = max(np.int64((patch_box[1, k] - widen - low[1]) / size), 0)
        z0 = max(np.int64((patch_box[2, k] - widen - low[2]) / size), 0)
        x1 = min(np.int64((patch_box[3, k] + widen - low[0]) / size), nx - 1)
        y1 = min(np.int64((patch_box[4, k] + widen - low[1]) / size), ny - 1)
        z1 = min(np.int64((patch_box[5, k] + widen - low[2]) / size), nz - 1)
        for x in range(x0, x1 + 1):
            for y in range(y0, y1 + 1):
                for z in range(z0, z1 + 1):
                    cells_out[x, y, z] |= patch_bit[k]


@kernel(forceinline=True)
def move_point(cloth, model, vertex):
    """Moves a vertex with the shifts of its control vertices.

    Reads: cloth: a `ShiftedCloth`; model: a `CoarseModel`; vertex.
    Returns: The three coordinates [m].
    """
    (points, shifts), i = cloth, _index(vertex)
    weight_ids, weights = model.weight_ids, model.weights
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    for k in range(weights.shape[1]):
        c, w = _index(weight_ids[i, k]), weights[i, k]
        x, y, z = x + w * shifts[c, 0], y + w * shifts[c, 1], z + w * shifts[c, 2]
    return x, y, z


@kernel
def may_be_nearer(skin, own_limb, x, y, z, squared):
    """Tells whether a patch of another limb may have skin near a point.

    Reads: skin; own_limb: number of the limb that does not count; x, y, z: the point [m]; squared: squared distance
        [m^2].
    Returns: Whether skin may be that near.
    """
    box, found = skin.patch_box, False
    for k in range(box.shape[1]):
        dx = max(box[0, k] - x, x - box[3, k], np.float32(0))
        dy = max(box[1, k] - y, y - box[4, k], np.float32(0))
        dz = max(box[2, k] - z, z - box[5, k], np.float32(0))
        found |= (dx * dx + dy * dy + dz * dz < squared) & (skin.patch_limb[k] != own_limb)
    return found


@kernel
def constrain_samples(skin, limbs, grid, cloth, model, samples, memory, out):
    """Finds the half-spaces in which samples near the skin are to stay.

    Reads: skin; limbs; grid; cloth: a `ShiftedCloth`; model: a `CoarseModel`; samples.
    Writes: memory; out: `HalfSpaces`.
    Returns: how many samples have a half-space.
    """
    turn, again, planes_out, constrained_out = samples.frame, samples.again, out.planes, out.constrained
    margins, listed, low, size, bits_of = samples.margins, samples.listed, grid.low, grid.size, grid.bits
    buffers, zero, one = search_buffers(skin), np.float32(0), np.float32(1)
    faces, heights, fresh = memory.faces, memory.heights, memory.fresh
    count = 0
    for m in range(len(listed)):
        s = _index(listed[m])
        near = margins[s] + samples.reach
        x, y, z = move_point(cloth, model, model.samples[s])
        bits = np.uint32(0)
        gx, gy, gz = (x - low[0]) / size, (y - low[1]) / size, (z - low[2]) / size
        if gx >= zero and gy >= zero and gz >= zero:
            i, j, k = np.int64(gx), np.int64(gy), np.int64(gz)
            if i < bits_of.shape[0] and j < bits_of.shape[1] and k < bits_of.shape[2]:
                bits = bits_of[i, j, k]
        if bits == 0:
            fresh[s] = True
            continue
        skipped = heights[s] > FAR_HEIGHT and not fresh[s] and (np.int64(s) + turn) % FAR_INTERVAL != 0
        if skipped and plane_height(skin, faces[s], x, y, z) > near:
            continue
        face, at_b, at_c, squared = walk(skin, np.int64(faces[s]), np.int64(WALK_STEPS), x, y, z)
        own = limbs.bit[_index(skin.faces[_index(face), 0])]
        alone = again or not (fresh[s] or ((bits & ~own) != 0 and (np.int64(s) + turn) % SEARCH_INTERVAL == 0))
        if alone and squared > near * near and plane_height(skin, face, x, y, z) > zero:
            faces[s], heights[s], fresh[s] = face, np.sqrt(squared), False
            continue
        cx, cy, cz = point_on_face(skin, face, at_b, at_c)
        nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
        height = (x - cx) * nx + (y - cy) * ny + (z - cz) * nz
        own_limb = np.int32(-1) if fresh[s] else limbs.number[_index(skin.faces[_index(face), 0])]
        due = height > zero and (bits & ~own) != 0 and (np.int64(s) + turn) % SEARCH_INTERVAL == 0
        if (fresh[s] or due) and not again and may_be_nearer(skin, own_limb, x, y, z, NEARER * squared):
            other, other_b, other_c, other_squared = seek_place(skin, np.int32(-1), face, x, y, z, buffers)
            if other_squared < NEARER * squared:
                ox, oy, oz = point_on_face(skin, other, other_b, other_c)
                mx, my, mz = interpolate_normal(skin, other, other_b, other_c)
                other_height = (x - ox) * mx + (y - oy) * my + (z - oz) * mz
                takes = other_height >= zero
                if not takes:
                    ax, ay, az = move_point(cloth, model, model.triangles[s, 0])
                    bx, by, bz = move_point(cloth, model, model.triangles[s, 1])
                    ex, ey, ez = move_point(cloth, model, model.triangles[s, 2])
                    bx, by, bz, ex, ey, ez = bx - ax, by - ay, bz - az, ex - ax, ey - ay, ez - az
                    tx, ty, tz = by * ez - bz * ey, bz * ex - bx * ez, bx * ey - by * ex
                    scale = one / max(np.sqrt(tx * tx + ty * ty + tz * tz), np.float32(1e-20))
                    takes = (tx * mx + ty * my + tz * mz) * scale > LEAST_AGREEMENT
                if takes:
                    face, cx, cy, cz, nx, ny, nz = other, ox, oy, oz, mx, my, mz
                    height = other_height
        faces[s], heights[s], fresh[s] = face, height, False
        if height < near:
            planes_out[s, 0], planes_out[s, 1], planes_out[s, 2] = nx, ny, nz
            planes_out[s, 3] = cx * nx + cy * ny + cz * nz + margins[s]
            constrained_out[count] = s
            count += 1
    return count


@kernel
def place_pins(skin, corners, weights, heights, places_out):
    """Places pins on the skin: x = sum_c w_c v_c + h n, with n the interpolated unit normal.

    Reads: skin; corners (pins, 3): renumbered body vertices; weights (pins, 3); heights (pins,) [m].
    Writes: places_out (pins, 3) [m]; the skin's normals that were not known yet.
    """
    body, known, normals = skin.body, skin.known, skin.normals
    for p in range(len(corners)):
        x, y, z = np.float32(0), np.float32(0), np.float32(0)
        nx, ny, nz = x, y, z
        for c in range(3):
            v, w = _index(corners[p, c]), weights[p, c]
            if not known[v]:
                vertex_normal(body, skin.faces, skin.ring_start, skin.ring, v, known, normals)
            x, y, z = x + w * body[v, 0], y + w * body[v, 1], z + w * body[v, 2]
            nx, ny, nz = nx + w * normals[v, 0], ny + w * normals[v, 1], nz + w * normals[v, 2]
        lift = heights[p] / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-20))
        places_out[p, 0], places_out[p, 1], places_out[p, 2] = x + lift * nx, y + lift * ny, z + lift * nz

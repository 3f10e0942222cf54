"""Where the skin holds off the cloth's samples: compiled code.

A sample keeps the face of the body that held it off last. The face walks along with it, so that cloth stays on the side
of a limb where it was, however deep the animator has put it. Everything is in the frame of the key bone.
"""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Int, UInt
from hemline.collide.surface.search_kernels import search_buffers, seek_place
from hemline.collide.surface.surface_kernels import interpolate_normal, point_on_face, plane_height, vertex_normal, walk
from hemline.compiled import kernel

_index = np.uintp
WALK_STEPS = 8
"""Faces that a sample's place passes at most, each time."""
NEARER = np.float32(0.9)
"""Another place takes over where its squared distance is below this share of the old one's."""
AGREES = np.float32(0.2)
"""Least cosine between cloth and skin of a place that takes over a sample which is inside there."""
AWAY = np.float32(0.035)
"""A sample that was higher over the skin is not looked at in every frame, unless it came down to its face [m]."""
LOOK_AWAY = 4
"""Frames from one look at such a sample to the next."""
LOOK_AGAIN = 8
"""Frames from one look for the skin of other limbs to the next."""


class Limbs(NamedTuple):
    """The limb of each body vertex."""

    number: Int[np.ndarray, " body_verts"]
    bit: UInt[np.ndarray, " body_verts"]
    """One bit a limb, uint32."""


class LimbGrid(NamedTuple):
    """A grid over the body."""

    bits: UInt[np.ndarray, "x y z"]
    """The limbs that may be near, by their bits, uint32."""
    low: Float[np.ndarray, " 3"]
    """Its corner [m]."""
    size: np.float32
    """Of a cell [m]."""


class SampleMemory(NamedTuple):
    """What is remembered of each sample."""

    faces: Int[np.ndarray, " samples"]
    """The face of the body that held it last."""
    heights: Float[np.ndarray, " samples"]
    """Its height over that face when last looked at [m]."""
    fresh: Bool[np.ndarray, " samples"]
    """Whether it was away from all skin, so that it looks for the nearest when it comes back."""

    def copy(self) -> "SampleMemory":
        """The same in arrays of its own."""
        return SampleMemory(self.faces.copy(), self.heights.copy(), self.fresh.copy())


@kernel
def grid_around(patch_box, size, widen, low_out, counts_out):
    """The grid over a body: low_out (3,): its corner [m], counts_out (3,): cells along each axis.

    in: patch_box (6,patches) [m], size: of a cell [m], widen: what boxes grow by [m].
    """
    for axis in range(3):
        low, high = np.float32(np.inf), np.float32(-np.inf)
        for k in range(patch_box.shape[1]):
            low, high = min(low, patch_box[axis, k]), max(high, patch_box[3 + axis, k])
        low_out[axis] = low - widen
        counts_out[axis] = max(np.int64(np.ceil((high + widen - low_out[axis]) / size)), 1)


@kernel
def fill_cells(patch_box, patch_bit, low, size, widen, cells_out):
    """Which limbs may be near, by cells of a grid.

    in: patch_box (6,patches) [m], patch_bit (patches,): one bit a limb, low (3,): the grid's corner [m], size: of a
    cell [m], widen: what boxes grow by [m]; out: cells_out (x,y,z) uint32, zero before.
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
def move_point(points, shifts, weight_ids, weights, vertex):
    """A vertex where the control vertices' shifts take it."""
    i = _index(vertex)
    x, y, z = points[i, 0], points[i, 1], points[i, 2]
    for k in range(weights.shape[1]):
        c, w = _index(weight_ids[i, k]), weights[i, k]
        x, y, z = x + w * shifts[c, 0], y + w * shifts[c, 1], z + w * shifts[c, 2]
    return x, y, z


@kernel
def may_be_nearer(skin, own_limb, x, y, z, squared):
    """Whether a patch of another limb than `own_limb` may have skin within a squared distance of a point [m^2]."""
    box, found = skin.patch_box, False
    for k in range(box.shape[1]):
        dx = max(box[0, k] - x, x - box[3, k], np.float32(0))
        dy = max(box[1, k] - y, y - box[4, k], np.float32(0))
        dz = max(box[2, k] - z, z - box[5, k], np.float32(0))
        found |= (dx * dx + dy * dy + dz * dz < squared) & (skin.patch_limb[k] != own_limb)
    return found


@kernel
def constrain_samples(
    skin, limbs, cells, points, shifts, model, listed, again, turn, margins, reach, memory, planes_out, held_out
):
    """Half-spaces that samples near the skin are to stay in.

    in: skin, limbs, cells: where which limb may be near; points (n,3) and shifts (controls,3) [m]; model: see
    `CoarseModel`; listed (m,): which samples; again: only walk, do not seek; turn: frames; margins (samples,): height
    that each is held at, reach: how far above that it is held [m]; in and out: memory: see `SampleMemory`; out:
    planes_out (samples,4): unit normal and least height along it [m], held_out (samples,): which are near. Returns how
    many.
    """
    room, zero, one = search_buffers(skin), np.float32(0), np.float32(1)
    low, size, grid = cells.low, cells.size, cells.bits
    faces, heights, fresh = memory.faces, memory.heights, memory.fresh
    count = 0
    for m in range(len(listed)):
        s = _index(listed[m])
        near = margins[s] + reach
        x, y, z = move_point(points, shifts, model.weight_ids, model.weights, model.samples[s])
        bits = np.uint32(0)
        gx, gy, gz = (x - low[0]) / size, (y - low[1]) / size, (z - low[2]) / size
        if gx >= zero and gy >= zero and gz >= zero:
            i, j, k = np.int64(gx), np.int64(gy), np.int64(gz)
            if i < grid.shape[0] and j < grid.shape[1] and k < grid.shape[2]:
                bits = grid[i, j, k]
        if bits == 0:
            fresh[s] = True
            continue
        away = heights[s] > AWAY and not fresh[s] and (np.int64(s) + turn) % LOOK_AWAY != 0
        if away and plane_height(skin, faces[s], x, y, z) > near:
            continue
        face, at_b, at_c, squared = walk(skin, np.int64(faces[s]), np.int64(WALK_STEPS), x, y, z)
        own = limbs.bit[_index(skin.faces[_index(face), 0])]
        alone = again or not (fresh[s] or ((bits & ~own) != 0 and (np.int64(s) + turn) % LOOK_AGAIN == 0))
        if alone and squared > near * near and plane_height(skin, face, x, y, z) > zero:
            faces[s], heights[s], fresh[s] = face, np.sqrt(squared), False
            continue
        cx, cy, cz = point_on_face(skin, face, at_b, at_c)
        nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
        height = (x - cx) * nx + (y - cy) * ny + (z - cz) * nz
        own_limb = np.int32(-1) if fresh[s] else limbs.number[_index(skin.faces[_index(face), 0])]
        due = height > zero and (bits & ~own) != 0 and (np.int64(s) + turn) % LOOK_AGAIN == 0
        if (fresh[s] or due) and not again and may_be_nearer(skin, own_limb, x, y, z, NEARER * squared):
            other, other_b, other_c, other_squared = seek_place(skin, np.int32(-1), face, x, y, z, room)
            if other_squared < NEARER * squared:
                ox, oy, oz = point_on_face(skin, other, other_b, other_c)
                mx, my, mz = interpolate_normal(skin, other, other_b, other_c)
                other_height = (x - ox) * mx + (y - oy) * my + (z - oz) * mz
                takes = other_height >= zero
                if not takes:
                    ax, ay, az = move_point(points, shifts, model.weight_ids, model.weights, model.triangles[s, 0])
                    bx, by, bz = move_point(points, shifts, model.weight_ids, model.weights, model.triangles[s, 1])
                    ex, ey, ez = move_point(points, shifts, model.weight_ids, model.weights, model.triangles[s, 2])
                    bx, by, bz, ex, ey, ez = bx - ax, by - ay, bz - az, ex - ax, ey - ay, ez - az
                    tx, ty, tz = by * ez - bz * ey, bz * ex - bx * ez, bx * ey - by * ex
                    scale = one / max(np.sqrt(tx * tx + ty * ty + tz * tz), np.float32(1e-20))
                    takes = (tx * mx + ty * my + tz * mz) * scale > AGREES
                if takes:
                    face, cx, cy, cz, nx, ny, nz = other, ox, oy, oz, mx, my, mz
                    height = other_height
        faces[s], heights[s], fresh[s] = face, height, False
        if height < near:
            planes_out[s, 0], planes_out[s, 1], planes_out[s, 2] = nx, ny, nz
            planes_out[s, 3] = cx * nx + cy * ny + cz * nz + margins[s]
            held_out[count] = s
            count += 1
    return count


@kernel
def place_pins(skin, corners, weights, heights, places_out):
    """Where pins on the skin are: x = sum_c w_c v_c + h n, with n the interpolated unit normal.

    in: skin, corners (pins,3): renumbered body vertices, weights (pins,3), heights (pins,) [m]; out: places_out
    (pins,3).
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

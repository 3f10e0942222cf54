"""Compiled: which garment vertices see infinity past the posed body, and winding numbers of the others.

Everything happens in the frame of one bone. Garment vertices come in blocks of 8 within groups of 64, body faces in
leaves of 8 within patches; a group's rays run along one of six directions (+x, +y, +z, -x, -y, -z). A block whose shaft
along its direction meets no box has winding number 0. Each ray of the other blocks is tested only against the faces of
the leaves that overlap its block. The predicate is that of `winding.winding_kernels`, which tests any points against
any mesh, offline and in float64; `ray_lane_kernels` has it for eight points at once.
"""

import numpy as np

from hemline.collide.surface.box_kernels import BLOCK, GROUP
from hemline.collide.surface.surface_kernels import nearest_weights
from hemline.collide.winding.winding_kernels import crossing
from hemline.compiled import kernel

from .ray_lane_kernels import LANES, ShaftLeaf, ShaftRays, add_crossings_of_leaf

_index = np.uintp
SKYLINE_MARGIN = np.float32(0.005)
"""Boxes of the body are widened by this before vertices are certified to be free of them [m]."""


@kernel(forceinline=True)
def take_shafts(boxes, which, begin, end, direction, shafts_out):
    """Copies boxes as seen along a direction: their far ends, and lowest and highest coordinates across.

    Reads: boxes (6, boxes) [m], those of which[begin:end]; direction: 0 to 5.
    Writes: shafts_out (5, at least end - begin) [m], filled up to a multiple of 8 with shafts that nothing meets.
    """
    axis = _index(direction % 3)
    u, v = _index((direction + 1) % 3), _index((direction + 2) % 3)
    three = _index(3)
    for k in range(end - begin):
        box = _index(which[begin + k])
        shafts_out[0, k] = boxes[axis + three, box] if direction < 3 else -boxes[axis, box]
        shafts_out[1, k], shafts_out[2, k] = boxes[u, box], boxes[u + three, box]
        shafts_out[3, k], shafts_out[4, k] = boxes[v, box], boxes[v + three, box]
    for k in range(end - begin, (end - begin + 7) // 8 * 8):
        shafts_out[0, k] = -np.inf


@kernel(forceinline=True)
def list_hits(shafts, count, box, buffers, met_out):
    """Lists which of the first `count` shafts a block meets.

    Reads: shafts (5, at least count) [m]; box: the block as `block_box` returns it [m].
    Writes: met_out (at least count, up to a multiple of 8); buffers: a byte a shaft, and the same bytes by eights.
    Returns: how many shafts are met.
    """
    near, low_u, high_u, low_v, high_v = box
    mask, words = buffers
    for k in range((count + 7) // 8 * 8):
        mask[k] = (
            (shafts[0, k] >= near)
            & (shafts[1, k] <= high_u)
            & (shafts[2, k] >= low_u)
            & (shafts[3, k] <= high_v)
            & (shafts[4, k] >= low_v)
        )
    met = 0
    for word in range((count + 7) // 8):
        if words[word] != 0:
            for k in range(word * 8, word * 8 + 8):
                met_out[met] = k  # without a branch, which could not be predicted
                met += np.int64(mask[k])
    return met


@kernel(forceinline=True)
def block_box(points, begin, end, direction, margin):
    """Bounds points[begin:end], as seen along a direction, by a box.

    Reads: points (verts, 3) [m]; direction: axis 0 to 2, plus 3 for its negative; margin: the box is widened by it [m].
    Returns: the nearest coordinate along the direction, then the lowest and the highest on each of the other axes [m].
    """
    axis = _index(direction % 3)
    u, v = _index((direction + 1) % 3), _index((direction + 2) % 3)
    sign = np.float32(1 if direction < 3 else -1)
    near, low_u, low_v = np.float32(np.inf), np.float32(np.inf), np.float32(np.inf)
    high_u, high_v = np.float32(-np.inf), np.float32(-np.inf)
    for i in range(begin, end):
        k = _index(i)
        near = min(near, sign * points[k, axis])
        low_u, high_u = min(low_u, points[k, u]), max(high_u, points[k, u])
        low_v, high_v = min(low_v, points[k, v]), max(high_v, points[k, v])
    return near - margin, low_u - margin, high_u + margin, low_v - margin, high_v + margin


@kernel
def certify(points, patch_box, displaced_blocks, turn, tries, directions, hidden, near_out):
    """Lists the vertices that boxes alone do not show to be free of the body.

    Reads: points (verts, 3) [m]; patch_box (6, patches) [m]; displaced_blocks (blocks,): blocks that are listed in any
        case; turn: frame number; tries: further directions to try.
    Writes: directions (groups,): the direction in which each group sees fewest patches; hidden (groups,): groups of
        which no vertex was certified, which are tried again in every eighth turn; near_out (verts,): the listed
        vertices.
    Returns: how many are listed.
    """
    margin = SKYLINE_MARGIN
    patches = patch_box.shape[1]
    mask, every = np.zeros((patches + 7) // 8 * 8, np.uint8), np.arange(patches)
    buffers = mask, mask.view(np.uint64)
    met, few = np.empty(patches + 8, np.int64), np.empty(patches + 8, np.int64)
    shafts, group_shafts = np.empty((6, 5, patches + 8), np.float32), np.empty((5, patches + 8), np.float32)
    for along in range(6):
        take_shafts(patch_box, every, 0, patches, along, shafts[along])
    count = 0
    for group in range(len(directions)):
        begin, end = group * GROUP, min((group + 1) * GROUP, len(points))
        unseen = np.uint8(255)
        previous = np.int64(directions[group])
        best, fewest = previous, patches + 1
        attempts = 0 if hidden[group] and (group + turn) % 8 else tries + 1
        for attempt in range(attempts):
            along = previous if attempt == 0 else (previous + 1 + (turn + attempt) % 5) % 6
            seen = patches
            for block in range(-1, (end - begin + BLOCK - 1) // BLOCK):  # -1: the group as a whole
                whole = block < 0
                if not whole and not unseen >> block & 1:
                    continue
                first = begin if whole else begin + block * BLOCK
                box = block_box(points, first, end if whole else min(first + BLOCK, end), along, margin)
                tall = shafts[along] if whole else group_shafts
                hits = list_hits(tall, seen, box, buffers, met if whole else few)
                if whole:
                    seen = hits
                    take_shafts(patch_box, met, 0, seen, along, group_shafts)
                    if seen < fewest:
                        best, fewest = along, seen
                elif hits == 0:
                    unseen &= np.uint8(255 ^ (1 << block))
            if seen == 0:
                unseen = np.uint8(0)
                break
        directions[group] = best
        if attempts:
            hidden[group] = np.uint8(unseen == np.uint8(255))
        for i in range(begin, end):
            if unseen >> ((i - begin) // BLOCK) & 1 or displaced_blocks[i // BLOCK]:
                near_out[count] = i
                count += 1
    return count


@kernel(forceinline=True)
def gather_leaf(skin, leaf, rounding, corners_out):
    """Copies the corners of the faces of one leaf, 8 at a time, and the volume below which each face is in doubt.

    Reads: skin; leaf; rounding: distance to a face within which a point is in doubt [m].
    Writes: corners_out (leaves, 10, 8) [m, last row m^3].
    """
    body, faces, leaf_box = skin.body, skin.faces, skin.leaf_box
    size = np.float32(0)
    for axis in range(3):
        size += leaf_box[axis + 3, leaf] - leaf_box[axis, leaf] + rounding
    noise = np.float32(1e-6) * size * size * size
    for f in range(BLOCK):
        face = leaf * _index(BLOCK) + _index(f)
        a, b, c = _index(faces[face, 0]), _index(faces[face, 1]), _index(faces[face, 2])
        ax, ay, az = body[a, 0], body[a, 1], body[a, 2]
        bx, by, bz = body[b, 0], body[b, 1], body[b, 2]
        cx, cy, cz = body[c, 0], body[c, 1], body[c, 2]
        corners_out[leaf, 0, f], corners_out[leaf, 1, f], corners_out[leaf, 2, f] = ax, ay, az
        corners_out[leaf, 3, f], corners_out[leaf, 4, f], corners_out[leaf, 5, f] = bx, by, bz
        corners_out[leaf, 6, f], corners_out[leaf, 7, f], corners_out[leaf, 8, f] = cx, cy, cz
        bx, by, bz, cx, cy, cz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        area = np.sqrt(nx * nx + ny * ny + nz * nz)
        corners_out[leaf, 9, f] = np.float32(-1) if a == b and b == c else rounding * area + noise


@kernel
def exact_winding(corners, leaves, which, count, direction, point, rounding):
    """Computes the winding number of a point in float64, in which the side tests of float32 corners are exact.

    Reads: corners (leaves, 10, 8) [m], of leaves[which[:count]]: all that the ray may meet; direction: 0 to 5; point
        (3,) [m]; rounding [m].
    Returns: the winding number, and whether the point is within `rounding` of a face.
    """
    axis, u, v = direction % 3, (direction + 1) % 3, (direction + 2) % 3
    sign, winding, near = 1.0 if direction < 3 else -1.0, 0, False
    corner = np.empty((3, 3))
    for k in range(count):
        leaf = leaves[which[k]]
        for f in range(BLOCK):
            for i in range(3):
                for along in range(3):
                    corner[i, along] = np.float64(corners[leaf, 3 * i + along, f]) - np.float64(point[along])
            a, b, c = corner[0], corner[1], corner[2]
            turns, ab, bc, ca = crossing(a[u], a[v], b[u], b[v], c[u], c[v])
            if turns * sign * (bc * a[axis] + ca * b[axis] + ab * c[axis]) > 0:
                winding += np.int32(sign * turns)
            s, t = nearest_weights((a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2]))
            squared = 0.0
            for along in range(3):
                squared += ((1 - s - t) * a[along] + s * b[along] + t * c[along]) ** 2
            near |= squared <= np.float64(rounding) ** 2
    return winding, near


@kernel
def windings(points, ids, directions, skin, rounding, met_leaves, winding_out, touching_out):
    """Computes winding numbers with respect to the posed body, by rays along the direction of each vertex's group.

    Reads: points (points, 3) [m]; ids (points,): vertices that the points belong to, ascending; directions (groups,);
        skin; rounding [m].
    Writes: winding_out (points,); touching_out (points,): whether a point is within `rounding` of the surface, which no
        ray along an axis could tell at a silhouette; met_leaves: the `LeafCorners` of this frame.
    """
    corners, ready = met_leaves
    leaf_box, patch_start, patch_box = skin.leaf_box, skin.patch_start, skin.patch_box
    leaf_count, patch_count = leaf_box.shape[1], patch_box.shape[1]
    mask, taken = np.zeros((leaf_count + 7) // 8 * 8, np.uint8), np.zeros(6, np.bool_)
    buffers = mask, mask.view(np.uint64)
    patches, leaves = np.arange(patch_count), np.empty(leaf_count, np.int64)
    met, block_leaves = np.empty(leaf_count + 8, np.int64), np.empty(leaf_count, np.int64)
    hits = np.empty(leaf_count + 8, np.int64)
    patch_shafts = np.empty((6, 5, patch_count + 8), np.float32)
    group_shafts = np.empty((5, leaf_count + 8), np.float32)
    block_shafts, lanes = np.empty((5, leaf_count + 8), np.float32), np.empty((4, LANES), np.float32)
    box = np.empty(5, np.float32)
    begin = 0
    while begin < len(points):
        end, group = begin + 1, ids[begin] // GROUP
        while end < len(points) and ids[end] // GROUP == group:
            end += 1
        along = np.int64(directions[group])
        if not taken[along]:
            take_shafts(patch_box, patches, 0, patch_count, along, patch_shafts[along])
            taken[along] = True
        axis, u, v = along % 3, (along + 1) % 3, (along + 2) % 3
        sign = np.float32(1 if along < 3 else -1)
        near_end = _index(axis if along < 3 else axis + 3)
        group_box = block_box(points, begin, end, along, rounding)
        seen = list_hits(patch_shafts[along], patch_count, group_box, buffers, met)
        group_leaves = 0
        for k in range(seen):
            for leaf in range(patch_start[met[k]], patch_start[met[k] + 1]):
                leaves[group_leaves] = leaf
                group_leaves += 1
        take_shafts(leaf_box, leaves, 0, group_leaves, along, group_shafts)
        for first in range(begin, end, BLOCK):
            last = min(first + BLOCK, end)
            near, low_u, high_u, low_v, high_v = block_box(points, first, last, along, rounding)
            count = list_hits(group_shafts, group_leaves, (near, low_u, high_u, low_v, high_v), buffers, met)
            for k in range(count):
                leaf = leaves[met[k]]
                block_leaves[k] = leaf
                if not ready[leaf]:
                    gather_leaf(skin, _index(leaf), rounding, corners)
                    ready[leaf] = True
            take_shafts(leaf_box, block_leaves, 0, count, along, block_shafts)
            for lane in range(LANES):
                i = min(first + lane, last - 1)
                lanes[0, lane], lanes[1, lane], lanes[2, lane] = points[i, u], points[i, v], sign * points[i, axis]
                lanes[3, lane] = 0
            box[0], box[1], box[2], box[3], box[4] = near, low_u, high_u, low_v, high_v
            doubts, rays = np.int32(0), ShaftRays(axis, u, v, sign, rounding)
            for k in range(count):
                leaf = block_leaves[k]
                shaft_leaf = ShaftLeaf(leaf, k, sign * leaf_box[near_end, leaf])
                doubts |= add_crossings_of_leaf(corners, block_shafts, shaft_leaf, rays, box, lanes)
            for i in range(first, last):
                winding_out[i], touching_out[i] = np.int32(sign * lanes[3, i - first]), False
                if doubts >> (i - first) & 1:
                    x, y, z = points[i, u], points[i, v], sign * points[i, axis]
                    around = z - rounding, x - rounding, x + rounding, y - rounding, y + rounding
                    found = list_hits(block_shafts, count, around, buffers, hits)
                    winding_out[i], touching_out[i] = exact_winding(
                        corners, block_leaves, hits, found, along, points[i], rounding
                    )
        begin = end

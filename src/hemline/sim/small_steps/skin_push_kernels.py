"""Compiled: contact of point masses with a body that moves within a frame."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int
from hemline.collide.surface.box_kernels import BLOCK
from hemline.collide.surface.search_kernels import list_leaves, search_buffers
from hemline.collide.surface.search_lane_kernels import LANES, ROWS, SQUARED, VERTEX, nearest_of_leaves
from hemline.collide.surface.surface_kernels import (
    SkinPatches,
    interpolate_normal,
    point_on_face,
    walk,
)
from hemline.compiled import kernel

_index = np.uintp
SEARCH_STEPS, FOLLOW_STEPS = 12, 6
"""Faces that a walk passes at most, in the search of a frame and in a step."""
HIGH = np.float32(0.012)
"""Height over the skin above which a vertex is looked at only when it is followed along the skin [m]."""
EVERY = 4
"""Steps from one walk of a vertex along the skin to the next."""


class MovingBody(NamedTuple):
    """The skin in a frame."""

    before: SkinPatches
    """At the start of the frame."""
    after: SkinPatches
    """At its end."""
    now: SkinPatches
    """In between; kernels write its vertices."""


class SkinPlaces(NamedTuple):
    """Place on the skin next to each vertex; kernels write to all arrays."""

    faces: Int[np.ndarray, " verts"]
    """Face of the skin, -1 where none is near."""
    weights: Float[np.ndarray, "verts 2"]
    """Weights of its second and third corner."""
    heights: Float[np.ndarray, " verts"]
    """Height of the vertex over the skin [m]."""
    normals: Float[np.ndarray, "verts 3"]
    """Unit normal of the skin there."""
    listed: Int[np.ndarray, " verts"]
    """Vertices with a face come first."""


class PushSettings(NamedTuple):
    """Settings of contact."""

    thickness: np.float32
    """Distance that cloth keeps from the skin [m]."""
    near: np.float32
    """Distance from the skin up to which a vertex may touch it within the frame [m]."""
    release: np.float32
    """Depth that a vertex inside the body at the start of a step leaves within it with speed [m]."""


@kernel
def find_contact(skin, homes, points, near, contact):
    """Finds the face of the skin that is nearest to each vertex, at the start of a frame.

    A vertex inside the body stays with the face that it had at the end of the last frame, if there is one: the nearest
    face may belong to the other side of a limb, or to another limb that cuts through this one.

    Reads: skin; homes (verts,): vertex of the skin next to each vertex at rest; points (verts, 3) [m]; near: distance
        up to which faces are searched [m].
    Writes: contact: its faces on entry are those of the last frame; the skin's normals that were not known yet.
    Returns: The number of vertices that have a face.
    """
    body, ring_start, ring = skin.body, skin.ring_start, skin.ring
    buffers, lanes = search_buffers(skin), np.zeros((ROWS, LANES), np.float32)
    whole, far, squared_near, last, count = np.int32(-1), np.float32(np.inf), near * near, np.int64(-1), 0
    for begin in range(0, len(points), BLOCK):
        end, bound = min(begin + BLOCK, len(points)), np.float32(0)
        lx, ly, lz, hx, hy, hz = far, far, far, -far, -far, -far
        for k in range(end - begin):
            i = _index(begin + k)
            x, y, z, face = points[i, 0], points[i, 1], points[i, 2], contact.faces[i]
            v = _index(homes[i] if face < 0 else skin.faces[_index(face), 0])
            dx, dy, dz = body[v, 0] - x, body[v, 1] - y, body[v, 2] - z
            known, squared = v, dx * dx + dy * dy + dz * dz
            if last >= 0:
                v = _index(last)
                dx, dy, dz = body[v, 0] - x, body[v, 1] - y, body[v, 2] - z
                distance = dx * dx + dy * dy + dz * dz
                if distance < squared:
                    known, squared = v, distance
            lanes[0, k], lanes[1, k], lanes[2, k] = x, y, z
            lanes[SQUARED, k], lanes[VERTEX, k] = squared, np.float32(known)
            bound = max(bound, squared)
            lx, ly, lz, hx, hy, hz = min(lx, x), min(ly, y), min(lz, z), max(hx, x), max(hy, y), max(hz, z)
        low, high = (lx, ly, lz), (hx, hy, hz)
        if bound > squared_near and list_leaves(skin, whole, low, high, squared_near, buffers) == 0:
            for k in range(begin, end):
                contact.faces[_index(k)] = -1
            continue
        leaves = list_leaves(skin, whole, low, high, bound, buffers)
        nearest_of_leaves(skin, buffers[2], leaves, lanes)
        for k in range(end - begin):
            i = _index(begin + k)
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            last = np.int64(lanes[VERTEX, k])
            start = np.int64(ring[ring_start[_index(last)]])
            face, at_b, at_c, squared = walk(skin, start, np.int64(SEARCH_STEPS), x, y, z)
            px, py, pz = point_on_face(skin, face, at_b, at_c)
            nx, ny, nz = interpolate_normal(skin, face, at_b, at_c)
            inside = (x - px) * nx + (y - py) * ny + (z - pz) * nz < 0
            if inside and contact.faces[i] >= 0:
                face, at_b, at_c, squared = walk(skin, contact.faces[i], np.int64(SEARCH_STEPS), x, y, z)
            elif squared > squared_near and not inside:
                contact.faces[i] = -1
                continue
            contact.faces[i], contact.weights[i, 0], contact.weights[i, 1] = face, at_b, at_c
            contact.heights[i], contact.listed[count] = np.float32(0), i
            count += 1
    return count


@kernel
def move_skin(body, share):
    """Moves the skin to its place between the start and the end of a frame.

    Reads: body: the vertices of `MovingBody.before` and `after`; share: 0 to 1.
    Writes: the vertices of `now`.
    """
    before, after, now = body.before.body.reshape(-1), body.after.body.reshape(-1), body.now.body.reshape(-1)
    for number in range(len(now)):
        i = _index(number)
        now[i] = before[i] + share * (after[i] - before[i])


@kernel(forceinline=True)
def blend_normals(first, second, share):
    """Blends two unit normals.

    Reads: first, second (3); share of the second, 0 to 1.
    Returns: The three coordinates of a unit vector.
    """
    x, y, z = (
        first[0] + share * (second[0] - first[0]),
        first[1] + share * (second[1] - first[1]),
        first[2] + share * (second[2] - first[2]),
    )
    scale = np.float32(1) / max(np.sqrt(x * x + y * y + z * z), np.float32(1e-6))
    return x * scale, y * scale, z * scale


@kernel
def push_out(sheet, body, contact, count, times, settings, cloth):
    """Moves vertices out of the skin, with Coulomb friction along it.

    A vertex is followed along the skin in every fourth step; one that is high over it is looked at then only. Part of
    the depth of a vertex that was inside before this step leaves it without speed.

    Reads: sheet: a `SpringSheet`; body: a `MovingBody`; count: number of listed vertices; times: number of the step,
        and number of steps in the frame; settings: `PushSettings`.
    Writes: contact; cloth: positions and start of the step of `StepCloth`; normals of the skin.
    """
    (step, steps), positions, start = times, cloth.positions, cloth.start
    before, after, now = body.before, body.after, body.now
    faces, weights, normals, heights, listed = (
        contact.faces,
        contact.weights,
        contact.normals,
        contact.heights,
        contact.listed,
    )
    one, zero = np.float32(1), np.float32(0)
    share, part = np.float32(step + 1) / np.float32(steps), one / np.float32(steps)
    for k in range(count):
        turn = (step + k) % EVERY
        i = _index(listed[_index(k)])
        if turn != 0 and step > 0 and heights[i] > HIGH:
            continue
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        face, at_b, at_c = np.int64(faces[i]), weights[i, 0], weights[i, 1]
        if turn == 0 or step == 0:
            face, at_b, at_c, _ = walk(now, face, np.int64(FOLLOW_STEPS), x, y, z)
            first = interpolate_normal(before, face, at_b, at_c)
            second = interpolate_normal(after, face, at_b, at_c)
            faces[i], weights[i, 0], weights[i, 1] = face, at_b, at_c
            normals[i, 0], normals[i, 1], normals[i, 2] = blend_normals(first, second, share)
        px, py, pz = point_on_face(now, face, at_b, at_c)
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        height = (x - px) * nx + (y - py) * ny + (z - pz) * nz
        heights[i], push = height, settings.thickness - height
        if push <= 0 or sheet.inverse_masses[i] == 0:
            continue
        ax, ay, az = point_on_face(before, face, at_b, at_c)
        bx, by, bz = point_on_face(after, face, at_b, at_c)
        mx, my, mz = part * (bx - ax), part * (by - ay), part * (bz - az)
        ux, uy, uz = x - start[i, 0] - mx, y - start[i, 1] - my, z - start[i, 2] - mz
        along = ux * nx + uy * ny + uz * nz
        calm = max(min(max(push + along, zero), push) - settings.release, zero)
        ux, uy, uz = ux - along * nx, uy - along * ny, uz - along * nz
        slip, most = np.sqrt(ux * ux + uy * uy + uz * uz), sheet.friction[i] * (push - calm)
        held = one if slip <= most else most / slip
        start[i, 0] += calm * nx
        start[i, 1] += calm * ny
        start[i, 2] += calm * nz
        positions[i, 0] = x + push * nx - held * ux
        positions[i, 1] = y + push * ny - held * uy
        positions[i, 2] = z + push * nz - held * uz

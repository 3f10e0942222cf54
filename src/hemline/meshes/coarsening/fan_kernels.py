"""Compiled: the triangles around a vertex are put in order and laid flat."""

import math
from typing import Any, NamedTuple

import numpy as np

from hemline.compiled import kernel

MAX_FACES = 24
"""Largest number of faces around a vertex; a vertex with more is never removed."""


class Mesh(NamedTuple):
    """A triangle mesh that loses vertices: all arrays are changed in place."""

    faces: Any
    """int64 (faces, 3); the first corner is -1 where the face is gone."""
    lengths: Any
    """float64 (faces, 3): edge from each corner to the next, along the cloth [m]."""
    positions: Any
    """float64 (verts, 3) [m]; not changed."""
    quadrics: Any
    """float64 (verts, 10): squared distances to the planes that met there, weighted by area [m^4]."""
    bound: Any
    """int64 (verts,): bits of the sets that a vertex belongs to; it collapses only onto one that belongs to all of
    them."""
    rim: Any
    """bool (verts,): whether the vertex is on a rim."""
    around: Any
    """int64 (verts, MAX_FACES): faces around each vertex."""
    counts: Any
    """int64 (verts,): number of faces around each vertex."""


class Fan(NamedTuple):
    """The triangles around one vertex, counter-clockwise, laid flat with it at the origin."""

    faces: Any
    """int64 (MAX_FACES,): faces in order."""
    ring: Any
    """int64 (MAX_FACES + 1,): the other vertices; on a rim one more than faces."""
    flat: Any
    """float64 (MAX_FACES + 1, 2): where they lie [m]."""
    closed: Any
    """bool (1,): whether the fan is a full turn."""


@kernel
def corner_of(faces, face, vertex):
    """Finds the corner of a face at which a vertex is.

    Reads: faces (faces, 3); face; vertex.
    Returns: The corner, 0 to 2.
    """
    corner = 0
    while faces[face, corner] != vertex:
        corner += 1
    return corner


@kernel
def _begins(mesh, vertex, count):
    """Finds the first face of a fan.

    Reads: mesh; vertex; count: faces around the vertex.
    Returns: The place of the face among those around the vertex, or -1 for a vertex with several fans.
    """
    first, starts = 0, 0
    for i in range(count):
        face = mesh.around[vertex, i]
        ahead = mesh.faces[face, (corner_of(mesh.faces, face, vertex) + 1) % 3]
        before = 0
        for k in range(count):
            other = mesh.around[vertex, k]
            before += mesh.faces[other, (corner_of(mesh.faces, other, vertex) + 2) % 3] == ahead
        if before == 0:
            first = i
            starts += 1
        if before > 1:
            return -1
    return first if starts < 2 else -1


@kernel
def flatten_fan(mesh, vertex, fan):
    """Lays the triangles around a vertex flat by their edges; angles around an inner vertex are scaled to a full turn.

    Reads: mesh; vertex.
    Writes: fan.
    Returns: the number of faces, 0 if they are no fan.
    """
    count = mesh.counts[vertex]
    if count == 0 or count > MAX_FACES:
        return 0
    place = _begins(mesh, vertex, count)
    if place < 0:
        return 0
    spokes, angles = np.empty(count + 1), np.empty(count + 1)
    angles[0] = 0.0
    face = mesh.around[vertex, place]
    for i in range(count):
        corner = corner_of(mesh.faces, face, vertex)
        a, b, c = mesh.lengths[face, corner], mesh.lengths[face, (corner + 2) % 3], mesh.lengths[face, (corner + 1) % 3]
        ahead = mesh.faces[face, (corner + 2) % 3]
        fan.faces[i], fan.ring[i], fan.ring[i + 1] = face, mesh.faces[face, (corner + 1) % 3], ahead
        spokes[i], spokes[i + 1] = a, b
        angles[i + 1] = angles[i] + math.acos(min(max((a * a + b * b - c * c) / (2 * a * b), -1.0), 1.0))
        if i + 1 < count:
            face = -1
            for k in range(count):
                other = mesh.around[vertex, k]
                if mesh.faces[other, (corner_of(mesh.faces, other, vertex) + 1) % 3] == ahead:
                    face = other
            if face < 0 or face == fan.faces[0]:
                return 0
    fan.closed[0] = fan.ring[count] == fan.ring[0]
    scale = 2 * math.pi / angles[count] if fan.closed[0] else 1.0
    for i in range(count + 1):
        fan.flat[i, 0] = spokes[i] * math.cos(scale * angles[i])
        fan.flat[i, 1] = spokes[i] * math.sin(scale * angles[i])
    return count

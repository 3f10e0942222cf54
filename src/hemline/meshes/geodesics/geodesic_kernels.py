"""Compiled: distances over a triangle mesh are carried from triangle to triangle."""

import numpy as np

from hemline.compiled import kernel


@kernel
def front_distance(first, second, same_source, edge, to_first, to_second):
    """Computes the distance at the third corner of a triangle from the distances at its two other corners.

    The triangle is laid flat, with corners at (0, 0) and (edge, 0) and the third above. If both distances come from one
    source, it is a point below the edge; otherwise the front is straight. Where the path would leave the triangle, it
    runs along an edge.

    Reads: first, second: distances at the two corners [m]; same_source; edge: length between them; to_first, to_second:
        lengths from the third corner to each [m].
    Returns: the distance [m].
    """
    along = min(first + to_first, second + to_second)
    if edge <= 0.0:
        return along
    x = (to_first * to_first - to_second * to_second + edge * edge) / (2.0 * edge)
    height_squared = to_first * to_first - x * x
    if height_squared <= 0.0:
        return along
    y = np.sqrt(height_squared)
    if same_source:
        sx = (first * first - second * second + edge * edge) / (2.0 * edge)
        below_squared = first * first - sx * sx
        if below_squared < 0.0:
            return along
        sy = np.sqrt(below_squared)
        cross = sx + (x - sx) * sy / (sy + y)
        if cross < 0.0 or cross > edge:
            return along
        return min(along, np.sqrt((x - sx) ** 2 + (y + sy) ** 2))
    slope = (second - first) / edge
    if abs(slope) >= 1.0:
        return along
    rise = np.sqrt(1.0 - slope * slope)
    cross = x - y * slope / rise
    if cross < 0.0 or cross > edge:
        return along
    return min(along, first + slope * x + rise * y)


@kernel
def sweep_fronts(faces, lengths, order, face_start, face_list, source, distance):
    """Updates the distances of the vertices in `order` once; distances only fall.

    Reads: faces (faces, 3); lengths (faces, 3): edge opposite to each corner [m]; order; face_start, face_list: faces
        around each vertex.
    Writes: distance (verts,) [m]; source (verts,), negative for a straight front.
    Returns: the largest change [m].
    """
    largest = 0.0
    for vertex in order:
        for place in range(face_start[vertex], face_start[vertex + 1]):
            face = face_list[place]
            corner = 0
            while faces[face, corner] != vertex:
                corner += 1
            one, two = faces[face, (corner + 1) % 3], faces[face, (corner + 2) % 3]
            if not (np.isfinite(distance[one]) and np.isfinite(distance[two])):
                continue
            same = source[one] == source[two]
            to_one, to_two = lengths[face, (corner + 2) % 3], lengths[face, (corner + 1) % 3]
            found = front_distance(distance[one], distance[two], same, lengths[face, corner], to_one, to_two)
            if found < distance[vertex]:
                largest = max(largest, min(distance[vertex], 1e30) - found)
                distance[vertex] = found
                by_edge = found == distance[one] + to_one
                origin = source[one] if same or by_edge else source[two]
                # a vertex reached by a straight front has no source of its own: no circle may start from two such
                straight = not same and found < min(distance[one] + to_one, distance[two] + to_two)
                source[vertex] = -2 - vertex if straight or origin < 0 else origin
    return largest

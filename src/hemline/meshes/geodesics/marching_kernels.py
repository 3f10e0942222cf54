"""Compiled: fast marching over a triangle mesh from single vertices, and farthest-point sampling by it."""

import heapq

import numpy as np

from hemline.compiled import kernel

from .geodesic_kernels import front_distance


@kernel
def march(faces, lengths, face_start, face_list, start, radius, distance, reached_out):
    """Computes distances from one vertex up to `radius`, by fast marching with circular fronts.

    Each vertex that is settled, the nearest first, updates the ends of its edges and the far corners of its triangles.

    Reads: faces (faces, 3); lengths (faces, 3): edge opposite to each corner [m]; face_start, face_list: faces around
        each vertex; start: the vertex; radius [m].
    Writes: distance (verts,) [m], infinite before; reached_out (verts,): vertices whose distance was written, among
        them some beyond the radius.
    Returns: how many vertices were reached.
    """
    heap = [(0.0, np.int64(start))]
    distance[start] = 0.0
    reached_out[0] = start
    count = 1
    while len(heap) > 0:
        near, vertex = heapq.heappop(heap)
        if near > distance[vertex]:
            continue
        if near > radius:
            break
        for place in range(face_start[vertex], face_start[vertex + 1]):
            face = face_list[place]
            corner = 0
            while faces[face, corner] != vertex:
                corner += 1
            one, two = (corner + 1) % 3, (corner + 2) % 3
            for far, other in ((one, two), (two, one)):
                v, w = np.int64(faces[face, far]), np.int64(faces[face, other])
                found = near + lengths[face, other]
                if np.isfinite(distance[w]):
                    straight = front_distance(
                        near, distance[w], True, lengths[face, far], lengths[face, other], lengths[face, corner]
                    )
                    found = min(found, straight)
                if found < distance[v]:
                    if not np.isfinite(distance[v]):
                        reached_out[count] = v
                        count += 1
                    distance[v] = found
                    heapq.heappush(heap, (found, v))
    return count


@kernel
def sample_points(faces, lengths, face_start, face_list, first, points_out):
    """Samples vertices: each next point is the vertex farthest from all before it.

    Parts of the mesh that no point reaches yet count as farthest.

    Reads: faces, lengths, face_start, face_list: see `march`; first: number of points that are given in points_out.
    Writes: points_out (points,): vertex ids.
    """
    count = len(face_start) - 1
    nearest, distance = np.full(count, np.inf), np.full(count, np.inf)
    reached = np.empty(count, np.int64)
    for index in range(len(points_out)):
        if index >= first:
            points_out[index] = np.argmax(nearest)
        point = points_out[index]
        radius = nearest[np.argmax(nearest)]
        for k in range(march(faces, lengths, face_start, face_list, point, radius, distance, reached)):
            v = reached[k]
            nearest[v] = min(nearest[v], distance[v])
            distance[v] = np.inf


@kernel
def list_nearest(faces, lengths, face_start, face_list, points, radius, nearest_out, distances_out):
    """Finds the nearest few points for each vertex, ascending.

    Reads: faces, lengths, face_start, face_list: see `march`; points (points,): vertex ids; radius [m].
    Writes: nearest_out (verts, k): numbers of points, -1 for none; distances_out (verts, k) [m], infinite for none.
    """
    count, most = nearest_out.shape
    distance, reached = np.full(count, np.inf), np.empty(count, np.int64)
    nearest_out[:] = -1
    distances_out[:] = np.inf
    for index in range(len(points)):
        for k in range(march(faces, lengths, face_start, face_list, points[index], radius, distance, reached)):
            v = reached[k]
            place = most
            while place > 0 and distance[v] < distances_out[v, place - 1]:
                place -= 1
            for later in range(most - 1, place, -1):
                distances_out[v, later], nearest_out[v, later] = distances_out[v, later - 1], nearest_out[v, later - 1]
            if place < most:
                distances_out[v, place], nearest_out[v, place] = distance[v], index
            distance[v] = np.inf

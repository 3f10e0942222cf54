"""Cuts the body into nine closed parts: torso with head, upper arms, forearms with hands, thighs, shanks with feet."""

import functools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from hemline.arrays import Points, Vertices
from hemline.bodies.model import BodyModel
from hemline.motions import JOINT_NAMES

PART_ROOTS = (
    "pelvis",
    "left_shoulder",
    "left_elbow",
    "right_shoulder",
    "right_elbow",
    "left_hip",
    "left_knee",
    "right_hip",
    "right_knee",
)
"""The joint that each part hangs from."""

CREASE = 1.5
"""Distance from a cut, in radii of it, within which neighbours always touch and are not tested against each other."""


@dataclass(frozen=True, eq=False)
class BodyPart:
    """A part of the mesh, with its cuts closed by cones.

    Attributes:
        faces: Triangles of the part; indices from the number of vertices up are apexes of cones.
        rims: Vertices of each cut, whose mean is the apex, one array per cut.
        tested: Vertices of other parts, except those at the crease beside this one.
    """

    faces: Int[np.ndarray, "faces 3"]
    rims: tuple[Int[np.ndarray, " _rim"], ...]
    tested: Int[np.ndarray, " tested"]


@functools.lru_cache(maxsize=8)
def part_of_joint(body: BodyModel) -> tuple[int, ...]:
    """Returns the part that each joint belongs to."""
    parts: list[int] = []
    for joint, parent in enumerate(body.parents):
        name = JOINT_NAMES[joint]
        parts.append(PART_ROOTS.index(name) if name in PART_ROOTS else parts[parent])
    return tuple(parts)


@functools.lru_cache(maxsize=8)
def part_of_vertex(body: BodyModel) -> Int[np.ndarray, " verts"]:
    """Returns the part that moves each vertex most."""
    shares = np.zeros((len(body.template), len(PART_ROOTS)))
    columns = np.array(part_of_joint(body))[body.weight_indices]
    np.add.at(shares, (np.arange(len(shares))[:, None], columns), body.weights)
    return np.argmax(shares, axis=1)


@functools.lru_cache(maxsize=8)
def closed_parts(body: BodyModel) -> tuple[BodyPart, ...]:
    """Returns all parts of a body, in the order of `PART_ROOTS`."""
    part, apex = part_of_vertex(body), len(body.template)
    # a triangle belongs to the part of two of its corners
    owners = np.median(part[body.faces], axis=1).astype(np.int64)
    parts = []
    for index in range(len(PART_ROOTS)):
        faces = body.faces[owners == index]
        caps, rims = _caps(faces, apex)
        apex += len(rims)
        near = np.any([at_crease(body.template, rim, body.template) for rim in rims], axis=0)
        tested = np.flatnonzero((part != index) & ~near).astype(np.int32)
        parts.append(BodyPart(np.concatenate([faces, caps]).astype(np.int32), rims, tested))
    return tuple(parts)


def _caps(faces: np.ndarray, first_apex: int) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Returns triangles from each boundary edge to the apex of its cut, and the vertices of each cut."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    ahead, back = edges[:, 0] * first_apex + edges[:, 1], edges[:, 1] * first_apex + edges[:, 0]
    open_edges = edges[~np.isin(back, ahead)]
    count = first_apex + 1
    graph = coo_array((np.ones(len(open_edges)), tuple(open_edges.T)), shape=(count, count))
    labels = connected_components(graph, directed=False)[1][open_edges[:, 0]]
    names, cut = np.unique(labels, return_inverse=True)
    caps = np.column_stack([open_edges[:, 1], open_edges[:, 0], first_apex + cut])
    return caps, tuple(np.unique(open_edges[cut == index]).astype(np.int32) for index in range(len(names)))


def at_crease(vertices: Vertices, rim: Int[np.ndarray, " rim"], points: Points) -> Bool[np.ndarray, " points"]:
    """Returns a mask of the points within `CREASE` radii of a cut.

    Args:
        vertices: The body at rest [m].
        rim: Vertices of the cut, from `Part.rims`.
        points: Any points at rest [m].
    """
    centre = vertices[rim].mean(axis=0)
    radius = np.linalg.norm(vertices[rim] - centre, axis=1).mean()
    return np.linalg.norm(points - centre, axis=1) < CREASE * radius

"""A body's surface cut into leaves of eight faces, and leaves into patches: the search structure of the kernels."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.errors import BadBody

from .box_kernels import LEAF

if TYPE_CHECKING:
    from hemline.bodies import Body, ShapedBody

PATCH_SIZE = 0.13
"""Longest diagonal of a patch at rest [m]; larger patches certify fewer vertices."""


@dataclass(frozen=True)
class Patches:
    """The surface in leaves and patches, its vertices renumbered so that neighbours lie together in memory."""

    order: Int[np.ndarray, " verts"]
    """Renumbered vertex to vertex of the body."""
    number: Int[np.ndarray, " verts"]
    """Vertex of the body to renumbered vertex."""
    faces: Faces
    """Renumbered triangles, `LEAF` a leaf; short leaves are filled with points (v, v, v)."""
    leaf_start: Int[np.ndarray, " leaves_and_one"]
    """Where each leaf's vertices begin in `leaf_vertices`."""
    leaf_vertices: Int[np.ndarray, " leaf_vertices"]
    """Vertices of each leaf, each once."""
    patch_start: Int[np.ndarray, " patches_and_one"]
    """Where each patch's leaves begin."""
    patch_limb: Int[np.ndarray, " patches"]
    """Limb that each patch belongs to."""
    leaf_limb: Int[np.ndarray, " leaves"]
    """Limb that each leaf belongs to."""
    ring_start: Int[np.ndarray, " verts_and_one"]
    """Where each vertex's incident faces begin in `ring`."""
    ring: Int[np.ndarray, " ring"]
    """Faces around each vertex."""
    across: Int[np.ndarray, "faces 3"]
    """The face over each edge ab, bc, ca; itself where there is none."""
    limb: Int[np.ndarray, " verts"]
    """Limb of each renumbered vertex."""


def make_patches(shaped: "ShapedBody") -> Patches:
    """Cuts a body's surface into leaves and patches: by bone, then by halving along the longest axis.

    Args:
        shaped: The body. Only rest vertices, faces, skin weights and parents are used.

    Raises:
        BadBody: The mesh is not closed, so that inside and outside are not defined.
    """
    faces = np.ascontiguousarray(shaped.body.faces, np.int64)
    _check_closed(faces)
    bone = dominant_joints(shaped.body.weight_indices, shaped.body.weights)
    face_bone = bone[faces].min(axis=1)
    middle = shaped.vertices[faces].mean(axis=1)
    patches = [
        part for each in np.unique(face_bone) for part in _split(middle, np.flatnonzero(face_bone == each), False)
    ]
    leaves = [[leaf for leaf in _split(middle, patch, True)] for patch in patches]
    flat = [leaf for patch in leaves for leaf in patch]
    limb = limbs(shaped.body.parents)
    order, number = _renumber(faces[np.concatenate(flat)], len(shaped.vertices))
    faces = number[faces]
    unique = [np.unique(faces[leaf]) for leaf in flat]
    filled = np.concatenate([_fill_leaf(faces[leaf]) for leaf in flat])
    ring_start, ring = _rings(filled, len(order))
    patch_limb = limb[face_bone[[patch[0] for patch in patches]]].astype(np.int32)
    return Patches(
        order=order.astype(np.int32),
        number=number.astype(np.int32),
        faces=filled.astype(np.int32),
        leaf_start=_starts([len(each) for each in unique]),
        leaf_vertices=np.concatenate(unique).astype(np.int32),
        patch_start=_starts([len(patch) for patch in leaves]),
        patch_limb=patch_limb,
        leaf_limb=np.repeat(patch_limb, [len(patch) for patch in leaves]),
        ring_start=ring_start,
        ring=ring,
        across=_across(filled),
        limb=limb[bone[order]].astype(np.int32),
    )


def dominant_joints(
    weight_indices: Int[np.ndarray, "verts 6"], weights: Float[np.ndarray, "verts 6"]
) -> Int[np.ndarray, " verts"]:
    """Returns the joint with the largest skin weight at each vertex."""
    return np.take_along_axis(weight_indices, weights.argmax(axis=1)[:, None], axis=1)[:, 0].astype(np.int64)


def limb_of_vertices(body: "Body") -> Int[np.ndarray, " verts"]:
    """Returns the index of the limb of each vertex of a body: the limb of the joint that moves it most."""
    return limbs(body.parents)[dominant_joints(body.weight_indices, body.weights)]


def limbs(parents: Int[np.ndarray, " joints"]) -> Int[np.ndarray, " joints"]:
    """Returns the limb of each joint, named by its first joint; where the tree forks, the longest branch continues it.

    Branches that are equally long each begin a limb of their own. The 24-joint skeleton has trunk, legs, arms and head.

    Args:
        parents: Parent of each joint, below its own number; the root's is negative or itself.
    """
    count = len(parents)
    below = np.ones(count, np.int64)
    for joint in range(count - 1, 0, -1):
        below[parents[joint]] += below[joint]
    limb = np.zeros(count, np.int64)
    for joint in range(1, count):
        siblings = [below[other] for other in range(1, count) if parents[other] == parents[joint]]
        continues = below[joint] == max(siblings) and siblings.count(below[joint]) == 1
        limb[joint] = limb[parents[joint]] if continues else joint
    return limb


def _check_closed(faces: np.ndarray) -> None:
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    key = np.sort(directed, axis=1) @ np.array([1 << 32, 1])
    _, edge = np.unique(key, return_inverse=True)
    balance = np.bincount(edge, np.where(directed[:, 0] < directed[:, 1], 1, -1))
    if balance.any():
        raise BadBody(
            "the projection needs a closed body mesh",
            f"{int(np.count_nonzero(balance))} edges with a face on one side only",
            "close its holes",
        )


def _split(middle: np.ndarray, faces: np.ndarray, to_leaves: bool) -> list[np.ndarray]:
    """Halves a set of faces along its longest axis until it is a leaf, or small enough for a patch."""
    extent = np.ptp(middle[faces], axis=0)
    if len(faces) <= LEAF or (not to_leaves and np.linalg.norm(extent) <= PATCH_SIZE):
        return [faces]
    half = LEAF * max(1, round(len(faces) / 2 / LEAF))
    half = half if half < len(faces) else LEAF
    ranked = faces[np.argsort(middle[faces, extent.argmax()], kind="stable")]
    return _split(middle, ranked[:half], to_leaves) + _split(middle, ranked[half:], to_leaves)


def _renumber(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns the vertices in the order in which faces name them, and the inverse of that order."""
    used, first = np.unique(faces.reshape(-1), return_index=True)
    order = np.concatenate([used[np.argsort(first)], np.setdiff1d(np.arange(count), used)])
    number = np.empty(count, np.int64)
    number[order] = np.arange(count)
    return order, number


def _fill_leaf(leaf: np.ndarray) -> np.ndarray:
    """Returns a leaf filled up to `LEAF` faces with points (v, v, v)."""
    return np.concatenate([leaf, np.full((LEAF - len(leaf), 3), leaf[0, 0])])


def _starts(counts: list[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)


def _rings(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns the faces around each vertex; faces that only fill a leaf are skipped."""
    real = np.flatnonzero(faces[:, 0] != faces[:, 1])
    corner = faces[real].reshape(-1)
    rank = np.argsort(corner, kind="stable")
    return _starts(list(np.bincount(corner, minlength=count))), real[rank // 3].astype(np.int32)


def _across(faces: np.ndarray) -> np.ndarray:
    """Returns the face on the other side of each edge; where parts touch, one in which the edge runs the other way."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    scale = int(faces.max()) + 1
    key, opposite = edges @ [scale, 1], edges @ [1, scale]
    rank = np.argsort(key, kind="stable")
    found = rank[np.minimum(np.searchsorted(key, opposite, sorter=rank), len(key) - 1)]
    own = np.arange(len(key)) // 3
    return np.where(key[found] == opposite, found // 3, own).reshape(-1, 3).astype(np.int32)


def vertex_blocks(vertices: Vertices, size: int) -> Int[np.ndarray, " verts"]:
    """Orders a garment's vertices so that each run of `size` is a compact block, by halving along the longest axis."""
    blocks, queue = [], [np.arange(len(vertices))]
    while queue:
        block = queue.pop()
        if len(block) <= size:
            blocks.append(block)
            continue
        half = size * max(1, round(len(block) / 2 / size))
        half = half if half < len(block) else size
        ranked = block[np.argsort(vertices[block, np.ptp(vertices[block], axis=0).argmax()], kind="stable")]
        queue += [ranked[half:], ranked[:half]]
    return np.concatenate(blocks)

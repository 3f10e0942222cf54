"""Chains that a garment names itself."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.animators.ropes.bones.embedding import NodeEmbedding
from hemline.arrays import Float, Int, Nodes
from hemline.errors import BadGarment
from hemline.meshes import geodesic_distances

from .plan import BonePlan, neighbours_of

if TYPE_CHECKING:
    from hemline.garments.garment import Garment


def chains_by_hand(garment: "Garment") -> BonePlan:
    """Returns a plan of the chains that a garment names.

    Raises:
        BadGarment: A chain names a vertex that does not exist, or fewer than two; or chains cross.
    """
    used = [np.asarray(chain, np.int64) for chain in garment.chains]
    for chain in used:
        if len(chain) < 2 or chain.min() < 0 or chain.max() >= len(garment.vertices):
            got = chain.tolist()[:8]
            what = f"garment '{garment.name}': a chain names two vertices or more, below {len(garment.vertices)}"
            raise BadGarment(what, got, "correct the chains")
    offsets = np.concatenate([[0], np.cumsum([len(chain) for chain in used])]).astype(np.int32)
    distances = _cloth_distances(garment, np.concatenate(used))
    _check_crossing(garment, offsets, distances)
    following = np.arange(1, len(distances))
    lengths = np.concatenate([[0.0], distances[following - 1, following]])
    lengths[offsets[:-1]] = 0.0
    pairs = neighbours_of(offsets, _goes_round(distances[np.ix_(offsets[:-1], offsets[:-1])]))
    across = distances[pairs[:, 0], pairs[:, 1]]
    joined = np.isfinite(across)  # infinite between pieces of cloth
    return BonePlan(NodeEmbedding.at_vertices(np.concatenate(used)), offsets, lengths, pairs[joined], across[joined])


def _check_crossing(
    garment: "Garment", offsets: Int[np.ndarray, " chains_and_one"], distances: Float[np.ndarray, "nodes nodes"]
) -> None:
    """Refuses chains that cross.

    Of the three ways to join four points of a sheet in two pairs, the one whose lines cross is the longest in total.
    """
    ends = np.setdiff1d(np.arange(1, offsets[-1]), offsets)
    chain = np.searchsorted(offsets, ends, side="right")
    one, two = (index.ravel() for index in np.meshgrid(ends, ends, indexing="ij"))
    apart = (chain[:, None] < chain).ravel()
    one, two = one[apart], two[apart]
    both = distances[one - 1, one] + distances[two - 1, two]
    beside, across = (
        distances[one - 1, two - 1] + distances[one, two],
        distances[one - 1, two] + distances[one, two - 1],
    )
    crossed = np.flatnonzero(both > 1.001 * np.maximum(beside, across))
    if len(crossed):
        which = (np.searchsorted(offsets, [one[crossed[0]], two[crossed[0]]], side="right") - 1).tolist()
        raise BadGarment(f"garment '{garment.name}': chains must not cross", f"chains {which}", "correct the chains")


def check_downward(garment: "Garment", offsets: Int[np.ndarray, " chains_and_one"], rest: Nodes) -> None:
    """Refuses chains that end above their roots.

    Raises:
        BadGarment: The lowest bone of a chain is not below its root.
    """
    upward = np.flatnonzero(rest[offsets[1:] - 1, 1] >= rest[offsets[:-1], 1])
    if len(upward):
        what = f"garment '{garment.name}': a chain hangs from its first vertex"
        raise BadGarment(what, f"chain {upward[0]} ends above it", "give the pinned end first")


def _cloth_distances(garment: "Garment", vertices: Int[np.ndarray, " nodes"]) -> Float[np.ndarray, "nodes nodes"]:
    """Returns shortest distances in the flat cloth from vertex to vertex [m]."""
    from_each = [
        geodesic_distances(garment.vertices, garment.faces, vertices[i : i + 1], rest_edges=garment.rest_edges)
        for i in range(len(vertices))
    ]
    return np.stack([distance[vertices] for distance in from_each])


def _goes_round(distances: Float[np.ndarray, "chains chains"]) -> bool:
    """Returns whether chains go all around, as on a skirt: the last root is as near to the first as neighbours."""
    return bool(distances[-1, 0] <= 1.5 * np.diagonal(distances, 1).max(initial=0.0))

"""Chains through scattered bones, for garments on which no lines run down from one rim to the hem.

A skinning decomposition of simulated frames puts a bone wherever cloth moves on its own, on every piece of the garment.
From the lowest bones upward, each bone is joined to the nearest one above it, until the cloth hangs from the body.
"""

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Int, Vertices
from hemline.garments.upper_rim import upper_rim
from hemline.meshes import components, geodesic_distances, rigid_bones

from .lines import SSDR_VERTICES

if TYPE_CHECKING:
    from hemline.garments.garment import Garment

_VERTICES_OF_A_BONE = 4
"""Least number of vertices of the decomposition for each bone."""
_PASSES = 2
"""Passes of the decomposition after its clustering; more of them refine weights, which are not used here."""
_REACH = 2.0
"""Farthest distance along the cloth to the bone above, over the spacing of the bones."""
_RISE = 0.25
"""Least distance by which the bone above is nearer to what the cloth hangs from, over the spacing of the bones."""
_STRAIGHTNESS = 2.0
"""Cost of a bone that is farther away than it is higher, relative to the cost of its distance."""
_HIGHEST_PERCENT = 97.0
"""A piece of cloth without pins and without a rim hangs from the vertices above this percentile of its heights."""


class ScatteredChains(NamedTuple):
    """Chains as vertices of the garment, root first."""

    chains: tuple[Int[np.ndarray, " _bones"], ...]
    """Vertex ids of each chain."""
    lengths: Float[np.ndarray, " nodes"]
    """Length of the cloth from each bone to the one above it, 0 for roots, chain by chain [m]."""
    pairs: Int[np.ndarray, "pairs 2"]
    """Neighbouring bones of different chains, counted chain by chain."""
    pair_lengths: Float[np.ndarray, " pairs"]
    """Length of the cloth between them [m]."""


def scattered_chains(garment: "Garment", rest: Vertices, frames: FramesOfVertices, count: int) -> ScatteredChains:
    """Joins the bones of a skinning decomposition to chains.

    Args:
        garment: The garment.
        rest: The settled drape [m].
        frames: Simulated vertices, frame by frame, relative to the key joint [m].
        count: Number of bones, roots not counted; fewer on a mesh of few vertices.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 3: bones by SSDR, "interconnected vertically". The paper does not say how.
    """
    area = float(np.abs(np.linalg.det(garment.rest_edges)).sum()) / 2
    spacing = np.sqrt(area / count)
    seeds = suspension_by_piece(garment)
    depth = _distances(garment, seeds)
    places = _bone_vertices(np.asarray(rest, np.float64), frames, count)
    places = places[np.isfinite(depth[places]) & (depth[places] > 0.5 * spacing)]
    if not len(places):  # a garment that is hardly larger than its rim has one bone where it hangs lowest
        places = np.array([int(np.where(np.isfinite(depth), depth, -1).argmax())])
    rows = np.array([_distances(garment, np.array([place])) for place in places])
    chains = _join(depth[places], rows[:, places], spacing)
    roots = [int(seeds[rows[chain[0]][seeds].argmin()]) for chain in chains]
    lengths = [
        np.array([0.0, rows[chain[0]][root], *(rows[one][places[two]] for one, two in pairwise(chain))])
        for chain, root in zip(chains, roots, strict=True)
    ]
    pairs, pair_lengths = _nearest_pairs(chains, rows[:, places], _REACH * spacing)
    vertices = tuple(np.array([root, *places[chain]]) for chain, root in zip(chains, roots, strict=True))
    return ScatteredChains(vertices, np.concatenate(lengths), pairs, pair_lengths)


def suspension_by_piece(garment: "Garment") -> Int[np.ndarray, " seeds"]:
    """Returns the vertices that each piece of a garment hangs from: its pinned ones, or else its upper rim."""
    part = components(garment.faces, len(garment.vertices))
    seeds = []
    for piece in np.unique(part[garment.faces[:, 0]]):
        own = garment.pins.vertices[part[garment.pins.vertices] == piece]
        if not len(own):
            own = upper_rim(garment.vertices, garment.faces[part[garment.faces[:, 0]] == piece])
        if not len(own):
            inside = np.flatnonzero(part == piece)
            heights = garment.vertices[inside, 1]
            own = inside[heights >= np.percentile(heights, _HIGHEST_PERCENT)]
        seeds.append(own)
    return np.unique(np.concatenate(seeds))


def _distances(garment: "Garment", sources: Int[np.ndarray, " some"]) -> Float[np.ndarray, " verts"]:
    return geodesic_distances(garment.vertices, garment.faces, sources, rest_edges=garment.rest_edges)


def _bone_vertices(rest: np.ndarray, frames: FramesOfVertices, count: int) -> Int[np.ndarray, " bones"]:
    """Returns the vertex nearest to the middle of the cloth that follows each bone of a decomposition."""
    some = np.linspace(0, len(rest) - 1, min(SSDR_VERTICES, len(rest))).astype(int)
    bones = rigid_bones(
        rest[some], frames[:, some], max(1, min(count, len(some) // _VERTICES_OF_A_BONE)), passes=_PASSES, travels=True
    )
    chosen = []
    for weights in bones.weights.T:
        follows = np.flatnonzero(weights > 0.5 * weights.max(initial=1e-12))
        if len(follows) and weights.max() > 0:
            middle = weights[follows] @ rest[some[follows]] / weights[follows].sum()
            chosen.append(some[follows[np.linalg.norm(rest[some[follows]] - middle, axis=1).argmin()]])
    return np.unique(chosen)


def _join(
    depth: Float[np.ndarray, " bones"], apart: Float[np.ndarray, "bones bones"], spacing: float
) -> list[list[int]]:
    """Joins bones to chains, each bone to a free one above it that is near and not aside; the highest is first."""
    free = np.ones(len(depth), bool)
    chains = []
    for tip in np.argsort(-depth, kind="stable"):
        if not free[tip]:
            continue
        free[tip] = False
        chain = [int(tip)]
        while True:
            here = chain[-1]
            above = free & (depth < depth[here] - _RISE * spacing) & (apart[here] < _REACH * spacing)
            if not above.any():
                break
            aside = apart[here] - (depth[here] - depth)
            chain.append(int(np.where(above, apart[here] + _STRAIGHTNESS * aside, np.inf).argmin()))
            free[chain[-1]] = False
        chains.append(chain[::-1])
    return chains


def _nearest_pairs(
    chains: list[list[int]], apart: Float[np.ndarray, "bones bones"], reach: float
) -> tuple[Int[np.ndarray, "pairs 2"], Float[np.ndarray, " pairs"]]:
    """Pairs each bone with the nearest bone of another chain within reach; counts bones chain by chain, roots too."""
    order = np.concatenate(chains)
    owner = np.repeat(np.arange(len(chains)), [len(chain) for chain in chains])
    number = np.arange(len(order)) + owner + 1
    between = np.where(owner[:, None] == owner, np.inf, apart[np.ix_(order, order)])
    nearest = between.argmin(axis=1)
    near = np.flatnonzero(between[np.arange(len(order)), nearest] < reach)
    both = np.unique(np.sort(np.stack([near, nearest[near]], axis=1), axis=1), axis=0)
    return number[both].astype(np.int32).reshape(-1, 2), between[both[:, 0], both[:, 1]]

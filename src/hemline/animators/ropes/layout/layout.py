"""Building of rope chains: along geodesics from rim to hem, by hand, or through the bones of a decomposition.

Each vertex gets two coordinates: the geodesic distance d from the rim, and the place u on the rim where the shortest
path starts. Along a line of constant u the distance d is arc length, so a chain is a line of constant u, and the
longest distance between two of its bones is their difference in d.
"""

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.bones.embedding import Carriage, NodeEmbedding
from hemline.animators.ropes.mechanics.balance import drape_balance
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains, spans_and_directions
from hemline.arrays import Float, FramesOfVertices, Int, Nodes, Vertices
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.errors import BadGarment, BadInput
from hemline.meshes import geodesic_distances

from .lines import ChainLines, even_lines, ssdr_lines
from .scattered import scattered_chains, suspension_by_piece
from .unroll import UnrolledGarment

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments.garment import Garment


_TAUT_RATIO = 0.75
"""A rope is taut at rest if its span is at least this fraction of the length of its cloth; then it cannot lengthen."""
_UPWARD_LIMIT = 1 / 3
"""Fraction of the chains that may end above their roots."""
_JUMP_RATIO, _JUMP, _JUMPS_LIMIT = 1.25, 0.01, 0.02
"""A chain jumps where its bones are farther apart than their distance along the cloth, by that ratio and length [m];
at most that fraction of the bones may."""
_FAR_SPACINGS, _BARE_LIMIT = 3.0, 0.1
"""Distance from all bones, over their mean spacing, beyond which at most that fraction of the cloth may lie."""
_CLEARANCE_SLACK = 0.002
"""Distance by which each bone may come nearer to the body than at rest [m]."""


class _Plan(NamedTuple):
    """Places and lengths of the bones: first those on no chain, which the body carries, then chain by chain."""

    embedding: NodeEmbedding
    offsets: Int[np.ndarray, " chains_and_one"]
    lengths: Float[np.ndarray, " nodes"]
    pairs: Int[np.ndarray, "pairs 2"]
    pair_lengths: Float[np.ndarray, " pairs"]


def build_ropes(
    garment: "Garment",
    shaped: "ShapedBody",
    *,
    rest: Vertices | None = None,
    chain_count: int = 10,
    bone_counts: tuple[int, int] = (13, 15),
    strain_p99: float = 0.02,
    constants: RopeConstants | None = None,
    frames: FramesOfVertices | None = None,
    scattered: bool = False,
) -> Ropes:
    """Builds chains on a garment, or takes its own (`garment.chains`), and binds the kinematic bones to the body.

    Args:
        garment: Mesh, pins and material; its rest metric gives the lengths.
        shaped: The body that `rest` was settled on, in the shape that the garment was made on.
        rest: The settled drape in the body's rest pose; the garment's own start positions unless given [m].
        chain_count: Number of chains.
        bone_counts: Usual numbers of bones of a chain, root included. No chain has fewer than the first number; a
            chain of average length has the mean of both, and a long one may have more than the second.
        strain_p99: 99th percentile of the stretch of the cloth; ropes are longer by this ratio [1].
        constants: Constants of the chains; None: those of the garment's material, in air.
        frames: Simulated vertices, frame by frame, relative to the key joint [m]. Their skinning decomposition gives
            the places of the bones. None: bones lie along geodesic lines at even distances.
        scattered: Whether the bones of the decomposition stay where it puts them, instead of on lines from the rim to
            the hem. This works for any garment, see `scattered_chains`.

    Raises:
        BadInput: The garment has too few vertices for the bones of the decomposition, or there are no frames for it.
        BadGarment: The pinned rim has no length; a chain of the garment names a vertex that does not exist, or fewer
            than two; its chains cross or end above where they begin; or the counts are invalid.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 3 and Fig. 2. Differs: the default is geodesic lines; the paper's layouts, by hand or
        by skinning decomposition, are options.
    """
    if chain_count < 1 or not 2 <= bone_counts[0] <= bone_counts[1] or not 0 <= strain_p99 < 1:
        raise BadGarment(
            "this layout cannot be made",
            (chain_count, bone_counts, strain_p99),
            "ask for 1 chain or more of 2 bones or more",
        )
    vertices = np.asarray(garment.vertices if rest is None else rest, np.float64)
    if scattered and frames is None:
        raise BadInput("a decomposition needs simulated frames", "none", "give frames, or lay chains along geodesics")
    if garment.chains:
        plan = _by_hand(garment)
        _check_downward(garment, plan.offsets, plan.embedding.positions_on(vertices))
    elif scattered and frames is not None:
        plan = _scattered(garment, vertices, frames, round(chain_count * (float(np.mean(bone_counts)) - 1)))
    else:
        unrolled = UnrolledGarment(garment)
        plan = _along_lines(
            unrolled,
            even_lines(unrolled, chain_count, bone_counts)
            if frames is None
            else ssdr_lines(unrolled, vertices, frames, chain_count, bone_counts),
        )
    return _assemble_ropes(garment, shaped, vertices, plan, strain_p99, constants)


def _assemble_ropes(
    garment: "Garment",
    shaped: "ShapedBody",
    vertices: Vertices,
    plan: _Plan,
    strain: float,
    constants: RopeConstants | None,
) -> Ropes:
    rest = plan.embedding.positions_on(vertices)
    spans, directions = spans_and_directions(rest, plan.offsets)
    taut = spans >= _TAUT_RATIO * plan.lengths
    lengths = np.where(taut, spans, plan.lengths * (1 + strain))
    pairs = plan.pairs
    pair_rest = np.linalg.norm(rest[pairs[:, 0]] - rest[pairs[:, 1]], axis=1)
    masses = _masses(garment, vertices, rest)
    kinematic = np.concatenate([np.arange(plan.offsets[0]), plan.offsets[:-1]])
    carriage = Carriage.of(rest[kinematic], shaped)
    roots = carriage.weights[len(kinematic) - len(plan.offsets) + 1 :]
    primitives = BodyPrimitives.fit(shaped)
    clearances, _ = primitives.distances(rest, np.tile(np.eye(4)[:3], (len(shaped.joints), 1, 1)))
    balance, tensions = drape_balance(plan.offsets, directions, masses, taut)
    chains = RopeChains(
        plan.offsets,
        lengths,
        masses,
        spans,
        directions,
        roots.argmax(1).astype(np.int32),
        pairs,
        np.column_stack([pair_rest, np.maximum(plan.pair_lengths * (1 + strain), pair_rest)]),
        clearances - _CLEARANCE_SLACK,
        balance,
        tensions,
        constants or RopeConstants.of_material(garment.material),
    )
    betas = np.asarray(shaped.betas, np.float64)
    return Ropes(chains, plan.embedding, carriage, rest, primitives, betas, garment.key_joint)


def _by_hand(garment: "Garment") -> _Plan:
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
    pairs = _neighbours(offsets, _goes_round(distances[np.ix_(offsets[:-1], offsets[:-1])]))
    across = distances[pairs[:, 0], pairs[:, 1]]
    joined = np.isfinite(across)  # infinite between pieces of cloth
    return _Plan(NodeEmbedding.at_vertices(np.concatenate(used)), offsets, lengths, pairs[joined], across[joined])


def _scattered(garment: "Garment", vertices: Vertices, frames: FramesOfVertices, count: int) -> _Plan:
    found = scattered_chains(garment, vertices, frames, count)
    offsets = np.concatenate([[0], np.cumsum([len(chain) for chain in found.chains])]).astype(np.int32)
    embedding = NodeEmbedding.at_vertices(np.concatenate(found.chains))
    return _Plan(embedding, offsets, found.lengths, found.pairs, found.pair_lengths)


def layout_fault(garment: "Garment", ropes: Ropes) -> str | None:
    """Says why chains on geodesic lines do not suit a garment: they end above their roots, jump, or miss much of it.

    A line from the neck that runs into a sleeve has the same place on the rim, and the same distance from it, as a line
    down the side. Where sleeves branch off, chains along geodesics jump between the two.

    Args:
        garment: The garment.
        ropes: Its ropes.

    Returns:
        The reason; None if they suit it.
    """
    offsets = ropes.chains.offsets
    upward = int((ropes.rest[offsets[1:] - 1, 1] >= ropes.rest[offsets[:-1], 1]).sum())
    if upward > _UPWARD_LIMIT * (len(offsets) - 1):
        return f"{upward} of {len(offsets) - 1} chains end above their roots"
    depth = geodesic_distances(
        garment.vertices, garment.faces, suspension_by_piece(garment), rest_edges=garment.rest_edges
    )
    depths = (depth[ropes.embedding.corners] * ropes.embedding.barycentric).sum(axis=1)
    free = np.flatnonzero(ropes.parents >= 0)
    jumps = int((ropes.chains.rest_spans[free] > _JUMP_RATIO * np.abs(depths[free] - depths[free - 1]) + _JUMP).sum())
    if jumps > _JUMPS_LIMIT * len(free):
        return f"at {jumps} of {len(free)} bones a chain jumps to other cloth"
    bones = ropes.embedding.corners[np.arange(ropes.node_count), ropes.embedding.barycentric.argmax(axis=1)]
    away = geodesic_distances(garment.vertices, garment.faces, bones, rest_edges=garment.rest_edges)
    areas = np.abs(np.linalg.det(garment.rest_edges)) / 2
    spacing = np.sqrt(areas.sum() / ropes.node_count)
    bare = float(areas[away[garment.faces].mean(axis=1) > _FAR_SPACINGS * spacing].sum() / areas.sum())
    if bare > _BARE_LIMIT:
        return f"{100 * bare:.0f} % of the cloth is farther than {_FAR_SPACINGS * spacing:.2f} m from all bones"
    return None


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


def _check_downward(garment: "Garment", offsets: Int[np.ndarray, " chains_and_one"], rest: Nodes) -> None:
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


def _along_lines(unrolled: UnrolledGarment, lines: ChainLines) -> _Plan:
    places, offsets = lines.places, lines.offsets
    lengths = np.concatenate([np.zeros(len(lines.between)), *(np.diff(line, prepend=0.0) for line in lines.depths)])
    pairs = _neighbours(offsets, unrolled.rim.closed)
    return _Plan(unrolled.embedding(places), offsets, lengths, pairs, unrolled.lengths_across(places, pairs))


def _neighbours(offsets: Int[np.ndarray, " chains_and_one"], closed: bool) -> Int[np.ndarray, "pairs 2"]:
    """Pairs each free bone with the bone of the next chain at the same fraction of its length."""
    chains = [np.arange(first, last) for first, last in pairwise(offsets)]
    following = list(pairwise(chains))
    if closed and len(chains) > 2:
        following.append((chains[-1], chains[0]))
    pairs = [
        (one[k], two[round(k * (len(two) - 1) / (len(one) - 1))]) for one, two in following for k in range(1, len(one))
    ]
    return np.array(pairs, np.int32).reshape(-1, 2)


def _masses(garment: "Garment", vertices: Vertices, rest: Nodes) -> Float[np.ndarray, " nodes"]:
    """Returns the mass of the cloth that is nearest to each bone [kg]."""
    from scipy.spatial import KDTree

    areas = np.abs(np.linalg.det(garment.rest_edges)) / 2
    owner = KDTree(rest).query(vertices[garment.faces].mean(1))[1]
    masses = np.bincount(owner, areas * garment.densities, minlength=len(rest))
    return np.maximum(masses, 0.1 * masses.mean())

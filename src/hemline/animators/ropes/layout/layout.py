"""Building of rope chains: along geodesics from rim to hem, by hand, or through the bones of a decomposition.

Each vertex gets two coordinates: the geodesic distance d from the rim, and the place u on the rim where the shortest
path starts. Along a line of constant u the distance d is arc length, so a chain is a line of constant u, and the
longest distance between two of its bones is their difference in d.
"""

from typing import TYPE_CHECKING

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.bones.embedding import Carriage, NodeEmbedding
from hemline.animators.ropes.mechanics.balance import drape_balance
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains, spans_and_directions
from hemline.arrays import Float, FramesOfVertices, Nodes, Vertices
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.errors import BadGarment, BadInput

from .by_hand import chains_by_hand, check_downward
from .lines import ChainLines, even_lines, ssdr_lines
from .plan import BonePlan, FramesInKey, follows_body, neighbours_of
from .scattered import scattered_chains
from .unroll import UnrolledGarment

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments.garment import Garment


_TAUT_RATIO = 0.75
"""A rope is taut at rest if its span is at least this fraction of the length of its cloth; then it cannot lengthen."""
_CLEARANCE_SLACK = 0.002
"""Distance by which each bone may come nearer to the body than at rest [m]."""


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
    carry: FramesInKey | None = None,
    least_swing: float = 0.03,
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
        carry: Simulated frames. Bones on cloth that follows the body in them, as on a bodice or a sleeve, are carried
            by the body, and chains begin where cloth leaves it. None: chains begin at the rim. The chains of a garment
            stay as they are.
        least_swing: See `plan.follows_body`; with 0, chains begin at the rim [m].

    Raises:
        BadInput: The garment has too few vertices for the bones of the decomposition, or there are no frames for it.
        BadGarment: The pinned rim has no length; a chain of the garment names a vertex that does not exist, or fewer
            than two; its chains cross or end above where they begin; or the counts are invalid.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 3 and Fig. 2. Differs: the default is geodesic lines; the paper's layouts, by hand or
        by skinning decomposition, are options; and the body carries the bones of cloth that follows it.
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
        plan = chains_by_hand(garment)
        check_downward(garment, plan.offsets, plan.embedding.positions_on(vertices))
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
    if carry is not None and not garment.chains:
        plan = plan.carry(follows_body(plan, vertices, carry, shaped, least_swing))
    return _assemble_ropes(garment, shaped, vertices, plan, strain_p99, constants)


def _assemble_ropes(
    garment: "Garment",
    shaped: "ShapedBody",
    vertices: Vertices,
    plan: BonePlan,
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


def _scattered(garment: "Garment", vertices: Vertices, frames: FramesOfVertices, count: int) -> BonePlan:
    found = scattered_chains(garment, vertices, frames, count)
    offsets = np.concatenate([[0], np.cumsum([len(chain) for chain in found.chains])]).astype(np.int32)
    embedding = NodeEmbedding.at_vertices(np.concatenate(found.chains))
    return BonePlan(embedding, offsets, found.lengths, found.pairs, found.pair_lengths)


def _along_lines(unrolled: UnrolledGarment, lines: ChainLines) -> BonePlan:
    places, offsets = lines.places, lines.offsets
    lengths = np.concatenate([np.zeros(len(lines.between)), *(np.diff(line, prepend=0.0) for line in lines.depths)])
    pairs = neighbours_of(offsets, unrolled.rim.closed)
    return BonePlan(unrolled.embedding(places), offsets, lengths, pairs, unrolled.lengths_across(places, pairs))


def _masses(garment: "Garment", vertices: Vertices, rest: Nodes) -> Float[np.ndarray, " nodes"]:
    """Returns the mass of the cloth that is nearest to each bone [kg]."""
    from scipy.spatial import KDTree

    areas = np.abs(np.linalg.det(garment.rest_edges)) / 2
    owner = KDTree(rest).query(vertices[garment.faces].mean(1))[1]
    masses = np.bincount(owner, areas * garment.densities, minlength=len(rest))
    return np.maximum(masses, 0.1 * masses.mean())

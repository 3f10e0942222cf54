"""Fitted ropes as spring bones: their constants, capsules as colliders, and the bones of each vertex of the garment."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from hemline.animators.ropes import Ropes
from hemline.arrays import Float, Int, Nodes, Vertices
from hemline.bodies.body import PosedBody
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.export import CapsuleColliders, SpringChains
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, PARENTS

FRAME_SECONDS = 1 / 60
"""Length of the frame for which the constants of spring bones are computed [s]."""
DOWNWARD_FRACTION = 0.5
"""Fraction of the weight that always pulls downwards; the rest pulls along the drape and turns with the body."""
_AIR_SPEED = 1.0
"""Speed at which the drag of the air, which grows with its square, is linearised [m/s]."""
_LEAST_RADIUS = 0.005
"""Least radius of a capsule [m]."""
_TRUNK = ("pelvis", "spine1", "spine2", "spine3")


def spring_chains(ropes: Ropes, nodes: Nodes, capsules: CapsuleColliders) -> tuple[SpringChains, CapsuleColliders]:
    r"""Returns the chains with constants of spring bones, and capsules thin enough that no bone starts inside one.

    In each frame a spring bone moves its end by $(1 - D)\,\Delta x + \Delta t\,(S\,r + G\,g)$ and projects it onto the
    sphere of its length; $r$ is the direction at rest, turned with the bone above. At 60 frames a second:

    $$S_i + G_i = |g|\,\Delta t + k_i \ell_i, \quad G_i = |g|\,\Delta t / 2, \quad
      D_i = 1 - \exp(-(c + c_a v + (c_p + k_i) / i)\,\Delta t)$$

    with $i$ the number of bones from the root, $\ell_i$ the rope's length, $c$ the drag, $c_a$ the drag of the air at
    $v$ = 1 m/s, $c_p$ the damping against the bone above and $k_i = k e^{1 - i}$ that near the root. The velocity of
    a bone relative to the one above is $1/i$ of its own where the chain swings as one straight line.

    Args:
        ropes: Fitted ropes.
        nodes: All bones of the ropes, with the garment settled on the body of the capsules [m].
        capsules: Capsules of the body in that pose.

    Differs: VRM has no masses, no springs or damping between neighbours, no friction, no lift and no slack
        ropes: these constants are dropped.
    """
    constants, first = ropes.constants, int(ropes.chains.offsets[0])
    bones, offsets = nodes[first:], ropes.chains.offsets - first
    depth = np.concatenate([np.arange(last - start) for start, last in pairwise(offsets.tolist())])
    below = np.maximum(depth, 1)
    lengths = np.where(depth > 0, np.linalg.norm(np.diff(bones, axis=0, prepend=bones[:1]), axis=1), 0.0)
    near_root = constants.root_damping * np.exp(1.0 - below)
    rate = constants.drag + constants.air_drag * _AIR_SPEED + (constants.parent_damping + near_root) / below
    weight = float(np.linalg.norm(constants.gravity)) * FRAME_SECONDS
    free = depth > 0
    away = distances(capsules, bones[free])
    radii = np.maximum(np.minimum(capsules.radii, away.min(axis=0)), _LEAST_RADIUS)
    clear = (away - radii).min(axis=1)
    bone_radii = np.zeros(len(bones))
    bone_radii[free] = np.clip(clear, 0.0, constants.margin)
    chains = SpringChains(
        bones=bones,
        offsets=offsets,
        joints=np.array([_trunk(joint) for joint in ropes.chains.chain_joints.tolist()], np.int32),
        stiffness=(1 - DOWNWARD_FRACTION) * weight + near_root * lengths,
        gravity=np.full(len(bones), DOWNWARD_FRACTION * weight),
        drag=1 - np.exp(-rate * FRAME_SECONDS),
        radii=bone_radii,
    )
    return chains, replace(capsules, radii=radii)


def _trunk(joint: int) -> int:
    """Returns the joint of the trunk that carries a joint, so that a chain hangs down even if an arm is raised."""
    while JOINT_NAMES[joint] not in _TRUNK:
        joint = PARENTS[joint]
    return joint


def capsules_of(posed: PosedBody) -> CapsuleColliders:
    """Returns the rounded cones that ropes collide with as capsules of their mean radius, in a pose."""
    primitives, transforms = BodyPrimitives.fit(posed.shaped), np.asarray(posed.transforms, np.float64)[:, None]
    turns = transforms[primitives.joints, 0]
    starts, ends = (
        np.einsum("prc,pc->pr", turns[..., :3], primitives.shapes[:, at : at + 3]) + turns[..., 3] for at in (0, 3)
    )
    return CapsuleColliders(primitives.joints, starts, ends, primitives.shapes[:, 6:8].mean(axis=1))


def distances(capsules: CapsuleColliders, points: Nodes) -> Float[np.ndarray, "nodes capsules"]:
    """Returns the distances of points to the axes of capsules [m]."""
    return _distance_to_segments(points, capsules.starts, capsules.ends)[0]


def chain_weights(ropes: Ropes, vertices: Vertices) -> tuple[Int[np.ndarray, "verts 4"], Float[np.ndarray, "verts 4"]]:
    """Returns the bones of each vertex: those of the nearest chain, and of the nearer of the chains beside it.

    Between two chains the weights depend on the distances to both. Along a chain a vertex follows the rope beside it,
    and half-way to the next rope both equally; along the first rope it follows the root more, the higher it is.

    Args:
        ropes: The ropes.
        vertices: The garment as it was made, before draping, where no fold is close to another [m].

    Returns:
        The four bones of the largest weights (joints 0 to 23, then the bones of the chains), and those weights.
    """
    chains, nodes = ropes.chains, ropes.positions_on(vertices)
    every = np.arange(len(vertices))
    beside = np.empty((len(chains.offsets) - 1, len(vertices)))
    along = np.empty_like(beside)
    for chain, (start, last) in enumerate(pairwise(chains.offsets.tolist())):
        away, fraction = _distance_to_segments(vertices, nodes[start : last - 1], nodes[start + 1 : last])
        rope = away.argmin(axis=1)
        beside[chain], along[chain] = away[every, rope], rope + fraction[every, rope]
    one = beside.argmin(axis=0)
    other = _nearer_neighbour(beside, one, _is_ring(ropes))
    near, far = beside[one, every], beside[other, every]
    of_one = np.where(other == one, 1.0, far / np.maximum(near + far, 1e-12))
    weights = np.zeros((len(vertices), JOINT_COUNT + len(nodes) - int(chains.offsets[0])))
    roots = ropes.carriage.weights[-len(beside) :]
    for chain, chain_weight in ((one, of_one), (other, 1 - of_one)):
        swinging = np.minimum(along[chain, every], 1.0)
        weights[:, :JOINT_COUNT] += (chain_weight * (1 - swinging))[:, None] * roots[chain]
        _add_weights(weights, chains.offsets, chain, along[chain, every], chain_weight * swinging)
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    largest = np.take_along_axis(weights, bones, axis=1)
    return bones.astype(np.int32), largest / largest.sum(axis=1, keepdims=True)


def _distance_to_segments(
    points: Float[np.ndarray, "points 3"], starts: Float[np.ndarray, "lines 3"], ends: Float[np.ndarray, "lines 3"]
) -> tuple[Float[np.ndarray, "points lines"], Float[np.ndarray, "points lines"]]:
    """Returns the distances of points to line segments, and the parameter of the closest point, from 0 to 1."""
    axis = ends - starts
    to = np.asarray(points, np.float64)[:, None] - starts
    fraction = np.clip((to * axis).sum(-1) / np.maximum((axis * axis).sum(-1), 1e-18), 0.0, 1.0)
    return np.linalg.norm(to - fraction[..., None] * axis, axis=-1), fraction


def _is_ring(ropes: Ropes) -> bool:
    """Whether the chains form a ring, the last one beside the first."""
    chain = np.searchsorted(ropes.chains.offsets, ropes.chains.pairs, side="right") - 1
    return bool((np.abs(chain[:, 0] - chain[:, 1]) > 1).any())


def _nearer_neighbour(beside: np.ndarray, one: np.ndarray, closed: bool) -> Int[np.ndarray, " verts"]:
    """Returns the nearer of the two chains beside the nearest one; that one itself where there is none."""
    count = len(beside)
    sides = np.stack([one - 1, one + 1])
    sides = sides % count if closed else np.where((sides < 0) | (sides >= count), one, sides)
    away = np.where(sides == one, np.inf, np.take_along_axis(beside, sides, axis=0))
    return np.take_along_axis(sides, away.argmin(axis=0)[None], axis=0)[0]


def _add_weights(
    weights: np.ndarray, offsets: np.ndarray, chain: np.ndarray, along: np.ndarray, chain_weight: np.ndarray
) -> None:
    """Adds the weights of a chain's bones; `along` counts ropes from the root."""
    first, ropes_in = JOINT_COUNT + offsets[chain] - offsets[0], np.diff(offsets)[chain] - 1
    middle = np.clip(along - 0.5, 0.0, ropes_in - 1)
    upper = np.minimum(middle.astype(int), np.maximum(ropes_in - 2, 0))
    lower = np.minimum(upper + 1, ropes_in - 1)
    part = middle - upper
    every = np.arange(len(chain))
    np.add.at(weights, (every, first + upper), chain_weight * (1 - part))
    np.add.at(weights, (every, first + lower), chain_weight * part)

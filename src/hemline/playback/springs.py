"""Fitted ropes in the words of spring bones: numbers, capsules, and which bones a vertex of the garment follows."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from hemline.animators.ropes import Ropes
from hemline.arrays import Float, Int, Nodes, Vertices
from hemline.bodies.body import PosedBody
from hemline.collide.primitives.proxy import BodyProxy
from hemline.export import CapsuleColliders, SpringChains
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, PARENTS

FRAME_SECONDS = 1 / 60
"""A spring bone's numbers are per frame; ours are for this one [s]."""
DOWNWARD_FRACTION = 0.5
"""Share of the weight that pulls downwards whatever the body does; the rest pulls along the drape and turns with it."""
_SPEED = 1.0
"""Speed through the air at which its drag, which grows with the square, is taken [m/s]."""
_THINNEST = 0.005
_TRUNK = ("pelvis", "spine1", "spine2", "spine3")


def spring_chains(ropes: Ropes, nodes: Nodes, capsules: CapsuleColliders) -> tuple[SpringChains, CapsuleColliders]:
    r"""The chains with a spring bone's numbers, and the capsules thin enough that no bone begins inside one.

    A spring bone moves its end by $(1 - D)\,\Delta x + \Delta t\,(S\,r + G\,g)$ a frame and puts it back on the sphere
    of its length; $r$ is the direction at rest, turned with the bone above. At 60 frames a second:

    $$S_i + G_i = |g|\,\Delta t + k_i \ell_i, \quad G_i = |g|\,\Delta t / 2, \quad
      D_i = 1 - \exp(-(c + c_a v + (c_p + k_i) / i)\,\Delta t)$$

    with $i$ the bones from the root, $\ell_i$ the rope's length, $c$ the drag, $c_a$ that of the air at $v$ = 1 m/s,
    $c_p$ the damping against the bone above and $k_i = k e^{1 - i}$ that near the root. A bone's velocity against the
    one above is $1/i$ of its own where the chain swings as one straight line.

    Args:
        ropes: Fitted ropes.
        nodes: All their bones where the garment hangs settled on the body of the capsules [m].
        capsules: The body, in that pose.

    Differs: VRM has no masses, no springs or damping between neighbours, no friction, no lift and no ropes that get
        slack: these constants are left out.
    """
    constants, first = ropes.constants, int(ropes.chains.offsets[0])
    bones, offsets = nodes[first:], ropes.chains.offsets - first
    depth = np.concatenate([np.arange(last - start) for start, last in pairwise(offsets.tolist())])
    below = np.maximum(depth, 1)
    lengths = np.where(depth > 0, np.linalg.norm(np.diff(bones, axis=0, prepend=bones[:1]), axis=1), 0.0)
    near_root = constants.root_damping * np.exp(1.0 - below)
    rate = constants.drag + constants.air_drag * _SPEED + (constants.parent_damping + near_root) / below
    weight = float(np.linalg.norm(constants.gravity)) * FRAME_SECONDS
    free = depth > 0
    away = distances(capsules, bones[free])
    radii = np.maximum(np.minimum(capsules.radii, away.min(axis=0)), _THINNEST)
    clear = (away - radii).min(axis=1)
    kept = np.zeros(len(bones))
    kept[free] = np.clip(clear, 0.0, constants.margin)
    chains = SpringChains(
        bones=bones,
        offsets=offsets,
        joints=np.array([_trunk(joint) for joint in ropes.chains.chain_joints.tolist()], np.int32),
        stiffness=(1 - DOWNWARD_FRACTION) * weight + near_root * lengths,
        gravity=np.full(len(bones), DOWNWARD_FRACTION * weight),
        drag=1 - np.exp(-rate * FRAME_SECONDS),
        radii=kept,
    )
    return chains, replace(capsules, radii=radii)


def _trunk(joint: int) -> int:
    """The joint itself, or the one of the trunk that it hangs on: a chain hangs down whether an arm does or not."""
    while JOINT_NAMES[joint] not in _TRUNK:
        joint = PARENTS[joint]
    return joint


def capsules_of(posed: PosedBody) -> CapsuleColliders:
    """The rounded cones that ropes collide with, each as a capsule of its mean radius, in a pose."""
    proxy, transforms = BodyProxy.fit(posed.shaped), np.asarray(posed.transforms, np.float64)[:, None]
    turns = transforms[proxy.joints, 0]
    starts, ends = (
        np.einsum("prc,pc->pr", turns[..., :3], proxy.shapes[:, at : at + 3]) + turns[..., 3] for at in (0, 3)
    )
    return CapsuleColliders(proxy.joints, starts, ends, proxy.shapes[:, 6:8].mean(axis=1))


def distances(capsules: CapsuleColliders, points: Nodes) -> Float[np.ndarray, "nodes capsules"]:
    """Distance of points to the axes [m]."""
    return _distance_to_segments(points, capsules.starts, capsules.ends)[0]


def chain_weights(ropes: Ropes, vertices: Vertices) -> tuple[Int[np.ndarray, "verts 4"], Float[np.ndarray, "verts 4"]]:
    """The bones that each vertex follows: those of the nearest chain, and of the nearer chain beside it.

    Between two chains a vertex is shared by its distances to them. Along a chain it follows the rope that it is beside,
    and half-way to the next one both alike; along the first rope more and more, the higher it is, what the root does.

    Args:
        ropes: The ropes.
        vertices: The garment as it was made, before it draped: there no fold is near another [m].

    Returns:
        Bones (the 24 joints, then those of the chains) and weights, the largest four.
    """
    chains, nodes = ropes.chains, ropes.embedded(vertices)
    every = np.arange(len(vertices))
    beside = np.empty((len(chains.offsets) - 1, len(vertices)))
    along = np.empty_like(beside)
    for chain, (start, last) in enumerate(pairwise(chains.offsets.tolist())):
        away, share = _distance_to_segments(vertices, nodes[start : last - 1], nodes[start + 1 : last])
        rope = away.argmin(axis=1)
        beside[chain], along[chain] = away[every, rope], rope + share[every, rope]
    one = beside.argmin(axis=0)
    other = _nearer_neighbour(beside, one, _is_ring(ropes))
    near, far = beside[one, every], beside[other, every]
    of_one = np.where(other == one, 1.0, far / np.maximum(near + far, 1e-12))
    weights = np.zeros((len(vertices), JOINT_COUNT + len(nodes) - int(chains.offsets[0])))
    roots = ropes.carriage.weights[-len(beside) :]
    for chain, share in ((one, of_one), (other, 1 - of_one)):
        swinging = np.minimum(along[chain, every], 1.0)
        weights[:, :JOINT_COUNT] += (share * (1 - swinging))[:, None] * roots[chain]
        _add_weights(weights, chains.offsets, chain, along[chain, every], share * swinging)
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    largest = np.take_along_axis(weights, bones, axis=1)
    return bones.astype(np.int32), largest / largest.sum(axis=1, keepdims=True)


def _distance_to_segments(
    points: Float[np.ndarray, "points 3"], starts: Float[np.ndarray, "lines 3"], ends: Float[np.ndarray, "lines 3"]
) -> tuple[Float[np.ndarray, "points lines"], Float[np.ndarray, "points lines"]]:
    """Distance of points to stretches of line, and where along each the nearest place is, from 0 to 1."""
    way = ends - starts
    to = np.asarray(points, np.float64)[:, None] - starts
    share = np.clip((to * way).sum(-1) / np.maximum((way * way).sum(-1), 1e-18), 0.0, 1.0)
    return np.linalg.norm(to - share[..., None] * way, axis=-1), share


def _is_ring(ropes: Ropes) -> bool:
    """Whether the last chain is a neighbour of the first one."""
    chain = np.searchsorted(ropes.chains.offsets, ropes.chains.pairs, side="right") - 1
    return bool((np.abs(chain[:, 0] - chain[:, 1]) > 1).any())


def _nearer_neighbour(beside: np.ndarray, one: np.ndarray, closed: bool) -> Int[np.ndarray, " verts"]:
    """The chain beside the nearest one that is nearer; itself where there is none."""
    count = len(beside)
    sides = np.stack([one - 1, one + 1])
    sides = sides % count if closed else np.where((sides < 0) | (sides >= count), one, sides)
    away = np.where(sides == one, np.inf, np.take_along_axis(beside, sides, axis=0))
    return np.take_along_axis(sides, away.argmin(axis=0)[None], axis=0)[0]


def _add_weights(
    weights: np.ndarray, offsets: np.ndarray, chain: np.ndarray, along: np.ndarray, share: np.ndarray
) -> None:
    """Add the bones that vertices beside a chain follow; `along` counts ropes from its root, `share` is theirs."""
    first, ropes_in = JOINT_COUNT + offsets[chain] - offsets[0], np.diff(offsets)[chain] - 1
    middle = np.clip(along - 0.5, 0.0, ropes_in - 1)
    upper = np.minimum(middle.astype(int), np.maximum(ropes_in - 2, 0))
    lower = np.minimum(upper + 1, ropes_in - 1)
    part = middle - upper
    every = np.arange(len(chain))
    np.add.at(weights, (every, first + upper), share * (1 - part))
    np.add.at(weights, (every, first + lower), share * part)

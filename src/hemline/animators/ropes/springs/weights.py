"""The bones of each vertex of a garment on spring bones."""

from itertools import pairwise

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.arrays import Float, Int, Vertices
from hemline.motions.motion import JOINT_COUNT
from hemline.springs import distances_to_axes


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
        away, fraction = distances_to_axes(vertices, nodes[start : last - 1], nodes[start + 1 : last])
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

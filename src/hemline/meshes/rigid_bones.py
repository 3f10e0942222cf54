"""Rigid bones of a mesh that moves: smooth skinning decomposition."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Vertices
from hemline.errors import BadInput

from .shares import best_shares

_GROUPINGS = 6
"""Rounds of clustering before weights are fitted."""
_CANDIDATES = 8
"""Bones that a vertex chooses its few from: those that fit it best alone."""
_SHARE_ROUNDS = 60
"""Steps of each fit of weights; the next pass goes on from there."""


class RigidBones(NamedTuple):
    """Bones whose linear blend skinning moves a mesh as it moved."""

    weights: Float[np.ndarray, "verts bones"]
    """Their shares in each vertex, float64, sum 1, most of them 0."""
    turns: Float[np.ndarray, "frames bones 3 3"]
    """Rotations from rest, float64."""
    shifts: Float[np.ndarray, "frames bones 3"]
    """Translations: x = R p + t [m]."""

    def vertices(self, rest: Vertices) -> FramesOfVertices:
        """The mesh in each frame, as linear blend skinning makes it [m]."""
        matrix = np.einsum("vb,fbij->fvij", self.weights, self.turns)
        return np.einsum("fvij,vj->fvi", matrix, rest) + np.einsum("vb,fbi->fvi", self.weights, self.shifts)


def rigid_bones(
    rest: Vertices, frames: FramesOfVertices, count: int, *, influences: int = 4, passes: int = 8
) -> RigidBones:
    """Decompose a moving mesh into rigid bones and sparse weights.

    Args:
        rest: The mesh at rest [m]; a sample of its vertices is enough to see where bones are.
        frames: The same vertices in frames [m].
        count: Bones.
        influences: Bones a vertex may follow.
        passes: Rounds of weights and transforms after the clustering.

    Raises:
        BadInput: No frames, or fewer vertices than three for each bone.

    Source: Le, Deng, "Smooth Skinning Decomposition with Rigid Bones", 2012: clusters that move rigidly, then weights
        and transforms in turn. Differs: clusters start at vertices that are farthest apart at rest and in motion;
        weights by an accelerated projected gradient over the bones that fit best alone.
    """
    if count < 1 or len(frames) < 1 or len(rest) < 3 * count:
        what = "a decomposition needs frames, and three vertices for each bone or more"
        raise BadInput(what, f"{len(frames)} frames, {len(rest)} vertices, {count} bones", "ask for fewer bones")
    rest, frames = np.asarray(rest, np.float64), np.asarray(frames, np.float64)
    bones = _clusters(rest, frames, count)
    for _ in range(passes):
        bones = _refitted(bones._replace(weights=_weights(rest, frames, bones, influences)), rest, frames)
    return bones


def _clusters(rest: np.ndarray, frames: np.ndarray, count: int) -> RigidBones:
    """Groups of vertices, each of which moves about as one rigid bone does."""
    ways = np.concatenate([rest[None], frames]).transpose(1, 0, 2).reshape(len(rest), -1)
    seeds = [int(np.argmax(((ways - ways.mean(0)) ** 2).sum(1)))]
    apart = [((ways - ways[seeds[0]]) ** 2).sum(1)]
    while len(seeds) < count:
        seeds.append(int(np.argmax(np.min(apart, axis=0))))
        apart.append(((ways - ways[seeds[-1]]) ** 2).sum(1))
    owner, still = np.argmin(apart, axis=0), np.broadcast_to(np.eye(3), (len(frames), count, 3, 3))
    for index in range(_GROUPINGS + 1):
        bones = RigidBones(np.eye(count)[owner], still.copy(), np.zeros((len(frames), count, 3)))
        bones = _refitted(bones, rest, frames)
        if index == _GROUPINGS:
            break
        errors = _errors(rest, frames, bones)
        owner = errors.argmin(1)
        left_alone = np.flatnonzero(np.bincount(owner, minlength=count) == 0)
        owner[np.argsort(-errors.min(1))[: len(left_alone)]] = left_alone  # where the others fit worst
    return bones


def _errors(rest: np.ndarray, frames: np.ndarray, bones: RigidBones) -> Float[np.ndarray, "verts bones"]:
    """Sum over the frames of the square distance of each vertex to where each bone alone would put it [m^2]."""
    found = np.zeros(bones.weights.shape)
    for turns, shifts, vertices in zip(bones.turns, bones.shifts, frames, strict=True):
        found += ((_each(rest, turns, shifts) - vertices[:, None]) ** 2).sum(2)
    return found


def _each(rest: np.ndarray, turns: np.ndarray, shifts: np.ndarray) -> Float[np.ndarray, "verts bones 3"]:
    """Where each bone alone would put each vertex in a frame [m]."""
    count = len(turns)
    return (rest @ turns.reshape(3 * count, 3).T).reshape(len(rest), count, 3) + shifts


def _weights(rest: np.ndarray, frames: np.ndarray, bones: RigidBones, influences: int) -> np.ndarray:
    """The best sparse shares of the bones where they are (Eq. 3 to 6)."""
    errors, verts = _errors(rest, frames, bones), np.arange(len(rest))[:, None]
    count = errors.shape[1]
    near = np.argpartition(errors, min(_CANDIDATES, count) - 1, axis=1)[:, :_CANDIDATES]
    start = np.take_along_axis(bones.weights, near, axis=1) + 1e-3
    for last in (False, True):
        shares = _fitted(rest, frames, bones, near, start / start.sum(1, keepdims=True))
        if not last:
            kept = np.argsort(-shares, axis=1, kind="stable")[:, :influences]
            near, start = np.take_along_axis(near, kept, axis=1), np.take_along_axis(shares, kept, axis=1)
    weights = np.zeros_like(errors)
    weights[verts, near] = shares
    return weights


def _fitted(rest: np.ndarray, frames: np.ndarray, bones: RigidBones, near: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Least squares in shares of given bones."""
    square, along = np.zeros((*near.shape, near.shape[1])), np.zeros(near.shape)
    for turns, shifts, vertices in zip(bones.turns, bones.shifts, frames, strict=True):
        made = np.take_along_axis(_each(rest, turns, shifts), near[:, :, None], axis=1) - rest[:, None]
        square += made @ np.swapaxes(made, 1, 2)
        along += np.einsum("vka,va->vk", made, vertices - rest)
    return best_shares(square, along, start, rounds=_SHARE_ROUNDS)


def _refitted(bones: RigidBones, rest: np.ndarray, frames: np.ndarray) -> RigidBones:
    """The transforms, bone by bone: each moves rigidly what the others leave over (Eq. 7 to 10)."""
    weights, turns, shifts = bones
    left = frames - bones.vertices(rest)
    for bone in range(weights.shape[1]):
        held = np.flatnonzero(weights[:, bone] > 0)
        if not len(held):
            continue
        w, p = weights[held, bone][:, None], rest[held]
        before = w * (p @ np.swapaxes(turns[:, bone], 1, 2) + shifts[:, bone, None])
        wanted = left[:, held] + before
        turns[:, bone], shifts[:, bone] = _rigid(p, wanted, w)
        left[:, held] = wanted - w * (p @ np.swapaxes(turns[:, bone], 1, 2) + shifts[:, bone, None])
    return bones


def _rigid(points: np.ndarray, wanted: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """R and t of each frame that minimise the sum of |w (R p + t) - q|^2.

    Source: Kabsch, "A Solution for the Best Rotation to Relate Two Sets of Vectors", 1976.
    """
    total = (weights**2).sum()
    middle, middle_wanted = (weights**2 * points).sum(0) / total, (weights * wanted).sum(1) / total
    moments = np.einsum("fvi,vj->fij", wanted - weights * middle_wanted[:, None], weights * (points - middle))
    u, _, vt = np.linalg.svd(moments)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    turns = u @ vt
    return turns, middle_wanted - turns @ middle

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
        held = np.concatenate([self.weights[:, None] * rest[:, :, None], self.weights[:, None]], axis=1)
        ways = np.concatenate([self.turns.transpose(3, 1, 0, 2), self.shifts.transpose(1, 0, 2)[None]])
        made = held.reshape(len(rest), -1) @ ways.reshape(held.shape[1] * held.shape[2], -1)
        return np.ascontiguousarray(made.reshape(len(rest), -1, 3).swapaxes(0, 1))


def rigid_bones(
    rest: Vertices, frames: FramesOfVertices, count: int, *, influences: int = 4, passes: int = 8, travels: bool = False
) -> RigidBones:
    """Decompose a moving mesh into rigid bones and sparse weights.

    Args:
        rest: The mesh at rest [m]; a sample of its vertices is enough to see where bones are.
        frames: The same vertices in frames [m].
        count: Bones.
        influences: Bones a vertex may follow.
        passes: Rounds of weights and transforms after the clustering.
        travels: The mesh goes or turns far from its rest, in many frames; see `weighted`.

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
    bones = _clusters(rest, frames, count, travels)
    for _ in range(passes):
        bones = _refitted(weighted(bones, rest, frames, influences=influences, travels=travels), rest, frames)
    return bones


def _clusters(rest: np.ndarray, frames: np.ndarray, count: int, travels: bool) -> RigidBones:
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
        errors = _Fit.of(rest, frames, bones).errors if travels else _errors(rest, frames, bones)
        owner = errors.argmin(1)
        left_alone = np.flatnonzero(np.bincount(owner, minlength=count) == 0)
        owner[np.argsort(-errors.min(1))[: len(left_alone)]] = left_alone  # where the others fit worst
    return bones


def _errors(rest: np.ndarray, frames: np.ndarray, bones: RigidBones) -> Float[np.ndarray, "verts bones"]:
    """Sum over the frames of the square distance of each vertex to where each bone alone would put it [m^2].

    Frame by frame, without the rounding of `_Fit.errors`: among bones that fit alike, the same one is chosen for all.
    """
    found = np.zeros((len(rest), bones.turns.shape[1]))
    for turns, shifts, vertices in zip(bones.turns, bones.shifts, frames, strict=True):
        made = (rest @ turns.reshape(-1, 3).T).reshape(*found.shape, 3) + shifts
        found += ((made - vertices[:, None]) ** 2).sum(2)
    return found


class _Fit(NamedTuple):
    """Sums over frames of products of y, where a bone alone puts a vertex, x, where it was, and p, its rest [m^2]."""

    alone: Float[np.ndarray, "verts bones"]
    """Of y with itself."""
    seen: Float[np.ndarray, "verts bones"]
    """Of y with x."""
    still: Float[np.ndarray, " verts"]
    """Of x with itself."""
    alone_rest: Float[np.ndarray, "verts bones"]
    """Of y with p."""
    seen_rest: Float[np.ndarray, " verts"]
    """Of x with p."""
    rest: Float[np.ndarray, " verts"]
    """Of p with itself."""

    @classmethod
    def of(cls, rest: np.ndarray, frames: np.ndarray, bones: RigidBones) -> "_Fit":
        """The sums: products of matrices, in which no frame is visited twice."""
        count, verts = bones.turns.shape[1], len(rest)
        ways = frames.transpose(1, 0, 2).reshape(verts, -1)
        turned = ways @ bones.turns.transpose(0, 2, 1, 3).reshape(ways.shape[1], -1)
        seen = np.einsum("vbj,vj->vb", turned.reshape(verts, count, 3), rest)
        seen += ways @ bones.shifts.transpose(0, 2, 1).reshape(ways.shape[1], count)
        back = np.einsum("fbij,fbi->bj", bones.turns, bones.shifts)
        alone = len(frames) * (rest**2).sum(1)[:, None] + 2 * rest @ back.T + (bones.shifts**2).sum((0, 2))
        turned, shifted = bones.turns.sum(0), bones.shifts.sum(0)
        alone_rest = np.einsum("vi,bij,vj->vb", rest, turned, rest, optimize=True) + rest @ shifted.T
        seen_rest = (frames.sum(0) * rest).sum(1)
        return cls(alone, seen, (ways**2).sum(1), alone_rest, seen_rest, len(frames) * (rest**2).sum(1))

    @property
    def errors(self) -> Float[np.ndarray, "verts bones"]:
        """Sums of square distances of x to y, to the rounding of sums of squares [m^2]."""
        return self.alone - 2 * self.seen + self.still[:, None]


def weighted(
    bones: RigidBones, rest: Vertices, frames: FramesOfVertices, *, influences: int = 4, travels: bool = False
) -> RigidBones:
    """The same bones with the best sparse shares in vertices, of which there may be others than before.

    Args:
        bones: Bones where they are in the frames.
        rest: Vertices at rest [m].
        frames: The same in the bones' frames [m].
        influences: Bones a vertex may follow.
        travels: Count from where each vertex was in each frame, not from rest. The best shares are the same; they
            are found as soon for a mesh that goes or turns far, and in less time where frames are many.

    Source: Le, Deng, "Smooth Skinning Decomposition with Rigid Bones", 2012, Eq. 3 to 6.
    """
    rest, frames = np.asarray(rest, np.float64), np.asarray(frames, np.float64)
    fit, verts = _Fit.of(rest, frames, bones), np.arange(len(rest))[:, None]
    count = bones.turns.shape[1]
    errors = fit.errors if travels else _errors(rest, frames, bones)
    near = np.argpartition(errors, min(_CANDIDATES, count) - 1, axis=1)[:, :_CANDIDATES]
    known = len(bones.weights) == len(rest)
    start = (np.take_along_axis(bones.weights, near, axis=1) if known else np.zeros(near.shape)) + 1e-3
    for last in (False, True):
        shares = _shares(rest, bones, fit, near, start / start.sum(1, keepdims=True), travels)
        if not last:
            kept = np.argsort(-shares, axis=1, kind="stable")[:, :influences]
            near, start = np.take_along_axis(near, kept, axis=1), np.take_along_axis(shares, kept, axis=1)
    weights = np.zeros((len(rest), count))
    weights[verts, near] = shares
    return bones._replace(weights=weights)


def _shares(
    rest: np.ndarray, bones: RigidBones, fit: _Fit, near: np.ndarray, start: np.ndarray, travels: bool
) -> np.ndarray:
    """Least squares in shares w of given bones: of w (y - o) - (x - o), the same for any o, since shares sum to 1."""
    count = bones.turns.shape[1]
    turns, shifts = bones.turns.transpose(1, 0, 2, 3).reshape(count, -1, 3), bones.shifts.transpose(1, 0, 2)
    shifts = shifts.reshape(count, -1)
    turned = np.einsum("kni,lnj->klij", turns, turns, optimize=True)
    moved = np.einsum("kni,ln->kli", turns, shifts, optimize=True)
    both = shifts @ shifts.T
    one, other = near[:, :, None], near[:, None, :]
    square = np.einsum("vi,vklij,vj->vkl", rest, turned[one, other], rest, optimize=True)
    square += np.einsum("vkli,vi->vkl", moved[one, other] + moved[other, one], rest) + both[one, other]
    seen = np.take_along_axis(fit.seen, near, axis=1)
    if travels:  # o = x
        square += fit.still[:, None, None] - seen[:, :, None] - seen[:, None, :]
        return best_shares(square, np.zeros(near.shape), start, rounds=_SHARE_ROUNDS)
    at_rest = np.take_along_axis(fit.alone_rest, near, axis=1)  # o = p
    square += fit.rest[:, None, None] - at_rest[:, :, None] - at_rest[:, None, :]
    along = seen - at_rest + (fit.rest - fit.seen_rest)[:, None]
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
    moments = np.swapaxes(wanted - weights * middle_wanted[:, None], 1, 2) @ (weights * (points - middle))
    u, _, vt = np.linalg.svd(moments)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    turns = u @ vt
    return turns, middle_wanted - turns @ middle

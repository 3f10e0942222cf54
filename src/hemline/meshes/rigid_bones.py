"""Rigid bones of a moving mesh: smooth skinning decomposition."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Vertices
from hemline.errors import BadInput

from .convex_weights import fit_convex_weights

_CLUSTER_PASSES = 6
"""Passes of clustering before weights are fitted."""
_CANDIDATES = 8
"""Bones from which the few of a vertex are selected, those that fit it best alone."""
_WEIGHT_STEPS = 60
"""Steps of each fit of weights; the next pass continues from there."""


class RigidBones(NamedTuple):
    """Bones whose linear blend skinning reproduces the motion of a mesh."""

    weights: Float[np.ndarray, "verts bones"]
    """Weights of the bones at each vertex, float64, with sum 1, most of them 0."""
    turns: Float[np.ndarray, "frames bones 3 3"]
    """Rotations from rest, float64."""
    shifts: Float[np.ndarray, "frames bones 3"]
    """Translations: x = R p + t [m]."""

    def vertices(self, rest: Vertices) -> FramesOfVertices:
        """Returns the mesh in each frame by linear blend skinning [m]."""
        weighted = np.concatenate([self.weights[:, None] * rest[:, :, None], self.weights[:, None]], axis=1)
        paths = np.concatenate([self.turns.transpose(3, 1, 0, 2), self.shifts.transpose(1, 0, 2)[None]])
        predicted = weighted.reshape(len(rest), -1) @ paths.reshape(weighted.shape[1] * weighted.shape[2], -1)
        return np.ascontiguousarray(predicted.reshape(len(rest), -1, 3).swapaxes(0, 1))


def rigid_bones(
    rest: Vertices, frames: FramesOfVertices, count: int, *, influences: int = 4, passes: int = 8, travels: bool = False
) -> RigidBones:
    """Decomposes a moving mesh into rigid bones and sparse weights.

    Args:
        rest: The mesh at rest [m]; a sample of its vertices suffices to find the bones.
        frames: The same vertices in frames [m].
        count: Number of bones.
        influences: Number of bones that a vertex may follow.
        passes: Passes of weights and transforms after the clustering.
        travels: Whether the mesh moves or turns far from its rest, in many frames; see `fit_weights`.

    Raises:
        BadInput: There are no frames, or fewer than three vertices for each bone.

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
        bones = _refit_transforms(
            fit_weights(bones, rest, frames, influences=influences, travels=travels), rest, frames
        )
    return bones


def _clusters(rest: np.ndarray, frames: np.ndarray, count: int, travels: bool) -> RigidBones:
    """Clusters vertices so that each cluster moves almost like a rigid bone."""
    paths = np.concatenate([rest[None], frames]).transpose(1, 0, 2).reshape(len(rest), -1)
    seeds = [int(np.argmax(((paths - paths.mean(0)) ** 2).sum(1)))]
    apart = [((paths - paths[seeds[0]]) ** 2).sum(1)]
    while len(seeds) < count:
        seeds.append(int(np.argmax(np.min(apart, axis=0))))
        apart.append(((paths - paths[seeds[-1]]) ** 2).sum(1))
    owner, still = np.argmin(apart, axis=0), np.broadcast_to(np.eye(3), (len(frames), count, 3, 3))
    for index in range(_CLUSTER_PASSES + 1):
        bones = RigidBones(np.eye(count)[owner], still.copy(), np.zeros((len(frames), count, 3)))
        bones = _refit_transforms(bones, rest, frames)
        if index == _CLUSTER_PASSES:
            break
        errors = _Fit.of(rest, frames, bones).errors if travels else _errors(rest, frames, bones)
        owner = errors.argmin(1)
        empty = np.flatnonzero(np.bincount(owner, minlength=count) == 0)
        owner[np.argsort(-errors.min(1))[: len(empty)]] = empty  # where the others fit worst
    return bones


def _errors(rest: np.ndarray, frames: np.ndarray, bones: RigidBones) -> Float[np.ndarray, "verts bones"]:
    """Returns the sum over frames of the squared distance of each vertex to its position by each bone alone [m^2].

    The sum goes frame by frame, without the rounding of `_Fit.errors`, so that among bones that fit equally well the
    same one is selected for all vertices.
    """
    errors = np.zeros((len(rest), bones.turns.shape[1]))
    for turns, shifts, vertices in zip(bones.turns, bones.shifts, frames, strict=True):
        predicted = (rest @ turns.reshape(-1, 3).T).reshape(*errors.shape, 3) + shifts
        errors += ((predicted - vertices[:, None]) ** 2).sum(2)
    return errors


class _Fit(NamedTuple):
    """Sums over frames of products of y (a vertex by one bone alone), x (the vertex itself) and p (at rest) [m^2]."""

    yy: Float[np.ndarray, "verts bones"]
    """Sums of y y."""
    xy: Float[np.ndarray, "verts bones"]
    """Sums of x y."""
    xx: Float[np.ndarray, " verts"]
    """Sums of x x."""
    yp: Float[np.ndarray, "verts bones"]
    """Sums of y p."""
    xp: Float[np.ndarray, " verts"]
    """Sums of x p."""
    pp: Float[np.ndarray, " verts"]
    """Sums of p p."""

    @classmethod
    def of(cls, rest: np.ndarray, frames: np.ndarray, bones: RigidBones) -> "_Fit":
        """Computes the sums as products of matrices, in which no frame is visited twice."""
        count, verts = bones.turns.shape[1], len(rest)
        paths = frames.transpose(1, 0, 2).reshape(verts, -1)
        turned = paths @ bones.turns.transpose(0, 2, 1, 3).reshape(paths.shape[1], -1)
        xy = np.einsum("vbj,vj->vb", turned.reshape(verts, count, 3), rest)
        xy += paths @ bones.shifts.transpose(0, 2, 1).reshape(paths.shape[1], count)
        back = np.einsum("fbij,fbi->bj", bones.turns, bones.shifts)
        yy = len(frames) * (rest**2).sum(1)[:, None] + 2 * rest @ back.T + (bones.shifts**2).sum((0, 2))
        turned, shifted = bones.turns.sum(0), bones.shifts.sum(0)
        yp = np.einsum("vi,bij,vj->vb", rest, turned, rest, optimize=True) + rest @ shifted.T
        xp = (frames.sum(0) * rest).sum(1)
        return cls(yy, xy, (paths**2).sum(1), yp, xp, len(frames) * (rest**2).sum(1))

    @property
    def errors(self) -> Float[np.ndarray, "verts bones"]:
        """Sums of squared distances of x to y, with the rounding of differences of large sums [m^2]."""
        return self.yy - 2 * self.xy + self.xx[:, None]


def fit_weights(
    bones: RigidBones, rest: Vertices, frames: FramesOfVertices, *, influences: int = 4, travels: bool = False
) -> RigidBones:
    """Returns bones with the best sparse weights at given vertices, which need not be those of the decomposition.

    Args:
        bones: Bones with their transforms in the frames.
        rest: Vertices at rest [m].
        frames: The same vertices in the frames of the bones [m].
        influences: Number of bones that a vertex may follow.
        travels: Whether to measure from the vertex in each frame instead of from rest. The best weights are the same;
            for a mesh that moves or turns far they are found as soon, and faster if there are many frames.

    Source: Le, Deng, "Smooth Skinning Decomposition with Rigid Bones", 2012, Eq. 3 to 6.
    """
    rest, frames = np.asarray(rest, np.float64), np.asarray(frames, np.float64)
    fit, verts = _Fit.of(rest, frames, bones), np.arange(len(rest))[:, None]
    count = bones.turns.shape[1]
    errors = fit.errors if travels else _errors(rest, frames, bones)
    nearest = np.argpartition(errors, min(_CANDIDATES, count) - 1, axis=1)[:, :_CANDIDATES]
    known = len(bones.weights) == len(rest)
    start = (np.take_along_axis(bones.weights, nearest, axis=1) if known else np.zeros(nearest.shape)) + 1e-3
    for last in (False, True):
        fitted = _fit_near_weights(rest, bones, fit, nearest, start / start.sum(1, keepdims=True), travels)
        if not last:
            kept = np.argsort(-fitted, axis=1, kind="stable")[:, :influences]
            nearest, start = np.take_along_axis(nearest, kept, axis=1), np.take_along_axis(fitted, kept, axis=1)
    weights = np.zeros((len(rest), count))
    weights[verts, nearest] = fitted
    return bones._replace(weights=weights)


def _fit_near_weights(
    rest: np.ndarray, bones: RigidBones, fit: _Fit, nearest: np.ndarray, start: np.ndarray, travels: bool
) -> np.ndarray:
    """Fits weights w of given bones by least squares of w (y - o) - (x - o), the same for any o since w sums to 1."""
    count = bones.turns.shape[1]
    turns, shifts = bones.turns.transpose(1, 0, 2, 3).reshape(count, -1, 3), bones.shifts.transpose(1, 0, 2)
    shifts = shifts.reshape(count, -1)
    turned = np.einsum("kni,lnj->klij", turns, turns, optimize=True)
    moved = np.einsum("kni,ln->kli", turns, shifts, optimize=True)
    both = shifts @ shifts.T
    one, other = nearest[:, :, None], nearest[:, None, :]
    square = np.einsum("vi,vklij,vj->vkl", rest, turned[one, other], rest, optimize=True)
    square += np.einsum("vkli,vi->vkl", moved[one, other] + moved[other, one], rest) + both[one, other]
    xy = np.take_along_axis(fit.xy, nearest, axis=1)
    if travels:  # o = x
        square += fit.xx[:, None, None] - xy[:, :, None] - xy[:, None, :]
        return fit_convex_weights(square, np.zeros(nearest.shape), start, rounds=_WEIGHT_STEPS)
    at_rest = np.take_along_axis(fit.yp, nearest, axis=1)  # o = p
    square += fit.pp[:, None, None] - at_rest[:, :, None] - at_rest[:, None, :]
    along = xy - at_rest + (fit.pp - fit.xp)[:, None]
    return fit_convex_weights(square, along, start, rounds=_WEIGHT_STEPS)


def _refit_transforms(bones: RigidBones, rest: np.ndarray, frames: np.ndarray) -> RigidBones:
    """Refits transforms bone by bone; each one fits rigidly what the others leave over (Eq. 7 to 10)."""
    weights, turns, shifts = bones
    left = frames - bones.vertices(rest)
    for bone in range(weights.shape[1]):
        followers = np.flatnonzero(weights[:, bone] > 0)
        if not len(followers):
            continue
        w, p = weights[followers, bone][:, None], rest[followers]
        before = w * (p @ np.swapaxes(turns[:, bone], 1, 2) + shifts[:, bone, None])
        wanted = left[:, followers] + before
        turns[:, bone], shifts[:, bone] = _rigid(p, wanted, w)
        left[:, followers] = wanted - w * (p @ np.swapaxes(turns[:, bone], 1, 2) + shifts[:, bone, None])
    return bones


def _rigid(points: np.ndarray, wanted: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns R and t of each frame that minimise the sum of |w (R p + t) - q|^2.

    Source: Kabsch, "A Solution for the Best Rotation to Relate Two Sets of Vectors", 1976.
    """
    total = (weights**2).sum()
    middle, middle_wanted = (weights**2 * points).sum(0) / total, (weights * wanted).sum(1) / total
    moments = np.swapaxes(wanted - weights * middle_wanted[:, None], 1, 2) @ (weights * (points - middle))
    u, _, vt = np.linalg.svd(moments)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    turns = u @ vt
    return turns, middle_wanted - turns @ middle

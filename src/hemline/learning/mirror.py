"""Every training frame a second time, left and right exchanged: twice the frames of a symmetric garment for nothing."""

import heapq
from dataclasses import dataclass, replace

import numpy as np

from hemline.arrays import Faces, Float, FramesOfVertices, Int, Points
from hemline.bodies.body import ShapedBody
from hemline.garments.garment import Garment
from hemline.meshes import ClosestTree
from hemline.motions import JOINT_NAMES, Motion

FARTHEST = 0.03
"""A vertex whose mirror image lies farther than this from its partner makes a garment asymmetric [m]."""
ASIDE = 0.01
"""Share of a garment's vertices that may: corners of its rims, where meshes differ on either side."""
SEEDS = 8
_SIGNS = np.array([-1.0, 1.0, 1.0], np.float32)


def partners(points: Points, faces: Faces) -> Int[np.ndarray, " points"] | None:
    """The partner of each vertex of a mesh across the plane x = 0, one to one; None where there is none.

    From the pair that mirrors best the search walks along the mesh: the partner of a neighbour is a neighbour of the
    partner, or one of theirs, the one that keeps the offset between image and partner.

    Args:
        points: Positions of a garment on a body in its rest pose [m].
        faces: Its triangles.
    """
    images = points * _SIGNS
    around = _around(faces, len(points))
    best, farthest = None, FARTHEST
    for seed in _seeds(points, images, around):
        found = _walk(seed, points, images, around)
        paired = (found >= 0).all() and np.array_equal(found[found], np.arange(len(points)))
        far = float(np.linalg.norm(points[found] - images, axis=1).max())
        # a search that begins one column aside may end all around one column aside
        if paired and far <= farthest:
            best, farthest = found, far
    return best


def _seeds(points: Points, images: Points, around: list[list[int]]) -> list[tuple[int, int]]:
    """Pairs to begin from: corners with the corner at their image, then what lies nearest to its image."""
    from scipy.spatial import KDTree

    degree = np.array([len(each) for each in around])
    corners = np.flatnonzero(degree <= np.sort(degree)[min(3, len(degree) - 1)])
    pairs = [np.stack([corners, corners[np.asarray(KDTree(points[corners]).query(images[corners])[1])]], axis=1)]
    pairs[0] = pairs[0][: SEEDS // 2]  # a closed rim has no corners, but many vertices that pass for one
    distances, nearest = KDTree(points).query(images)
    best = np.argsort(distances)[:SEEDS]
    pairs.append(np.stack([best, np.asarray(nearest)[best]], axis=1))
    return [(int(one), int(other)) for one, other in np.concatenate(pairs)[:SEEDS]]


def _around(faces: Faces, count: int) -> list[list[int]]:
    found: list[set[int]] = [set() for _ in range(count)]
    for a, b, c in faces.tolist():
        found[a] |= {b, c}
        found[b] |= {a, c}
        found[c] |= {a, b}
    return [sorted(each) for each in found]


def _walk(seed: tuple[int, int], points: Points, images: Points, around: list[list[int]]) -> Int[np.ndarray, " points"]:
    """Partners found from one pair, the surest first; -1 where the mesh is not reached."""
    found = np.full(len(points), -1, np.int32)
    taken = np.zeros(len(points), bool)
    queue = [(0.0, *seed)]
    while queue:
        _, vertex, partner = heapq.heappop(queue)
        if found[vertex] >= 0 or taken[partner]:
            continue
        found[vertex], taken[partner] = partner, True
        offset = points[partner] - images[vertex]
        wide = np.array(sorted({far for near in around[partner] for far in around[near]}))
        for neighbour in around[vertex]:
            if found[neighbour] < 0:
                misses = np.linalg.norm(points[wide] - images[neighbour] - offset, axis=1)
                for k in np.argsort(misses)[:2]:
                    heapq.heappush(queue, (float(misses[k]), neighbour, int(wide[k])))
    return found


def mirror_of(garment: Garment, shaped: ShapedBody) -> Int[np.ndarray, " verts"] | None:
    """Partners of a garment's vertices if both it and the body are symmetric, else None."""
    return partners(garment.vertices, garment.faces) if is_symmetric(shaped) else None


def is_symmetric(shaped: ShapedBody) -> bool:
    """Whether the joints of a body in its rest pose are mirror images of each other."""
    joints = shaped.joints
    return bool(np.abs(joints[swapped_joints()] * _SIGNS - joints).max() <= FARTHEST)


@dataclass(frozen=True)
class MirrorImage:
    """Where on a symmetric garment the mirror image of each of its vertices lies, be there a vertex or not.

    Attributes:
        corners: The triangle that it lies in.
        weights: Its barycentric weights there.
    """

    corners: Int[np.ndarray, "verts 3"]
    weights: Float[np.ndarray, "verts 3"]

    @classmethod
    def on(cls, points: Points, faces: Faces) -> "MirrorImage | None":
        """Find them, across the plane x = 0; None where more than `ASIDE` of them lie `FARTHEST_BODY` from the garment.

        They are vertices where the mesh is symmetric (`partners`), else what of the garment is closest to them.

        Args:
            points: The garment on a body in its rest pose [m].
            faces: Its triangles.
        """
        partner = partners(points, faces)
        if partner is not None:
            return cls(np.repeat(partner[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(partner), 1)))
        rest = np.asarray(points, np.float64)
        closest = ClosestTree(rest, faces).closest(rest * _SIGNS)
        if np.mean(closest.distances > FARTHEST) > ASIDE:
            return None
        return cls(np.asarray(faces)[closest.faces], closest.weights)

    def of(self, vectors: Float[np.ndarray, "... verts 3"]) -> Float[np.ndarray, "... verts 3"]:
        """A field of vectors over the garment, left and right exchanged."""
        return np.einsum("...vci,vc->...vi", vectors[..., self.corners, :], self.weights) * _SIGNS


def mirrored_vertices(vertices: FramesOfVertices, partner: Int[np.ndarray, " verts"]) -> FramesOfVertices:
    """The garment of the mirrored motion [m]."""
    return vertices[:, partner] * _SIGNS


def mirrored_transforms(transforms: Float[np.ndarray, "frames joints 3 4"]) -> Float[np.ndarray, "frames joints 3 4"]:
    r"""Skin transforms of the mirrored motion: $M A_{\sigma(j)} M$ with left and right joints exchanged by $\sigma$."""
    fourth = np.append(_SIGNS, np.float32(1))
    return transforms[:, swapped_joints()] * _SIGNS[:, None] * fourth


def mirrored_motion(motion: Motion) -> Motion:
    """The motion of the mirrored body: that of `mirrored_transforms`, up to what a body's own joints are asymmetric."""
    return replace(motion, rotations=mirrored_rotations(motion.rotations), translations=motion.translations * _SIGNS)


def mirrored_rotations(rotations: Float[np.ndarray, "... joints 4"]) -> Float[np.ndarray, "... joints 4"]:
    """Local rotations of the mirrored body."""
    return rotations[..., swapped_joints(), :] * np.array([1, 1, -1, -1], rotations.dtype)


def swapped_joints() -> list[int]:
    """For each joint the one on the other side of the body, itself where it is in the middle."""
    other = {"left": "right", "right": "left"}
    names = ["_".join(other.get(part, part) for part in name.split("_")) for name in JOINT_NAMES]
    return [JOINT_NAMES.index(name) for name in names]

"""Mirrors training frames: twice the frames of a symmetric garment, with left and right exchanged."""

import heapq
from dataclasses import dataclass, replace

import numpy as np

from hemline.arrays import Faces, Float, FramesOfVertices, Int, Points
from hemline.bodies.body import ShapedBody
from hemline.garments.garment import Garment
from hemline.meshes import ClosestTree
from hemline.motions import JOINT_NAMES, Motion

MIRROR_TOLERANCE = 0.03
"""A garment is asymmetric if the mirror image of a vertex lies farther than this from its partner [m]."""
ASYMMETRIC_FRACTION = 0.01
"""Fraction of a garment's vertices that may lie farther off: corners of rims, where both sides are meshed
differently."""
SEED_PAIRS = 8
"""Pairs of vertices from which the search for partners is started."""
_SIGNS = np.array([-1.0, 1.0, 1.0], np.float32)


def partners(points: Points, faces: Faces) -> Int[np.ndarray, " points"] | None:
    """Returns the partner of each vertex across the plane x = 0, one to one; None if the mesh is not symmetric.

    The search walks along the mesh from the pair that mirrors best: the partner of a neighbour is a neighbour of the
    partner, or one of their neighbours, whichever keeps the offset between image and partner.

    Args:
        points: Positions of a garment on a body in its rest pose [m].
        faces: Triangles of the garment.
    """
    images = points * _SIGNS
    around = _around(faces, len(points))
    best, farthest = None, MIRROR_TOLERANCE
    for seed in _seeds(points, images, around):
        found = _walk(seed, points, images, around)
        paired = (found >= 0).all() and np.array_equal(found[found], np.arange(len(points)))
        far = float(np.linalg.norm(points[found] - images, axis=1).max())
        # a search that begins one column aside may end all around one column aside
        if paired and far <= farthest:
            best, farthest = found, far
    return best


def _seeds(points: Points, images: Points, around: list[list[int]]) -> list[tuple[int, int]]:
    """Returns pairs to start from: corners with the corner at their image, then vertices nearest to their image."""
    from scipy.spatial import KDTree

    degree = np.array([len(each) for each in around])
    corners = np.flatnonzero(degree <= np.sort(degree)[min(3, len(degree) - 1)])
    pairs = [np.stack([corners, corners[np.asarray(KDTree(points[corners]).query(images[corners])[1])]], axis=1)]
    pairs[0] = pairs[0][: SEED_PAIRS // 2]  # a closed rim has no corners, but many vertices that pass for one
    distances, nearest = KDTree(points).query(images)
    best = np.argsort(distances)[:SEED_PAIRS]
    pairs.append(np.stack([best, np.asarray(nearest)[best]], axis=1))
    return [(int(one), int(other)) for one, other in np.concatenate(pairs)[:SEED_PAIRS]]


def _around(faces: Faces, count: int) -> list[list[int]]:
    """Returns the neighbours of each vertex, sorted."""
    found: list[set[int]] = [set() for _ in range(count)]
    for a, b, c in faces.tolist():
        found[a] |= {b, c}
        found[b] |= {a, c}
        found[c] |= {a, b}
    return [sorted(each) for each in found]


def _walk(seed: tuple[int, int], points: Points, images: Points, around: list[list[int]]) -> Int[np.ndarray, " points"]:
    """Finds partners from one pair on, the surest first; -1 where the mesh is not reached."""
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
    """Returns the partners of a garment's vertices if both it and the body are symmetric, else None."""
    return partners(garment.vertices, garment.faces) if is_symmetric(shaped) else None


def is_symmetric(shaped: ShapedBody) -> bool:
    """Tells whether the joints of a body in its rest pose are mirror images of each other."""
    joints = shaped.joints
    return bool(np.abs(joints[opposite_joints()] * _SIGNS - joints).max() <= MIRROR_TOLERANCE)


@dataclass(frozen=True)
class MirrorImage:
    """The place on a symmetric garment where the mirror image of each vertex lies, which need not be a vertex.

    Attributes:
        corners: Corners of the triangle in which it lies.
        weights: Its barycentric weights there.
    """

    corners: Int[np.ndarray, "verts 3"]
    weights: Float[np.ndarray, "verts 3"]

    @classmethod
    def on(cls, points: Points, faces: Faces) -> "MirrorImage | None":
        """Finds the images across the plane x = 0; None if too many lie too far from the garment.

        An image is a vertex where the mesh is symmetric (`partners`), else the closest point of the garment. At most
        `ASYMMETRIC_FRACTION` of them may lie farther than `MIRROR_TOLERANCE` away.

        Args:
            points: The garment on a body in its rest pose [m].
            faces: Triangles of the garment.
        """
        partner = partners(points, faces)
        if partner is not None:
            return cls(np.repeat(partner[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(partner), 1)))
        rest = np.asarray(points, np.float64)
        closest = ClosestTree(rest, faces).closest(rest * _SIGNS)
        if np.mean(closest.distances > MIRROR_TOLERANCE) > ASYMMETRIC_FRACTION:
            return None
        return cls(np.asarray(faces)[closest.faces], closest.weights)

    def of(self, vectors: Float[np.ndarray, "... verts 3"]) -> Float[np.ndarray, "... verts 3"]:
        """Mirrors a field of vectors over the garment."""
        return np.einsum("...vci,vc->...vi", vectors[..., self.corners, :], self.weights) * _SIGNS


def mirror_vertices(vertices: FramesOfVertices, partner: Int[np.ndarray, " verts"]) -> FramesOfVertices:
    """Returns the garment of the mirrored motion [m]."""
    return vertices[:, partner] * _SIGNS


def mirror_transforms(transforms: Float[np.ndarray, "frames joints 3 4"]) -> Float[np.ndarray, "frames joints 3 4"]:
    r"""Returns the skin transforms of the mirrored motion, $M A_{\sigma(j)} M$; $\sigma$ exchanges left and right."""
    fourth = np.append(_SIGNS, np.float32(1))
    return transforms[:, opposite_joints()] * _SIGNS[:, None] * fourth


def mirror_motion(motion: Motion) -> Motion:
    """Returns the motion of the mirrored body; see `mirror_transforms`, for a body with symmetric joints."""
    return replace(motion, rotations=mirror_rotations(motion.rotations), translations=motion.translations * _SIGNS)


def mirror_rotations(rotations: Float[np.ndarray, "... joints 4"]) -> Float[np.ndarray, "... joints 4"]:
    """Returns the local rotations of the mirrored body."""
    return rotations[..., opposite_joints(), :] * np.array([1, 1, -1, -1], rotations.dtype)


def opposite_joints() -> list[int]:
    """Returns for each joint the one on the other side of the body; a joint in the middle is its own opposite."""
    other = {"left": "right", "right": "left"}
    names = ["_".join(other.get(part, part) for part in name.split("_")) for name in JOINT_NAMES]
    return [JOINT_NAMES.index(name) for name in names]

"""Where a garment lies close to the body and where it hangs, measured on a simulated take."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Transforms, Vertices
from hemline.bodies import ShapedBody
from hemline.datasets import Take
from hemline.meshes import ClosestTree

CLOSE_SWING, FREE_SWING = 0.03, 0.09
"""Swing up to which cloth counts as lying close, and from which it counts as hanging [m]; between them it is both."""
CLOSE_DISTANCE, FREE_DISTANCE = 0.03, 0.06
"""Distance from the skin up to which cloth counts as lying close, and from which it counts as hanging [m]."""
CLEARANCE_STEP = 4
"""Clearance is measured in one of this number of frames."""


@dataclass(frozen=True)
class Regions:
    """How freely each vertex of a garment moves over the body.

    Attributes:
        swing: Root mean square motion of each vertex relative to the skin under it (verts,) [m].
        clearance: Median distance of each vertex from the skin (verts,) [m].
        areas: Area of the cloth that belongs to each vertex (verts,) [m^2].
    """

    swing: Float[np.ndarray, " verts"]
    clearance: Float[np.ndarray, " verts"]
    areas: Float[np.ndarray, " verts"]

    @classmethod
    def of(cls, take: Take, rest: Vertices, faces: Faces, body: ShapedBody) -> "Regions":
        """Measures a simulated take.

        Args:
            take: A take of the garment on the body.
            rest: The garment at rest on this body (verts, 3) [m].
            faces: Triangles of the garment.
            body: The body of the take.
        """
        indices, weights = _skin_weights(rest, body)
        offsets, distances = [], []
        for number, frame in enumerate(take.clip_frames):
            posed = body.posed(take.motion[int(frame)])
            offsets.append(_move_to_rest(take.vertices[frame], posed.transforms, indices, weights) - rest)
            if number % CLEARANCE_STEP:
                continue
            tree = ClosestTree(posed.vertices.astype(np.float64), posed.faces)
            distances.append(tree.closest(take.vertices[frame]).distances)
        motion = np.stack(offsets)
        swing = np.sqrt(((motion - motion.mean(axis=0)) ** 2).sum(axis=2).mean(axis=0))
        return cls(swing, np.median(distances, axis=0), vertex_areas(rest, faces))

    @property
    def hanging(self) -> Float[np.ndarray, " verts"]:
        """How much each vertex hangs, from 0 (lies close to the body) to 1 (hangs freely)."""
        swinging = _smooth_step(self.swing, CLOSE_SWING, FREE_SWING)
        return np.maximum(swinging, _smooth_step(self.clearance, CLOSE_DISTANCE, FREE_DISTANCE))

    @property
    def hanging_fraction(self) -> float:
        """Fraction of the garment's area that hangs."""
        return float((self.hanging * self.areas).sum() / self.areas.sum())


def _smooth_step(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Returns 0 up to `low`, 1 from `high`, and a smooth cubic between them."""
    ramp = np.clip((values - low) / (high - low), 0, 1)
    return ramp * ramp * (3 - 2 * ramp)


def vertex_areas(vertices: Vertices, faces: Faces) -> Float[np.ndarray, " verts"]:
    """Returns a third of the area of the triangles around each vertex [m^2]."""
    corners = np.asarray(vertices, np.float64)[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    return np.bincount(faces.ravel(), np.repeat(areas / 3, 3), minlength=len(vertices))


def _skin_weights(rest: Vertices, body: ShapedBody) -> tuple[np.ndarray, np.ndarray]:
    """Returns joints and weights of each vertex: those of the skin next to it at rest."""
    faces = body.body.faces
    closest = ClosestTree(body.vertices.astype(np.float64), faces).closest(rest)
    corners = faces[closest.faces]
    indices = body.body.weight_indices[corners].reshape(len(rest), -1)
    weights = (body.body.weights[corners] * closest.weights[:, :, None]).reshape(len(rest), -1)
    return indices, weights / weights.sum(axis=1, keepdims=True)


def _move_to_rest(vertices: Vertices, transforms: Transforms, indices: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Returns vertices moved back by the transforms of the skin under them (verts, 3) [m]."""
    blended = np.einsum("vk,vkij->vij", weights, np.asarray(transforms, np.float64)[indices])
    return np.linalg.solve(blended[:, :, :3], (vertices - blended[:, :, 3])[..., None])[..., 0]

"""A garment's proxy on one shape of the body, with everything that does not change while it is played."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.coarse.features.columns import BODY_PARTS, DYNAMIC, FEATURE_JOINTS
from hemline.animators.coarse.features.feature_kernels import describe
from hemline.animators.coarse.features.kernel_inputs import TrailArrays
from hemline.animators.coarse.features.memory import FILTER_COUNT, SWING_SECONDS
from hemline.animators.soft_weights import SoftWeights, soft_weights
from hemline.arrays import Faces, Float, Int, Vertices
from hemline.collide.primitives.body_primitives import BodyPrimitives, Colliders
from hemline.garments import Garment
from hemline.meshes import ClosestTree, GeodesicMesh, vertex_normals
from hemline.motions.motion import JOINT_NAMES

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

CONTACT_DISTANCE = 0.012
"""Cloth that is nearer to the skin at rest than this lies on it [m]."""
MAX_CLOTH_DISTANCE = 1.0
"""Largest distance along the cloth; larger ones are clipped [m]."""
MAX_CELLS = 64
"""Largest number of cells of a garment."""
CELL_EDGE = 0.1
"""Desired spacing of cells [m]."""
CELLS_PER_VERTEX = 4
"""Number of cells that reach a vertex."""


@dataclass(frozen=True)
class Cells:
    """A garment cut into cells of about 0.1 m, which pass information between distant parts of it."""

    cell: Int[np.ndarray, " verts"]
    """Cell of each vertex."""
    near: Int[np.ndarray, "verts near"]
    """Cells that reach each vertex."""
    shares: Float[np.ndarray, "verts near"]
    """Weights of these cells; rows add up to 1."""

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(self.cell.max()) + 1

    @classmethod
    def of(cls, garment: Garment) -> Self:
        """Cuts a garment into cells by distances along its cloth."""
        one, two = garment.rest_edges[:, :, 0], garment.rest_edges[:, :, 1]
        area = 0.5 * float(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum())
        count = int(min(MAX_CELLS, max(CELLS_PER_VERTEX + 1, area / CELL_EDGE**2)))
        ways = GeodesicMesh.of(garment.vertices, garment.faces, garment.rest_edges)
        near, distances = ways.nearest(ways.sample(count), CELLS_PER_VERTEX + 1, np.inf)
        found = near >= 0
        far = np.where(found, distances, 0).max(axis=1, keepdims=True) + 1e-6
        shares = np.where(found, 1 - distances / far, 0)[:, :CELLS_PER_VERTEX] + 1e-6 * found[:, :CELLS_PER_VERTEX]
        near = np.where(found, near, near[:, :1])[:, :CELLS_PER_VERTEX]
        shares /= shares.sum(axis=1, keepdims=True)
        return cls(near[:, 0].astype(np.int64), near.astype(np.int64), shares.astype(np.float32))


@dataclass(frozen=True, eq=False)
class ProxyOnBody:
    """The settled proxy with its skin weights and its features that do not change."""

    garment: Garment
    """The proxy on this shape of the body."""
    rest: Vertices
    """The proxy settled on this body in its rest pose [m], float32."""
    shaped: "ShapedBody"
    """The body."""
    skin: SoftWeights
    """Skin weights of the proxy."""
    key: int
    """Index of the joint that carries the garment."""
    cells: Cells
    """Cells of the proxy."""
    static: Float[np.ndarray, "verts static"]
    """Features that do not change, as `features.columns.STATIC` lists them."""
    offsets: Float[np.ndarray, "verts points 3"]
    """Features of `FEATURE_JOINTS` at rest, which `describe` subtracts."""
    colliders: Colliders
    """Primitives of the body."""
    parts: Int[np.ndarray, " prims"]
    """Index in `BODY_PARTS` of the part of the body that each primitive belongs to."""

    @classmethod
    def of(cls, garment: Garment, rest: Vertices, shaped: "ShapedBody") -> Self:
        """Prepares a proxy on one shape of the body.

        Args:
            garment: The proxy on this shape of the body.
            rest: The proxy settled in the rest pose (verts, 3) [m].
            shaped: The body.
        """
        skin, key = soft_weights(rest, shaped.body, shaped.vertices), JOINT_NAMES.index(garment.key_joint)
        proxy = BodyPrimitives.fit(shaped)
        made = cls(
            garment,
            np.ascontiguousarray(rest, np.float32),
            shaped,
            skin,
            key,
            Cells.of(garment),
            _static(garment, rest, shaped, skin, key),
            np.zeros((len(rest), len(FEATURE_JOINTS), 3), np.float32),
            proxy.colliders,
            _parts(proxy.joints),
        )
        still = np.zeros((len(rest), FILTER_COUNT + 1, 3), np.float32)
        turns = np.tile(np.array([1, 0, 0, 0], np.float32), (len(rest), 1))
        frames = np.tile(np.eye(4)[:3], (len(shaped.joints), 1, 1))
        features = np.empty((len(rest), DYNAMIC.count), np.float32)
        made.describe(TrailArrays(made.rest, turns, made.rest, still, still), frames, shaped.joints, features)
        made.offsets[...] = features[:, DYNAMIC["joints"]].reshape(len(rest), -1, 3)
        return made

    def describe(
        self,
        trail: TrailArrays,
        frames: Float[np.ndarray, "joints 3 4"],
        joints: Float[np.ndarray, "joints 3"],
        features_out: Float[np.ndarray, "verts dynamic"],
    ) -> None:
        """Writes the features that change, but for the beginning, see `feature_kernels.describe`.

        Args:
            trail: How the proxy moved.
            frames: Rest-to-world transforms of the joints, float64.
            joints: Joints in the world [m].
            features_out: Features in the columns of `DYNAMIC`, float32, to be written.
        """
        points = np.ascontiguousarray(joints[list(FEATURE_JOINTS)], np.float32)
        describe(trail, SWING_SECONDS, self.colliders, self.parts, frames, points, self.offsets, features_out)


def _parts(joints: Int[np.ndarray, " prims"]) -> Int[np.ndarray, " prims"]:
    """Returns the index in `BODY_PARTS` of the part that each primitive belongs to."""
    arm, leg = ("shoulder", "elbow", "wrist", "hand"), ("hip", "knee", "ankle", "foot")
    parts = []
    for joint in joints:
        side, _, what = JOINT_NAMES[joint].partition("_")
        limb = "arm" if what in arm else "leg" if what in leg else ""
        parts.append(BODY_PARTS.index(f"{side} {limb}") if limb else 0)
    return np.array(parts, np.int64)


def _static(garment: Garment, rest: Vertices, shaped: "ShapedBody", skin: SoftWeights, key: int) -> np.ndarray:
    tree = ClosestTree(shaped.vertices, shaped.body.faces)
    closest = tree.closest(rest)
    distances = np.asarray(closest.distances, np.float64)
    away = (rest - closest.positions) / np.maximum(distances, 1e-4)[:, None]
    on_body = np.union1d(garment.pins.vertices, np.flatnonzero(distances < CONTACT_DISTANCE))
    ways = GeodesicMesh.of(rest, garment.faces, garment.rest_edges)
    to_body, to_rim = (_cloth_distance(ways, each) for each in (on_body, _rim_vertices(garment.faces)))
    gaps = np.tanh(np.stack([distances / 0.1, distances / 0.3, to_body], axis=1))
    position = rest - shaped.joints[key]
    normals = vertex_normals(rest, garment.faces)
    parts = [normals, np.tanh(to_rim / 0.3)[:, None], away, gaps, position, skin.dense()]
    return np.ascontiguousarray(np.concatenate(parts, axis=1), np.float32)


def _cloth_distance(ways: GeodesicMesh, sources: np.ndarray) -> np.ndarray:
    """Returns the distance along the cloth from the nearest of some vertices [m], at most `MAX_CLOTH_DISTANCE`."""
    if not len(sources):
        return np.full(ways.vertex_count, MAX_CLOTH_DISTANCE)
    return np.minimum(ways.nearest(sources, 1, MAX_CLOTH_DISTANCE)[1][:, 0], MAX_CLOTH_DISTANCE)


def _rim_vertices(faces: Faces) -> np.ndarray:
    """Returns the vertices on edges of one triangle only."""
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, counts = np.unique(sides, axis=0, return_counts=True)
    return np.unique(edges[counts == 1])

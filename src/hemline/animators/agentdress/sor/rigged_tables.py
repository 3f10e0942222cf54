"""Rigged anchors as they are played: the arrays of sensitivity-optimised rigging."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.animators.agentdress.binding import Binding
from hemline.arrays import Float, Int, Transforms, Vertices
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of
from hemline.motions.motion import JOINT_COUNT

from .rigged_kernels import blend_anchors, offsets_from_skinning
from .rigging import MOST_BONES, Rigging

WEIGHT_SUM = 255
"""What the weights of a vertex sum to."""

MOST_STEPS = 32767
"""Steps from the middle of a garment to its farthest coordinate."""


@dataclass(frozen=True, eq=False)
class RiggedTables:
    """Settled garments of the mean body, each with skin weights of its own: `Rigging` in few bytes.

    Attributes:
        poses: Which pose of the model each anchor is in, int32.
        transforms: Skin transforms there, float32, the middle of the garment taken for the origin of the world.
        worn: The garment there, from its middle, int16.
        step: What one is [m], float32.
        indices: Bones of each vertex, the heaviest one first, uint8.
        weights: Their weights, uint8; a row sums to 255.
    """

    poses: Int[np.ndarray, " rigged"]
    transforms: Float[np.ndarray, "rigged joints 3 4"]
    worn: Int[np.ndarray, "rigged verts 3"]
    step: Float[np.ndarray, " one"]
    indices: Int[np.ndarray, "rigged verts most_bones"]
    weights: Int[np.ndarray, "rigged verts most_bones"]

    @classmethod
    def pack(cls, rigging: Rigging, poses: Int[np.ndarray, " rigged"]) -> Self:
        """Round a rigging: coordinates to some hundredths of a millimetre, weights to parts of 255.

        Args:
            rigging: At most 8 bones of each vertex have weight.
            poses: Which pose of the model each anchor is in.
        """
        middle = (rigging.vertices.min(axis=1) + rigging.vertices.max(axis=1)) / 2
        apart = rigging.vertices - middle[:, None]
        step = np.float32(np.abs(apart).max() / MOST_STEPS)
        transforms = rigging.transforms.copy()
        transforms[..., 3] -= middle[:, None]
        indices = np.argsort(-rigging.weights, axis=2, kind="stable")[:, :, :MOST_BONES]
        return cls(
            poses.astype(np.int32),
            transforms.astype(np.float32),
            np.rint(apart / step).clip(-MOST_STEPS, MOST_STEPS).astype(np.int16),
            np.array([step]),
            indices.astype(np.uint8),
            quantize_weights(np.take_along_axis(rigging.weights, indices, axis=2)),
        )

    def offset(
        self,
        transforms: Transforms,
        blend: Float[np.ndarray, "regions rigged"],
        regions: Float[np.ndarray, "verts regions"],
        binding: Binding,
        rest: Vertices,
    ) -> Vertices:
        """What the anchors add to skinning in a pose, in the turned frames of the vertices [m].

        Args:
            transforms: Skin transforms of the pose, on the mean shape.
            blend: What each anchor counts for in each region; rows sum to 1.
            regions: Share of each region in each vertex.
            binding: How the garment hangs on the bones.
            rest: The garment of the mean shape, as skinning carries it [m].
        """
        carried, offset = np.empty((len(rest), 4), np.float32), np.empty((len(rest), 3), np.float32)
        anchors = self.transforms, self.worn, self.step[0], self.indices, self.weights
        blend_anchors(*anchors, regions, blend, transforms, carried)
        offsets_from_skinning(binding.indices, binding.weights, rest, transforms, carried, offset)
        return offset

    def arrays(self) -> dict[str, np.ndarray]:
        """What a model file holds."""
        return dict(vars(self))

    def at_vertices(self, kept: Int[np.ndarray, " kept"]) -> Self:
        """The same of some of the vertices."""
        held = {name: np.ascontiguousarray(getattr(self, name)[:, kept]) for name in ("worn", "indices", "weights")}
        return replace(self, **held)

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, vertices: int, poses: int) -> Self:
        """Read them back.

        Raises:
            BadModel: One is missing, of another type or shape than the others ask for, or points nowhere.
        """
        anchors = array_of(arrays, "poses", "int32", (None,))
        count = len(anchors)
        indices = array_of(arrays, "indices", "uint8", (count, vertices, MOST_BONES))
        weights = array_of(arrays, "weights", "uint8", (count, vertices, MOST_BONES))
        for name, found, limit in (("pose", anchors, poses), ("bone", indices, JOINT_COUNT)):
            if not (found.size and found.min() >= 0 and found.max() < limit):
                got = int(found.max()) if found.size else "none"
                raise BadModel(f"a rigged anchor of the model names a {name} that does not exist", got, AGAIN)
        if not (weights.sum(axis=2, dtype=np.int64) == WEIGHT_SUM).all():
            raise BadModel("weights of a rigged anchor sum to 255", int(weights.sum(axis=2).max()), AGAIN)
        return cls(
            anchors,
            array_of(arrays, "transforms", "float32", (count, JOINT_COUNT, 3, 4)),
            array_of(arrays, "worn", "int16", (count, vertices, 3)),
            array_of(arrays, "step", "float32", (1,)),
            indices,
            weights,
        )


def quantize_weights(weights: Float[np.ndarray, "... bones"]) -> Int[np.ndarray, "... bones"]:
    """Weights in 255 parts, uint8; what rounding down leaves over goes where it took most."""
    exact = WEIGHT_SUM * weights / weights.sum(axis=-1, keepdims=True)
    parts = np.floor(exact).astype(np.int64)
    rank = np.argsort(np.argsort(parts - exact, axis=-1, kind="stable"), axis=-1)
    parts += rank < WEIGHT_SUM - parts.sum(axis=-1, keepdims=True)
    return parts.astype(np.uint8)

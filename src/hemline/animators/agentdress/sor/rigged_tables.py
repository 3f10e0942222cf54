"""The arrays of sensitivity-optimised rigging, in the form used for playback."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.kernel_inputs import AnchorTables
from hemline.arrays import Float, Int, Transforms, Vertices
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of
from hemline.motions.motion import JOINT_COUNT

from .rigged_kernels import blend_anchors, offsets_from_skinning
from .rigging import MOST_BONES, Rigging

WEIGHT_SUM = 255
"""Sum of the quantized skin weights of a vertex."""

MOST_STEPS = 32767
"""Number of quantization steps from the centre of a garment to its farthest coordinate."""


@dataclass(frozen=True, eq=False)
class RiggedTables:
    """Settled garments of the mean body, each with its own skin weights: a quantized `Rigging`.

    Attributes:
        poses: Pose of the model in which each anchor lies, int32.
        transforms: Skin transforms of the anchors, float32, with the centre of the garment as world origin.
        worn: Garments of the anchors relative to their centres, in steps, int16.
        step: Size of a step [m], float32.
        indices: Bones of each vertex, the heaviest one first, uint8.
        weights: Weights of these bones, uint8; a row sums to 255.
    """

    poses: Int[np.ndarray, " rigged"]
    transforms: Float[np.ndarray, "rigged joints 3 4"]
    worn: Int[np.ndarray, "rigged verts 3"]
    step: Float[np.ndarray, " one"]
    indices: Int[np.ndarray, "rigged verts most_bones"]
    weights: Int[np.ndarray, "rigged verts most_bones"]

    @classmethod
    def pack(cls, rigging: Rigging, poses: Int[np.ndarray, " rigged"]) -> Self:
        """Quantizes a rigging: coordinates to some hundredths of a millimetre, weights to 1/255.

        Args:
            rigging: A rigging with at most 8 weighted bones per vertex.
            poses: Pose of the model in which each anchor lies.
        """
        middle = (rigging.vertices.min(axis=1) + rigging.vertices.max(axis=1)) / 2
        centred = rigging.vertices - middle[:, None]
        step = np.float32(np.abs(centred).max() / MOST_STEPS)
        transforms = rigging.transforms.copy()
        transforms[..., 3] -= middle[:, None]
        indices = np.argsort(-rigging.weights, axis=2, kind="stable")[:, :, :MOST_BONES]
        return cls(
            poses.astype(np.int32),
            transforms.astype(np.float32),
            np.rint(centred / step).clip(-MOST_STEPS, MOST_STEPS).astype(np.int16),
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
        """Predicts the offsets from the skinned garment in a pose, in rotated vertex frames [m].

        Args:
            transforms: Skin transforms of the pose, on the mean shape.
            blend: Weight of each anchor in each region; rows sum to 1.
            regions: Weight of each region at each vertex.
            binding: Skin weights of the garment.
            rest: The skinned garment of the mean shape [m].
        """
        carried, offset = np.empty((len(rest), 4), np.float32), np.empty((len(rest), 3), np.float32)
        anchors = AnchorTables(self.transforms, self.worn, self.step[0], self.indices, self.weights)
        blend_anchors(anchors, regions, blend, transforms, carried)
        offsets_from_skinning(binding.indices, binding.weights, rest, transforms, carried, offset)
        return offset

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file."""
        return dict(vars(self))

    def at_vertices(self, kept: Int[np.ndarray, " kept"]) -> Self:
        """Returns the tables restricted to some of the vertices."""
        names = ("worn", "indices", "weights")
        return replace(self, **{name: np.ascontiguousarray(getattr(self, name)[:, kept]) for name in names})

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, vertices: int, poses: int) -> Self:
        """Reads the arrays of a model file.

        Raises:
            BadModel: An array is missing, has the wrong type or shape, or contains an index out of range.
        """
        anchors = array_of(arrays, "poses", "int32", (None,))
        count = len(anchors)
        indices = array_of(arrays, "indices", "uint8", (count, vertices, MOST_BONES))
        weights = array_of(arrays, "weights", "uint8", (count, vertices, MOST_BONES))
        for name, array, limit in (("pose", anchors, poses), ("bone", indices, JOINT_COUNT)):
            if not (array.size and array.min() >= 0 and array.max() < limit):
                got = int(array.max()) if array.size else "none"
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
    """Rounds weights to 1/255, uint8. Remainders of rounding down go to the weights that lost most."""
    exact = WEIGHT_SUM * weights / weights.sum(axis=-1, keepdims=True)
    parts = np.floor(exact).astype(np.int64)
    rank = np.argsort(np.argsort(parts - exact, axis=-1, kind="stable"), axis=-1)
    parts += rank < WEIGHT_SUM - parts.sum(axis=-1, keepdims=True)
    return parts.astype(np.uint8)

"""The arrays of a model, in the form used for playback."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from hemline.animators.agentdress.sor.rigged_tables import RiggedTables
from hemline.arrays import Float, Int
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, part
from hemline.learning.packed_basis import PackedBasis
from hemline.motions.motion import JOINT_COUNT

from .binding import INFLUENCES
from .shape_samples import ShapeSamples


@dataclass(frozen=True, eq=False)
class Tables:
    """Arrays of AgentDress, float32 and int32; coordinates refer to the rest pose of the body.

    Attributes:
        indices: Bones of each vertex.
        weights: Weights of these bones.
        nearest: Closest body vertex of each garment vertex.
        regions: Weight of each region at each vertex.
        axes: Weight of each axis of each joint frame in the distances of each region.
        rotations: Poses of the kernels; the first ones are the anchors.
        rest: The skinned garment of the mean shape [m].
        rest_effects: Effect of each shape feature, of all betas, on `rest` [m].
        offset: Mean offset from the skinned garment over these poses, in rotated vertex frames [m].
        basis: Modes of the pose model, followed by modes of the shape.
        pose_weights: Weight of each pose on each pose mode, per region.
        shapes: Effect of body shapes on each shape mode, per pose and region; one region stands for all if anchors are
            blended.
        rigged: The rigged anchors, if rigging is the pose model; the basis then has shape modes alone.
    """

    indices: Int[np.ndarray, "verts influences"]
    weights: Float[np.ndarray, "verts influences"]
    nearest: Int[np.ndarray, " verts"]
    regions: Float[np.ndarray, "verts regions"]
    axes: Float[np.ndarray, "regions axes"]
    rotations: Float[np.ndarray, "poses joints 4"]
    rest: Float[np.ndarray, "verts 3"]
    rest_effects: Float[np.ndarray, "rest_features verts 3"]
    offset: Float[np.ndarray, "verts 3"]
    basis: PackedBasis
    pose_weights: Float[np.ndarray, "regions poses pose_modes"]
    shapes: ShapeSamples
    rigged: RiggedTables | None = None

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file.

        Weights of poses and effects of the shape at rest have half precision there; numbers of bones are bytes.
        """
        parts = {"basis": self.basis, "shapes": self.shapes} | ({"rigged": self.rigged} if self.rigged else {})
        own = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("basis", "shapes", "rigged")}
        own |= {name: own[name].astype(np.float16) for name in ("rest_effects", "pose_weights")}
        own["indices"] = own["indices"].astype(np.uint8)
        return own | {f"{part}.{name}": array for part, of in parts.items() for name, array in of.arrays().items()}

    def at_vertices(self, kept: Int[np.ndarray, " kept"]) -> Self:
        """Returns the tables restricted to some of the vertices."""
        names = ("indices", "weights", "nearest", "regions", "rest", "offset")
        arrays = {name: np.ascontiguousarray(getattr(self, name)[kept]) for name in names}
        effects = np.ascontiguousarray(self.rest_effects[:, kept])
        rigged = self.rigged and self.rigged.at_vertices(kept)
        return replace(self, **arrays, rest_effects=effects, basis=self.basis.at_vertices(kept), rigged=rigged)

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, vertices: int, body_vertices: int, rigged: bool) -> Self:
        """Reads the arrays of a model file, with rigged anchors or without.

        Raises:
            BadModel: An array is missing or has the wrong type or shape.
        """
        regions = array_of(arrays, "regions", "float32", (vertices, None))
        rotations = array_of(arrays, "rotations", "float32", (None, JOINT_COUNT, 4))
        pose_weights = array_of(
            arrays, "pose_weights", ("float16", "float32"), (regions.shape[1], len(rotations), None)
        )
        shapes = ShapeSamples.of(part(arrays, "shapes"), poses=len(rotations), regions=regions.shape[1])
        basis = PackedBasis.of(part(arrays, "basis"), vertex_count=vertices)
        if basis.mode_count != pose_weights.shape[2] + shapes.weights.shape[2]:
            raise BadModel("the basis has a mode for each output of poses and shapes", basis.mode_count, AGAIN)
        indices = array_of(arrays, "indices", ("uint8", "int32"), (vertices, INFLUENCES)).astype(np.int32)
        nearest = array_of(arrays, "nearest", "int32", (vertices,))
        for name, array, limit in (("bone", indices, JOINT_COUNT), ("vertex of the body", nearest, body_vertices)):
            if array.size and not (array.min() >= 0 and array.max() < limit):
                raise BadModel(f"the model names a {name} that does not exist", int(array.max()), AGAIN)
        return cls(
            indices=indices,
            weights=array_of(arrays, "weights", "float32", (vertices, INFLUENCES)),
            nearest=nearest,
            regions=regions,
            axes=array_of(arrays, "axes", "float32", (regions.shape[1], 3 * JOINT_COUNT)),
            rotations=rotations,
            rest=array_of(arrays, "rest", "float32", (vertices, 3)),
            rest_effects=array_of(arrays, "rest_effects", "float16", (None, vertices, 3)).astype(np.float32),
            offset=array_of(arrays, "offset", "float32", (vertices, 3)),
            basis=basis,
            pose_weights=pose_weights.astype(np.float32),
            shapes=shapes,
            rigged=RiggedTables.of(part(arrays, "rigged"), vertices=vertices, poses=len(rotations)) if rigged else None,
        )

"""All arrays of a model, as they are played."""

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
    """Arrays of AgentDress, float32 and int32; coordinates are those of the body's rest pose.

    Attributes:
        indices: Bones of each vertex.
        weights: Their weights.
        nearest: Vertex of the body under each of the garment's.
        regions: Share of each region in each vertex.
        axes: What each axis of each joint's frame counts for in the distances of each region.
        rotations: Poses of the kernels; the first ones are those of the anchors.
        rest: The garment of the mean shape, as skinning carries it [m].
        rest_effects: What the features of the shape, of all betas, do to it [m].
        offset: What is added to it in the turned frames of the vertices, mean over these poses [m].
        basis: Directions of the pose model, then those of the shape.
        pose_weights: What each pose adds to each direction, by region.
        shapes: What each shape adds to each of these, by pose and region; one region stands for all where anchors are
            blended.
        clearances: How far off the skin each vertex is kept, at least [m].
        rigged: The pose model, where it is rigging; then the basis has directions of the shape alone.
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
    clearances: Float[np.ndarray, " verts"]
    rigged: RiggedTables | None = None

    def arrays(self) -> dict[str, np.ndarray]:
        """What a model file holds; effects of the shape in half precision."""
        parts = {"basis": self.basis, "shapes": self.shapes} | ({"rigged": self.rigged} if self.rigged else {})
        held = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("basis", "shapes", "rigged")}
        held["rest_effects"] = held["rest_effects"].astype(np.float16)
        return held | {f"{part}.{name}": array for part, of in parts.items() for name, array in of.arrays().items()}

    def at_vertices(self, kept: Int[np.ndarray, " kept"]) -> Self:
        """The same of some of the vertices."""
        of_vertices = ("indices", "weights", "nearest", "regions", "rest", "offset", "clearances")
        held = {name: np.ascontiguousarray(getattr(self, name)[kept]) for name in of_vertices}
        effects = np.ascontiguousarray(self.rest_effects[:, kept])
        rigged = self.rigged and self.rigged.at_vertices(kept)
        return replace(self, **held, rest_effects=effects, basis=self.basis.at_vertices(kept), rigged=rigged)

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, vertices: int, body_vertices: int, rigged: bool) -> Self:
        """Read them back, with rigged anchors or without.

        Raises:
            BadModel: One is missing, or of another type or shape than the others ask for.
        """
        regions = array_of(arrays, "regions", "float32", (vertices, None))
        rotations = array_of(arrays, "rotations", "float32", (None, JOINT_COUNT, 4))
        pose_weights = array_of(arrays, "pose_weights", "float32", (regions.shape[1], len(rotations), None))
        shapes = ShapeSamples.of(part(arrays, "shapes"), poses=len(rotations), regions=regions.shape[1])
        basis = PackedBasis.of(part(arrays, "basis"), vertex_count=vertices)
        if basis.mode_count != pose_weights.shape[2] + shapes.weights.shape[2]:
            raise BadModel("the basis has a mode for each output of poses and shapes", basis.mode_count, AGAIN)
        indices = array_of(arrays, "indices", "int32", (vertices, INFLUENCES))
        nearest = array_of(arrays, "nearest", "int32", (vertices,))
        for name, found, limit in (("bone", indices, JOINT_COUNT), ("vertex of the body", nearest, body_vertices)):
            if found.size and not (found.min() >= 0 and found.max() < limit):
                raise BadModel(f"the model names a {name} that does not exist", int(found.max()), AGAIN)
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
            pose_weights=pose_weights,
            shapes=shapes,
            clearances=array_of(arrays, "clearances", "float32", (vertices,)),
            rigged=RiggedTables.of(part(arrays, "rigged"), vertices=vertices, poses=len(rotations)) if rigged else None,
        )

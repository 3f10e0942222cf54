"""Arrays of a body model, by which a mesh depends on shape and pose. This is data only; users hold a `body.Body`."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from hemline.arrays import Faces, Joints, Quaternions, Vertices
from hemline.errors import BadBody
from hemline.files import content_hash
from hemline.motions import JOINT_NAMES

INFLUENCES = 6
"""Largest number of joints that move one vertex."""


@dataclass(frozen=True, eq=False)
class BodyModel:
    """A skinned mesh on the 24-joint skeleton, linear in its shape coefficients.

    Attributes:
        name: Name of the body, such as `anny24`.
        template: Vertices at rest in the mean shape [m].
        faces: Triangles, counter-clockwise from outside.
        shapedirs: Change of the template at rest by one standard deviation of each beta [m].
        joints: Joints at rest in the mean shape, the pelvis at the origin [m].
        joint_shapedirs: Change of the joints by each beta [m].
        weight_indices: Joints that move each vertex, the strongest first.
        weights: Weights of these joints, which sum to 1; unused ones are 0.
        parents: Parent of each joint, -1 for the pelvis; parents come before their children.
        rest_offsets: Global rotation of each joint that takes its bone from the template's own pose to the T-pose.
        licence: Terms of the data.
        posedirs: Change of the template at rest by the rotation of each joint but the pelvis, nine for each, row by
            row of R - I, see `pose_offsets` [m]; None: the skin follows the joints alone.
        accessory_vertices: Number of vertices, the last ones, that belong to rigid accessories.
        bare_name: Name of the body without its accessories; empty if it has none.

    Raises:
        BadBody: Array shapes do not match, numbers are NaN, indices are out of range, or weights do not sum to 1.
    """

    name: str
    template: Vertices
    faces: Faces
    shapedirs: Float[np.ndarray, "betas verts 3"]
    joints: Joints
    joint_shapedirs: Float[np.ndarray, "betas joints 3"]
    weight_indices: Int[np.ndarray, "verts influences"]
    weights: Float[np.ndarray, "verts influences"]
    parents: Int[np.ndarray, " joints"]
    rest_offsets: Quaternions
    licence: str
    posedirs: Float[np.ndarray, "features verts 3"] | None = None
    accessory_vertices: int = 0
    bare_name: str = ""

    def __post_init__(self) -> None:
        verts, betas, joints = len(self.template), len(self.shapedirs), len(JOINT_NAMES)
        shapes = {
            "template": (verts, 3),
            "faces": (len(self.faces), 3),
            "shapedirs": (betas, verts, 3),
            "joints": (joints, 3),
            "joint_shapedirs": (betas, joints, 3),
            "weight_indices": (verts, INFLUENCES),
            "weights": (verts, INFLUENCES),
            "parents": (joints,),
            "rest_offsets": (joints, 4),
        } | ({} if self.posedirs is None else {"posedirs": (9 * (joints - 1), verts, 3)})
        integers = {"faces", "weight_indices", "parents"}
        for field, shape in shapes.items():
            array = np.asarray(getattr(self, field))
            self._check(array.shape == shape, f"'{field}' must have shape {shape}", array.shape)
            self._check(bool(np.isfinite(array).all()), f"'{field}' must be finite", "NaN or infinity")
            kind = np.int32 if field in integers else np.float32
            object.__setattr__(self, field, np.ascontiguousarray(array, dtype=kind))
        self._check_indices()

    def _check_indices(self) -> None:
        verts = len(self.template)
        self._check(verts > 0 and len(self.faces) > 0, "there must be vertices and faces", f"{verts} vertices")
        for field, limit in (("faces", verts), ("weight_indices", len(self.joints))):
            low, high = getattr(self, field).min(), getattr(self, field).max()
            self._check(low >= 0 and high < limit, f"'{field}' must lie in 0..{limit - 1}", f"{low}..{high}")
        own = verts - self.accessory_vertices
        belongs = self.faces < own
        apart = 0 < own <= verts and bool((belongs.all(axis=1) | ~belongs.any(axis=1)).all())
        self._check(apart, "accessories must be the last vertices, not connected to others", self.accessory_vertices)
        early = self.parents < np.arange(len(self.parents))
        rooted = self.parents[0] == -1 and (self.parents[1:] >= 0).all()
        self._check(bool(early.all() and rooted), "each parent must come before its child", self.parents.tolist())
        sums = self.weights.sum(axis=1, dtype=np.float64)
        self._check(bool(np.abs(sums - 1).max() < 1e-4), "weights of a vertex must sum to 1", f"{sums.min():.4f}")
        lengths = np.linalg.norm(self.rest_offsets, axis=1)
        self._check(bool(np.abs(lengths - 1).max() < 1e-3), "'rest_offsets' must be unit", f"{lengths.min():.4f}")

    def _check(self, good: bool, what: str, got: object) -> None:
        if not good:
            raise BadBody(f"body '{self.name}': {what}", got, "make or copy the body file again")

    @cached_property
    def hash(self) -> str:
        """Short hash of everything that shapes and moves the mesh."""
        return content_hash(
            self.template,
            self.faces,
            self.shapedirs,
            self.joints,
            self.joint_shapedirs,
            self.weight_indices,
            self.weights,
            self.parents,
            self.rest_offsets,
            *(() if self.posedirs is None else (self.posedirs,)),
        )

"""The clip that is exported: a garment and the body under it, frame by frame."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import BodyFaces, Faces, Float, FramesOfBodyVertices, FramesOfVertices, Int, Joints, Vertices
from hemline.errors import BadInput


@dataclass(frozen=True)
class ClipSkeleton:
    """A skeleton that deforms a mesh by linear blend skinning, for formats that support skins.

    Attributes:
        joints: Rest positions [m].
        parents: Parent of each joint, which precedes it; -1 for a root. Only roots move relative to their parents.
        transforms: Skin transforms of each frame, from rest to pose, without scale.
        vertices: Rest positions of the mesh's vertices [m].
        weight_indices: Joints that move each vertex.
        weights: Weights of those joints; each row sums to 1.
        names: Names of the joints.
    """

    joints: Joints
    parents: Int[np.ndarray, " joints"]
    transforms: Float[np.ndarray, "frames joints 3 4"]
    vertices: Vertices
    weight_indices: Int[np.ndarray, "verts influences"]
    weights: Float[np.ndarray, "verts influences"]
    names: tuple[str, ...] = ()

    @property
    def turns(self) -> Float[np.ndarray, "frames joints 3 3"]:
        """Rotation matrices relative to the parent, those of roots relative to the world [1]."""
        rotations, parents = np.asarray(self.transforms, np.float64)[..., :3], np.asarray(self.parents)
        local, child = rotations.copy(), np.flatnonzero(parents >= 0)
        local[:, child] = np.swapaxes(rotations[:, parents[child]], -1, -2) @ rotations[:, child]
        return local

    @property
    def rest_places(self) -> Joints:
        """Rest positions relative to the parent, those of roots relative to the world [m]."""
        joints, parents = np.asarray(self.joints, np.float64), np.asarray(self.parents)
        return joints - np.where(parents[:, None] >= 0, joints[parents], 0)

    @property
    def root_paths(self) -> dict[int, Float[np.ndarray, "frames 3"]]:
        """Path of each root [m]; other joints keep their position relative to the parent."""
        transforms, joints = np.asarray(self.transforms, np.float64), np.asarray(self.joints, np.float64)
        roots = np.flatnonzero(np.asarray(self.parents) < 0).tolist()
        return {root: transforms[:, root, :, :3] @ joints[root] + transforms[:, root, :, 3] for root in roots}


@dataclass(frozen=True)
class SkinWeights:
    """Bones whose skinning approximates the motion of the garment.

    Attributes:
        skeleton: The bones, each of them a root, with at most four per vertex.
        mean_error_mm: Mean distance between skinned and original vertices, over vertices and frames [mm].
        max_error_mm: Largest such distance [mm].
    """

    skeleton: ClipSkeleton
    mean_error_mm: float
    max_error_mm: float

    @property
    def bone_count(self) -> int:
        """Number of bones of the garment."""
        return len(self.skeleton.joints)


@dataclass(frozen=True)
class ClipPart:
    """One mesh of a clip."""

    name: str
    suffix: str
    """Text after the stem of a file name, in formats with one mesh per file."""
    vertices: FramesOfVertices
    faces: Faces
    colour: tuple[float, float, float]
    skeleton: ClipSkeleton | None = None


@dataclass(frozen=True)
class Clip:
    """A garment over time, with the body that wears it.

    Attributes:
        vertices: Vertices of the garment in each frame [m].
        faces: Triangles of the garment.
        fps: Frames per second.
        body_vertices: Vertices of the body in the same frames [m], or None.
        body_faces: Triangles of the body, or None.
        name: Name of the garment.
        colour: Colour of the garment, sRGB from 0 to 1.
        body_colour: Colour of the body.
        notices: Licence of the body and acknowledgement of the motion, for formats that can store text.
        skeleton: Skeleton that deforms the body, or None.
        skin: Bones that deform the garment, or None; see `hemline.export.skin_clip`.

    Raises:
        BadInput: Arrays contradict each other, or contain NaN.
    """

    vertices: FramesOfVertices
    faces: Faces
    fps: float
    body_vertices: FramesOfBodyVertices | None = None
    body_faces: BodyFaces | None = None
    name: str = "garment"
    colour: tuple[float, float, float] = (0.72, 0.23, 0.17)
    body_colour: tuple[float, float, float] = (0.70, 0.68, 0.66)
    notices: tuple[str, ...] = ()
    skeleton: ClipSkeleton | None = None
    skin: SkinWeights | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.fps) and self.fps > 0):
            raise BadInput("a clip's fps must be positive", self.fps, "give frames a second, such as 30.0")
        if (self.body_vertices is None) != (self.body_faces is None):
            raise BadInput("a body needs vertices and faces", "only one of them", "give both, or neither")
        for part in self.parts:
            _check_part(part)
        if self.body_vertices is not None and len(self.body_vertices) != len(self.vertices):
            got = f"{len(self.vertices)} and {len(self.body_vertices)}"
            raise BadInput("garment and body must have the same number of frames", got, "cut both to the same frames")
        if self.skeleton is not None:
            _check_skeleton(self.skeleton, self.body_vertices, "body")
        if self.skin is not None:
            _check_skeleton(self.skin.skeleton, self.vertices, "garment")

    @property
    def parts(self) -> tuple[ClipPart, ...]:
        """The meshes of the clip: the garment, then the body if there is one."""
        bones = None if self.skin is None else self.skin.skeleton
        garment = ClipPart(self.name, "", self.vertices, self.faces, self.colour, bones)
        if self.body_vertices is None or self.body_faces is None:
            return (garment,)
        return garment, ClipPart("body", "_body", self.body_vertices, self.body_faces, self.body_colour, self.skeleton)

    @property
    def frame_count(self) -> int:
        """Number of frames of the clip."""
        return len(self.vertices)


def _check_part(part: ClipPart) -> None:
    vertices, faces = part.vertices, part.faces
    if vertices.ndim != 3 or vertices.shape[2] != 3 or 0 in vertices.shape:
        raise BadInput(f"'{part.name}' needs vertices (frames, verts, 3)", vertices.shape, "give at least one frame")
    if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        raise BadInput(f"'{part.name}' needs faces (faces, 3)", faces.shape, "give at least one triangle")
    if faces.min() < 0 or faces.max() >= vertices.shape[1]:
        got = f"indices {faces.min()} to {faces.max()} for {vertices.shape[1]} vertices"
        raise BadInput(f"'{part.name}': a face points past the last vertex", got, "count vertices from 0")
    if not np.isfinite(vertices).all():
        frame = int(np.argmin(np.isfinite(vertices).all(axis=(1, 2))))
        raise BadInput(f"'{part.name}': vertices must be finite", f"NaN or infinity in frame {frame}", "play it again")


def _check_skeleton(skeleton: ClipSkeleton, vertices: np.ndarray | None, mesh: str) -> None:
    expected = None if vertices is None else vertices.shape[:2]
    got = len(skeleton.transforms), len(skeleton.vertices)
    if expected != got:
        what = f"a skeleton must fit its {mesh} of (frames, verts) {expected}"
        raise BadInput(what, got, f"take both from one {mesh}")

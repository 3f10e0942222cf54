"""What the estimator is trained on, as plain arrays; everything is seen from the heading of its own frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hemline.animators.swingar.graph import Graph
from hemline.arrays import Bool, Faces, Float, Int
from hemline.collide.neural_sdf.distance import Distance


@dataclass(frozen=True, eq=False)
class GarmentSample:
    """A garment at rest on one body."""

    graph: Graph
    faces: Faces
    features: Float[np.ndarray, "verts 7"]
    """Normal, position [m], signed distance to the body [m] of each vertex, float32."""
    descriptor: Float[np.ndarray, " descriptor"]
    """Eigenvalues [1], float32."""
    skin_logits: Float[np.ndarray, "verts joints"]
    """Where the dynamic weights start, float32."""
    mass: Float[np.ndarray, " verts"]
    """Mass of each vertex [kg], float32."""


@dataclass(frozen=True, eq=False)
class FrameBatch:
    """Some frames of one garment, float32. The pelvis is the origin, its heading is taken out."""

    motion: Float[np.ndarray, "frames poses 75"]
    """The last 65 poses, the present one last: axis-angles, the pelvis's way since the frame before [m]."""
    transforms: Float[np.ndarray, "frames joints 3 4"]
    """Skinning transforms of the joints [m]."""
    joints: Float[np.ndarray, "frames joints 3"]
    """Positions of the joints [m]."""
    body: Float[np.ndarray, "frames body"]
    """Betas, axis-angles of the present pose."""
    heading: Float[np.ndarray, "frames 3 3"]
    """Rotations from the frame's own heading to one that all frames of a clip share."""
    truth: Float[np.ndarray, "frames verts 3"]
    """The garment of the ground truth [m]."""
    told: Float[np.ndarray, "frames verts told"] | None = None
    """Features of the vertices, see `graph_inputs.vertex_inputs`."""
    turns: Float[np.ndarray, "frames verts 4"] | None = None
    """How skinning turns each vertex, wxyz."""


class Samples(Protocol):
    """A training set. A sample is one frame of one garment, and has a number."""

    @property
    def garments(self) -> Sequence[GarmentSample]:
        """All garments, those of the validation set, too."""
        ...

    @property
    def garment_of(self) -> Int[np.ndarray, " samples"]:
        """Which garment each sample is of."""
        ...

    @property
    def before(self) -> Int[np.ndarray, "samples 2"]:
        """Samples one and two frames before each; at the start of a clip the first itself."""
        ...

    @property
    def wanted(self) -> Bool[np.ndarray, " samples"]:
        """Whether the two frames before a sample are samples, too, or it is the first of its clip."""
        ...

    @property
    def missed(self) -> Float[np.ndarray, " garments"]:
        """Mean distance of each garment that is trained on from skinning [m]; nan: not trained on."""
        ...

    @property
    def training(self) -> Int[np.ndarray, " training"]:
        """Samples to train on."""
        ...

    @property
    def validation(self) -> Int[np.ndarray, " validation"]:
        """Samples to choose the best weights by, of clips that are not trained on."""
        ...

    def frames(self, chosen: Int[np.ndarray, " frames"]) -> FrameBatch:
        """Some samples, all of one garment."""
        ...

    def bodies(self, garment: int, batch: FrameBatch) -> Sequence[Distance]:
        """The signed distance to the body in each frame, as the frame sees it.

        Args:
            garment: Number of the garment.
            batch: Frames of it, as they are or in a mirror.

        Raises:
            BadModel: There is no neural distance to that body.
        """
        ...

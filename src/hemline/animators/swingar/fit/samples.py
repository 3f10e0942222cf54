"""The training data of the estimator as plain arrays. Coordinates are those of a `PelvisFrame`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hemline.animators.swingar.garment_sample import GarmentSample
from hemline.arrays import Bool, Float, Int

if TYPE_CHECKING:
    from torch import Tensor

    from .frame_tensors import FrameTensors


@dataclass(frozen=True, eq=False)
class FrameBatch:
    """Some frames of one garment, float32. The pelvis is the origin, and its heading is removed."""

    motion: Float[np.ndarray, "frames poses 75"]
    """The last 65 poses, the present one last: axis-angles, displacement of the pelvis [m]."""
    transforms: Float[np.ndarray, "frames joints 3 4"]
    """Skinning transforms of the joints [m]."""
    joints: Float[np.ndarray, "frames joints 3"]
    """Positions of the joints [m]."""
    body: Float[np.ndarray, "frames body"]
    """Betas and axis-angles of the present pose."""
    heading: Float[np.ndarray, "frames 3 3"]
    """Rotations from the frame's own heading to one that all frames of a clip share."""
    truth: Float[np.ndarray, "frames verts 3"]
    """Vertices of the ground truth [m]."""
    features: Float[np.ndarray, "frames verts features"] | None = None
    """Features of the vertices, see `graph_inputs.vertex_inputs`."""
    turns: Float[np.ndarray, "frames verts 4"] | None = None
    """Rotation of each vertex by skinning, wxyz."""


class TrainingSamples(Protocol):
    """A training set. Each sample is one frame of one garment and has a number."""

    @property
    def garments(self) -> Sequence[GarmentSample]:
        """All garments, those of the validation set included."""
        ...

    @property
    def garment_of(self) -> Int[np.ndarray, " samples"]:
        """Number of the garment of each sample."""
        ...

    @property
    def before(self) -> Int[np.ndarray, "samples 2"]:
        """Samples one and two frames before each; the first sample of a clip precedes itself."""
        ...

    @property
    def has_past(self) -> Bool[np.ndarray, " samples"]:
        """Whether the two frames before a sample are samples too, or the sample is the first of its clip."""
        ...

    @property
    def skinning_errors(self) -> Float[np.ndarray, " garments"]:
        """Mean distance of each garment that is trained on from skinning [m]; nan for the others."""
        ...

    @property
    def training(self) -> Int[np.ndarray, " training"]:
        """Samples to train on."""
        ...

    @property
    def validation(self) -> Int[np.ndarray, " validation"]:
        """Samples by which the best weights are chosen, of clips that are not trained on."""
        ...

    def frames(self, chosen: Int[np.ndarray, " frames"]) -> FrameBatch:
        """Returns some samples, all of one garment."""
        ...

    def heights(self, garment: int, vertices: "Tensor", frames: "FrameTensors") -> "Tensor":
        """Returns the signed distances of predicted vertices to the body (frames, verts) [m], negative inside.

        Args:
            garment: Number of the garment.
            vertices: The vertices (frames, verts, 3) [m]; distances can be differentiated by them.
            frames: The frames, mirrored or not.

        Raises:
            BadModel: There is no neural distance to that body.
        """
        ...

"""The training data of the estimator as objectives ask for it."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from torch import Tensor

from hemline.animators.swingar.garment_sample import GarmentSample
from hemline.arrays import Bool, Float, Int

from .frame_batch import FrameBatch
from .frame_tensors import FrameTensors


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
        """Samples one and two frames before each; the sample itself if such a frame is missing."""
        ...

    @property
    def has_past(self) -> Bool[np.ndarray, " samples"]:
        """Whether the two frames before a sample are samples too."""
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

    def heights(self, garment: int, vertices: Tensor, frames: FrameTensors) -> Tensor:
        """Returns the signed distances of predicted vertices to the body (frames, verts) [m], negative inside.

        Args:
            garment: Number of the garment.
            vertices: The vertices (frames, verts, 3) [m]; distances can be differentiated by them.
            frames: The frames, mirrored or not.

        Raises:
            BadModel: There is no neural distance to that body.
        """
        ...

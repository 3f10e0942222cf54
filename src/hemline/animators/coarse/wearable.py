"""A network before it is given a garment."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from hemline.animators.model_file import save_model
from hemline.bodies import ShapedBody
from hemline.garments import Garment

from .model import CoarseAnimator
from .weights import NetworkReader, Weights


@dataclass(frozen=True, eq=False)
class CoarseWearable:
    """Moves whatever it is given to wear.

    Example:
        >>> import hemline
        >>> body = hemline.bodies.load("anny24").shaped()
        >>> skirt = hemline.load("lag").worn_by(hemline.garments.load("skirt-light"), body)
        >>> skirt.name
        'lag'
    """

    weights: Weights

    @property
    def name(self) -> str:
        """Name of its kind."""
        return self.weights.kind.name

    @property
    def figures(self) -> Mapping[str, float]:
        """What the fit reached."""
        return self.weights.figures

    def animator_for(self, garment: Garment, body: ShapedBody) -> CoarseAnimator:
        """The animator of one garment on one body: a few seconds, in which the garment settles.

        Raises:
            BadGarment: The garment was made on another body.
            SimulationFailed: The garment could not be settled.
        """
        return CoarseAnimator.on(garment, body, self.weights)

    def beginning(self, seconds: float) -> Self:
        """The same weights, before which a garment is simulated for so long; 0: it begins where skinning puts it.

        Raises:
            BadInput: A time that is negative or not finite.
        """
        return replace(self, weights=replace(self.weights, config=replace(self.weights.config, beginning=seconds)))

    def save(self, path: str | Path) -> None:
        """Write a model file, whole or not at all.

        Raises:
            BadOutput: The path cannot be written.
        """
        save_model(
            path,
            self.name,
            self.weights.arrays(),
            garment=None,
            body={},
            config=asdict(self.weights.config),
            figures=self.weights.figures,
            licences=self.weights.licences,
            extra=self.weights.extra(),
        )

    @classmethod
    def of(cls, kind: NetworkReader, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Make one from what a model file of a kind holds; raises BadModel as `Weights.of`."""
        return cls(Weights.of(kind, arrays, metadata))

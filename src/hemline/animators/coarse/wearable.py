"""A trained network before it is given a garment."""

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
    """A trained network that animates any garment.

    Example:
        >>> import hemline
        >>> body = hemline.bodies.load("anny24").shaped()
        >>> skirt = hemline.load("lag").animator_for(hemline.garments.load("skirt-light"), body)
        >>> skirt.name
        'lag'
    """

    weights: Weights
    """The network with its options and its figures."""

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return self.weights.kind.name

    @property
    def figures(self) -> Mapping[str, float]:
        """Figures of the fit, with their units in the names."""
        return self.weights.figures

    def animator_for(self, garment: Garment, body: ShapedBody) -> CoarseAnimator:
        """Returns the animator of one garment on one body. The garment settles first, which takes a few seconds.

        Raises:
            BadGarment: The garment was made for another body.
            SimulationFailed: The garment could not be settled.
        """
        return CoarseAnimator.on(garment, body, self.weights)

    def with_simulated_start(self, seconds: float) -> Self:
        """Returns the model with another time for which garments are simulated before the network takes over.

        Args:
            seconds: The time [s]; with 0 garments start where skinning puts them.

        Raises:
            BadInput: The time is negative or not finite.
        """
        return replace(self, weights=replace(self.weights, config=replace(self.weights.config, beginning=seconds)))

    def save(self, path: str | Path) -> None:
        """Writes a model file, whole or not at all.

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
        """Reads the model from the contents of a model file; raises BadModel where `Weights.of` does."""
        return cls(Weights.of(kind, arrays, metadata))

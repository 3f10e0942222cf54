"""The clothing shape model of one anchor: the effect of the body shape on the garment in one pose."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.learning.pca import principal_of_rows


def shape_features(betas: Float[np.ndarray, "... betas"]) -> Float[np.ndarray, "... features"]:
    r"""Returns $(\beta, \beta^2)$, with squares taken per element."""
    return np.concatenate([betas, betas**2], axis=-1)


def pad_betas(betas: Float[np.ndarray, "shapes betas"], count: int) -> Float[np.ndarray, "shapes count"]:
    """Cuts or zero-pads each row to `count` betas, float64."""
    result = np.zeros((len(betas), count))
    result[:, : min(count, betas.shape[1])] = betas[:, :count]
    return result


@dataclass(frozen=True)
class ShapeModel:
    r"""$c(\beta) = \bar c + U W (\beta, \beta^2, 1)$.

    Attributes:
        mean: $\bar c + U w_0$, the prediction for a body of mean shape.
        effects: $U W$ for each feature, without the constant.
        explained: Fraction of the variance of the garments that the components explain.
    """

    mean: Float[np.ndarray, " rows"]
    effects: Float[np.ndarray, "features rows"]
    explained: float

    @classmethod
    def fit(
        cls,
        garments: Float[np.ndarray, "shapes rows"],
        betas: Float[np.ndarray, "shapes betas"],
        *,
        components: int,
        ridge: float,
        squares: bool = True,
    ) -> Self:
        """Fits principal components of the garments, and a ridge regression from the shape to their coefficients.

        Args:
            garments: Coordinates of the garment on each shape [m].
            betas: Betas of each shape.
            components: Number of principal components.
            ridge: Penalty on the squared weights; the constant is not penalised.
            squares: Whether squared betas are features too.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, Eq. 5 and 6.
        """
        mean = garments.mean(axis=0)
        basis, coefficients = principal_of_rows(garments - mean, components)
        features = shape_features(betas) if squares else np.asarray(betas, np.float64)
        centre = features.mean(axis=0)
        centred = features - centre
        gram = centred.T @ centred + ridge * np.eye(centred.shape[1])
        weights = np.linalg.solve(gram, centred.T @ coefficients)
        effects = weights @ basis
        if not squares:
            effects = np.concatenate([effects, np.zeros_like(effects)])
            centre = np.concatenate([centre, np.zeros_like(centre)])
        total = float(((garments - mean) ** 2).sum())
        explained = float((coefficients**2).sum()) / total if total > 0 else 1.0
        return cls(mean - centre @ effects, effects, explained)

    def at(self, betas: Float[np.ndarray, "shapes betas"]) -> Float[np.ndarray, "shapes rows"]:
        """Returns the garment on bodies of these shapes [m], ignoring betas beyond those of the fit."""
        return self.mean + shape_features(pad_betas(betas, len(self.effects) // 2)) @ self.effects

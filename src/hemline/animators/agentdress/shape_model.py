"""The clothing shape model of one anchor: what the shape of the body does to the garment in one pose."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Float
from hemline.learning.pca import principal_of_rows


def shape_features(betas: Float[np.ndarray, "... betas"]) -> Float[np.ndarray, "... features"]:
    r"""$(\beta, \beta^2)$, squares element by element."""
    return np.concatenate([betas, betas**2], axis=-1)


def pad_betas(betas: Float[np.ndarray, "shapes betas"], count: int) -> Float[np.ndarray, "shapes count"]:
    """So many betas of each shape, zeros where there are fewer, float64."""
    found = np.zeros((len(betas), count))
    found[:, : min(count, betas.shape[1])] = betas[:, :count]
    return found


@dataclass(frozen=True)
class ShapeModel:
    r"""$c(\beta) = \bar c + U W (\beta, \beta^2, 1)$.

    Attributes:
        mean: $\bar c + U w_0$: the prediction for a body of mean shape.
        effects: $U W$ of each feature, less the constant.
        explained: Share of the variance of the garments that the components hold.
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
        """Components of the garments, and a ridge regression from the shape to their coefficients.

        Args:
            garments: Coordinates of the garment on each shape [m].
            betas: The shapes.
            components: Principal components.
            ridge: What the squares of the weights cost; the constant is free.
            squares: Whether squares of the betas count.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, Eq. 5 and 6.
        """
        mean = garments.mean(axis=0)
        basis, coefficients = principal_of_rows(garments - mean, components)
        features = shape_features(betas) if squares else np.asarray(betas, np.float64)
        centre = features.mean(axis=0)
        away = features - centre
        weights = np.linalg.solve(away.T @ away + ridge * np.eye(away.shape[1]), away.T @ coefficients)
        effects = weights @ basis
        if not squares:
            effects = np.concatenate([effects, np.zeros_like(effects)])
            centre = np.concatenate([centre, np.zeros_like(centre)])
        total = float(((garments - mean) ** 2).sum())
        explained = float((coefficients**2).sum()) / total if total > 0 else 1.0
        return cls(mean - centre @ effects, effects, explained)

    def at(self, betas: Float[np.ndarray, "shapes betas"]) -> Float[np.ndarray, "shapes rows"]:
        """The garment on bodies of these shapes [m]; betas that it does not know are left out."""
        return self.mean + shape_features(pad_betas(betas, len(self.effects) // 2)) @ self.effects

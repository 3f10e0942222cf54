"""What another material than that of the fit adds in any pose, as a model keeps it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, entry
from hemline.garments.material import Material

from .shape_samples import ShapeSamples

STIFFNESS_SCALE, FRICTION_SCALE = 2.0, 10.0
"""Coordinates of a material for a ratio of e, and for a coefficient of friction of 1: so fabrics are 1 to 3 apart."""

LEAST_BENDING = 1e-7
"""Cloth that bends more easily counts as if it had this bending stiffness [N m]."""


def material_coordinates(material: Material, own: Material) -> Float[np.ndarray, "3"]:
    r"""$(2 \ln \frac{Y / \rho}{Y_0 / \rho_0}, 2 \ln \frac{B / \rho}{B_0 / \rho_0}, 10 (\mu - \mu_0))$: where it lies.

    A settled sheet does not change when its stiffness and its weight grow alike: what counts is how Young's modulus Y
    and bending stiffness B stand to the density, and friction.

    Args:
        material: The material.
        own: That of the fit, which lies at the origin.
    """
    stretch, bend = np.log(_to_weight(material) / _to_weight(own))
    friction = material.friction - own.friction
    return np.array([STIFFNESS_SCALE * stretch, STIFFNESS_SCALE * bend, FRICTION_SCALE * friction], np.float32)


def _to_weight(material: Material) -> Float[np.ndarray, "2"]:
    """Stiffness to stretching and to bending over density [m^2/s^2, m^4/s^2]."""
    return np.array([material.young, max(material.bending, LEAST_BENDING)]) / material.density


@dataclass(frozen=True, eq=False)
class Materials:
    r"""What a material adds: $\sum_i \alpha_{g,i} K(D_g^{s_i}(\theta))\, k(m_i, m)$, nothing for the fit's own.

    Attributes:
        own: The material of the fit.
        known: Names of the others that were settled.
        samples: What each garment of another material counts for; coordinates in the place of betas.
        width: Of the kernel over poses.
    """

    own: Material
    known: tuple[str, ...]
    samples: ShapeSamples
    width: float

    def effects(self, material: Material) -> Float[np.ndarray, "regions poses shape_modes"]:
        """What a material adds to each direction at each pose, by region, float32."""
        return self.samples.effects(material_coordinates(material, self.own))

    def in_half_precision(self) -> Self:
        """As a model file keeps it."""
        return replace(self, samples=self.samples.in_half_precision())

    def is_outside(self, material: Material) -> bool:
        """Whether a material lies outside of all that were settled, in one of its coordinates."""
        where = material_coordinates(material, self.own)
        low, high = np.minimum(self.samples.betas.min(axis=0), 0), np.maximum(self.samples.betas.max(axis=0), 0)
        return bool(((where < low - 1e-3) | (where > high + 1e-3)).any())

    def arrays(self) -> dict[str, np.ndarray]:
        """What a model file holds, beside `metadata`."""
        return self.samples.arrays()

    def metadata(self) -> dict[str, Any]:
        """What it holds that is no array."""
        return {"own": self.own.as_dict(), "known": list(self.known), "width": self.width}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any], *, poses: int, regions: int) -> Self:
        """Read them back.

        Raises:
            BadModel: An array or a key is missing, or of another shape or type than the rest asks for.
            BadGarment: The material of the fit is none.
        """
        samples = ShapeSamples.of(arrays, poses=poses, regions=regions)
        if samples.betas.shape[1] != 3 or len(samples.weights) != regions:
            raise BadModel("a material has three coordinates, told for each region", samples.betas.shape, AGAIN)
        width = entry(metadata, "width", float)
        if not (np.isfinite(width) and width > 0):
            raise BadModel("the kernel of the materials has a positive width", width, AGAIN)
        known = tuple(str(name) for name in entry(metadata, "known", list))
        return cls(Material.of(entry(metadata, "own", dict)), known, samples, width)

"""The effect of materials other than that of the fit, in any pose, as a model stores it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, entry
from hemline.garments.material import Material

from .shape_samples import ShapeSamples

STIFFNESS_SCALE, FRICTION_SCALE = 2.0, 10.0
"""Material coordinates per unit of log stiffness, and per unit of friction coefficient: fabrics are 1 to 3 apart."""

LEAST_BENDING = 1e-7
"""Lower limit of the bending stiffness in material coordinates [N m]."""


def material_coordinates(material: Material, own: Material) -> Float[np.ndarray, "3"]:
    r"""Returns $(2 \ln \frac{Y / \rho}{Y_0 / \rho_0}, 2 \ln \frac{B / \rho}{B_0 / \rho_0}, 10 (\mu - \mu_0))$.

    The drape of a sheet does not change when stiffness and weight grow by the same factor. What counts are friction and
    the ratios of Young's modulus Y and bending stiffness B to the density.

    Args:
        material: The material.
        own: The material of the fit, which lies at the origin.
    """
    stretch, bend = np.log(_stiffness_to_density(material) / _stiffness_to_density(own))
    friction = material.friction - own.friction
    return np.array([STIFFNESS_SCALE * stretch, STIFFNESS_SCALE * bend, FRICTION_SCALE * friction], np.float32)


def _stiffness_to_density(material: Material) -> Float[np.ndarray, "2"]:
    """Returns stretching and bending stiffness over density [m^2/s^2, m^4/s^2]."""
    return np.array([material.young, max(material.bending, LEAST_BENDING)]) / material.density


@dataclass(frozen=True, eq=False)
class Materials:
    r"""Effect of a material: $\sum_i \alpha_{g,i} K(D_g^{s_i}(\theta))\, k(m_i, m)$, 0 for the material of the fit.

    Attributes:
        own: The material of the fit.
        known: Names of the other materials that were draped.
        samples: Kernel weights of the garments of other materials, with material coordinates in place of betas.
        width: Width of the kernel over poses.
    """

    own: Material
    known: tuple[str, ...]
    samples: ShapeSamples
    width: float

    def effects(self, material: Material) -> Float[np.ndarray, "regions poses shape_modes"]:
        """Returns the effect of a material on each mode at each pose, per region, float32."""
        return self.samples.effects(material_coordinates(material, self.own))

    def is_outside(self, material: Material) -> bool:
        """Whether a material lies outside the range of the draped ones in any coordinate."""
        position = material_coordinates(material, self.own)
        low, high = np.minimum(self.samples.betas.min(axis=0), 0), np.maximum(self.samples.betas.max(axis=0), 0)
        return bool(((position < low - 1e-3) | (position > high + 1e-3)).any())

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file."""
        return self.samples.arrays()

    def metadata(self) -> dict[str, Any]:
        """Returns the metadata of a model file."""
        return {"own": self.own.as_dict(), "known": list(self.known), "width": self.width}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any], *, poses: int, regions: int) -> Self:
        """Reads the arrays and metadata of a model file.

        Raises:
            BadModel: An array or a key is missing, or has the wrong shape or type.
            BadGarment: The entry for the material of the fit is not a material.
        """
        samples = ShapeSamples.of(arrays, poses=poses, regions=regions)
        if samples.betas.shape[1] != 3 or len(samples.weights) != regions:
            raise BadModel("a material has three coordinates, with weights for each region", samples.betas.shape, AGAIN)
        width = entry(metadata, "width", float)
        if not (np.isfinite(width) and width > 0):
            raise BadModel("the kernel of the materials has a positive width", width, AGAIN)
        known = tuple(str(name) for name in entry(metadata, "known", list))
        return cls(Material.of(entry(metadata, "own", dict)), known, samples, width)

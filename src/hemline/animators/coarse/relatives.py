"""Which of the garments of the fit are most like one that it never saw."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from hemline.animators.coarse.features.descriptor import Descriptor, compress_eigenvalues
from hemline.arrays import Float
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, entry
from hemline.garments import Garment

DESCRIPTOR_SIZE = 256
"""Numbers of a descriptor."""
RELATIVE_COUNT = 3
"""How many relatives are told, as in the paper's Fig. 7."""


@dataclass(frozen=True, eq=False)
class Relatives:
    """The garments of the fit by their spectral descriptors."""

    names: list[str]
    eigenvalues: Float[np.ndarray, "garments 256"]

    @classmethod
    def of_garments(cls, proxies: Sequence[Garment]) -> Self:
        """Those of some proxies."""
        found = [_spectrum(each) for each in proxies]
        return cls([each.name for each in proxies], np.array(found, np.float32).reshape(-1, DESCRIPTOR_SIZE))

    def merge(self, others: Self) -> Self:
        """Together with others; of one name the others' is kept."""
        kept = [i for i, name in enumerate(self.names) if name not in set(others.names)]
        names = [*(self.names[i] for i in kept), *others.names]
        return type(self)(names, np.concatenate([self.eigenvalues[kept], others.eigenvalues]))

    def nearest(self, proxy: Garment) -> list[tuple[str, float]]:
        """The nearest few to a proxy, and how far each is: 1 as far as a garment of the fit is from its nearest one.

        Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Section V-A, Fig. 7. Differs: see `Descriptor.distance`.
        """
        if len(self.names) < 2:
            return []
        own = compress_eigenvalues(_spectrum(proxy))
        apart = np.linalg.norm(compress_eigenvalues(self.eigenvalues) - own, axis=1) / self._spacing
        return [(self.names[i], float(apart[i])) for i in np.argsort(apart, kind="stable")[:RELATIVE_COUNT]]

    @property
    def _spacing(self) -> float:
        """Median distance of a garment of the fit from the nearest other one."""
        values = compress_eigenvalues(self.eigenvalues)
        apart = np.linalg.norm(values[:, None] - values[None], axis=2)
        np.fill_diagonal(apart, np.inf)
        return max(float(np.median(apart.min(axis=1))), 1e-6)

    def arrays(self) -> dict[str, np.ndarray]:
        """As model files hold them."""
        return {"known": self.eigenvalues}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """From a model file; raises BadModel."""
        names = entry(metadata, "garments", list)
        if not all(isinstance(name, str) for name in names):
            raise BadModel("garments of the fit are named by text", repr(names)[:60], AGAIN)
        return cls(names, array_of(arrays, "known", "float32", (len(names), DESCRIPTOR_SIZE)))


def _spectrum(proxy: Garment) -> Float[np.ndarray, " descriptor"]:
    """Eigenvalues of a proxy; a small one has fewer points, and zeros fill up."""
    return Descriptor.of(proxy.vertices, proxy.faces, size=min(DESCRIPTOR_SIZE, len(proxy.vertices))).pad_to(DESCRIPTOR_SIZE)

"""The garments of a fit that are most similar to a new one."""

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
"""Number of eigenvalues of a descriptor."""
RELATIVE_COUNT = 3
"""Number of relatives that are returned, as in the paper's Fig. 7."""


@dataclass(frozen=True, eq=False)
class Relatives:
    """The garments of a fit by their spectral descriptors."""

    names: list[str]
    """Names of the garments."""
    eigenvalues: Float[np.ndarray, "garments 256"]
    """Spectral descriptor of each garment."""

    @classmethod
    def of_garments(cls, proxies: Sequence[Garment]) -> Self:
        """Describes the proxies of some garments."""
        spectra = [_spectrum(each) for each in proxies]
        return cls([each.name for each in proxies], np.array(spectra, np.float32).reshape(-1, DESCRIPTOR_SIZE))

    def merge(self, others: Self) -> Self:
        """Returns these garments and others; the others replace those of the same names."""
        own = [i for i, name in enumerate(self.names) if name not in set(others.names)]
        names = [*(self.names[i] for i in own), *others.names]
        return type(self)(names, np.concatenate([self.eigenvalues[own], others.eigenvalues]))

    def nearest(self, proxy: Garment) -> list[tuple[str, float]]:
        """Returns the names of the nearest garments to a proxy with their distances, nearest first.

        A distance of 1 is the median distance of a garment of the fit from the nearest other one.

        Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Section V-A, Fig. 7. Differs: see `Descriptor.distance`.
        """
        if len(self.names) < 2:
            return []
        own = compress_eigenvalues(_spectrum(proxy))
        distances = np.linalg.norm(compress_eigenvalues(self.eigenvalues) - own, axis=1) / self._spacing
        return [(self.names[i], float(distances[i])) for i in np.argsort(distances, kind="stable")[:RELATIVE_COUNT]]

    @property
    def _spacing(self) -> float:
        """Median distance of a garment of the fit from the nearest other one."""
        values = compress_eigenvalues(self.eigenvalues)
        distances = np.linalg.norm(values[:, None] - values[None], axis=2)
        np.fill_diagonal(distances, np.inf)
        return max(float(np.median(distances.min(axis=1))), 1e-6)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file by name."""
        return {"known": self.eigenvalues}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Reads the garments from the contents of a model file; raises BadModel."""
        names = entry(metadata, "garments", list)
        if not all(isinstance(name, str) for name in names):
            raise BadModel("garments of the fit are named by text", repr(names)[:60], AGAIN)
        return cls(names, array_of(arrays, "known", "float32", (len(names), DESCRIPTOR_SIZE)))


def _spectrum(proxy: Garment) -> Float[np.ndarray, " descriptor"]:
    """Returns the descriptor of a proxy; zeros fill it up if the proxy has fewer vertices."""
    return Descriptor.of(proxy.vertices, proxy.faces, size=min(DESCRIPTOR_SIZE, len(proxy.vertices))).pad_to(
        DESCRIPTOR_SIZE
    )

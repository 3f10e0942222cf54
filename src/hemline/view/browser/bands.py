"""Values on cloth as bands of colour; meshes of the page have one colour each, so each band is a mesh."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Vertices

COLOURS = ((214, 214, 210), (247, 214, 130), (240, 150, 70), (205, 70, 55), (110, 20, 80))
"""Colours of the bands from good to bad, sRGB from 0 to 255."""


@dataclass(frozen=True)
class Scale:
    """A colour scale: the values at which one band ends and the next begins."""

    name: str
    unit: str
    edges: tuple[float, ...]

    def bands(self, values: Float[np.ndarray, " faces"]) -> np.ndarray:
        """Returns the band of each value, from 0 on."""
        return np.digitize(values, self.edges)

    @property
    def legend(self) -> tuple[tuple[tuple[int, int, int], str], ...]:
        """The colours, each with its meaning."""
        low, high = self.edges[0], self.edges[-1]
        between = [f"{a:g} to {b:g}" for a, b in zip(self.edges, self.edges[1:], strict=False)]
        words = [f"below {low:g}", *between, f"above {high:g}"]
        return tuple((colour, f"{text} {self.unit}") for colour, text in zip(COLOURS, words, strict=True))


STRETCH = Scale("stretch", "%", (5, 10, 20, 30))
ERROR = Scale("error", "mm", (5, 10, 20, 50))


def split(vertices: Vertices, faces: Faces, bands: np.ndarray) -> list[tuple[Vertices, Faces] | None]:
    """Splits a mesh into one mesh per band, with the vertices of that band only; None where a band is empty.

    Args:
        vertices: Vertices of the garment [m].
        faces: Triangles of the garment.
        bands: The band of each triangle.
    """
    parts: list[tuple[Vertices, Faces] | None] = []
    number = np.empty(len(vertices), np.uint32)
    for band in range(len(COLOURS)):
        corners = faces[bands == band]
        if not len(corners):
            parts.append(None)
            continue
        used = np.zeros(len(vertices), bool)
        used[corners] = True
        number[used] = np.arange(np.count_nonzero(used), dtype=np.uint32)
        parts.append((vertices[used], number[corners]))
    return parts

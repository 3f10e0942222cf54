"""Numbers on cloth as bands of colour: the page's meshes have one colour each, so each band is a mesh."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float, Vertices

COLOURS = ((214, 214, 210), (247, 214, 130), (240, 150, 70), (205, 70, 55), (110, 20, 80))
"""From what is fine to what is worst, sRGB from 0 to 255."""


@dataclass(frozen=True)
class Scale:
    """Where one colour ends and the next begins."""

    name: str
    unit: str
    edges: tuple[float, ...]

    def bands(self, values: Float[np.ndarray, " faces"]) -> np.ndarray:
        """The band of each number, from 0 on."""
        return np.digitize(values, self.edges)

    @property
    def legend(self) -> tuple[tuple[tuple[int, int, int], str], ...]:
        """Colours, each with what it stands for."""
        low, high = self.edges[0], self.edges[-1]
        between = [f"{a:g} to {b:g}" for a, b in zip(self.edges, self.edges[1:], strict=False)]
        words = [f"below {low:g}", *between, f"above {high:g}"]
        return tuple((colour, f"{text} {self.unit}") for colour, text in zip(COLOURS, words, strict=True))


STRETCH = Scale("stretch", "%", (5, 10, 20, 30))
ERROR = Scale("error", "mm", (5, 10, 20, 50))


def split(vertices: Vertices, faces: Faces, bands: np.ndarray) -> list[tuple[Vertices, Faces] | None]:
    """A mesh as one mesh a band, each with its own vertices only; None where a band is empty.

    Args:
        vertices: Of the garment [m].
        faces: Its triangles.
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

"""Draws Fig. 4, the first six estimated eigenvectors of a garment: `python -m papers.swingar.fig04_eigenvectors`.

Writes eigenvectors.png to the given folder, by default out/swingar, and prints a table of distances between the
descriptors of the shipped garments.
"""

import argparse
from pathlib import Path

import numpy as np

from hemline import garments
from hemline.animators.coarse.features.descriptor import Descriptor, eigenvectors
from hemline.pictures import write_png
from hemline.pictures.camera import frame_points
from hemline.pictures.compare import scale_colours
from hemline.pictures.images import add_caption, side_by_side
from hemline.pictures.render import ShadedSurface, render

SIZE = (320, 480)


def picture(name: str) -> np.ndarray:
    """Draws a garment six times, coloured by an eigenvector from its least value (pale) to its largest (dark)."""
    garment = garments.load(name)
    found = eigenvectors(garment.vertices, garment.faces, Descriptor.of(garment.vertices, garment.faces))
    camera = frame_points(garment.vertices, "front", size=SIZE)
    pictures = []
    for i, column in enumerate(found.T):
        colours = scale_colours((column - column.min()) / np.ptp(column))
        surface = ShadedSurface(garment.vertices, garment.faces, inside=(1.0, 1.0, 1.0), sheen=0.0, colours=colours)
        pictures.append(add_caption(render([surface], camera, SIZE, ground=None), str(i + 1)))
    return side_by_side(pictures)


def main() -> None:
    """Draws the figure and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("out/swingar"))
    parser.add_argument("--garment", default="dress-light")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    write_png(options.folder / "eigenvectors.png", picture(options.garment))
    names = [name for name in garments.names() if name.endswith("-light")]
    found = [Descriptor.of(each.vertices, each.faces) for each in map(garments.load, names)]
    print("| | " + " | ".join(names) + " |\n" + "|---" * (len(names) + 1) + "|")
    for name, one in zip(names, found, strict=True):
        print(f"| {name} | " + " | ".join(f"{one.distance(other):.1f}" for other in found) + " |")


if __name__ == "__main__":
    main()

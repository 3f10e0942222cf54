"""Settles the shipped clothes on five bodies: `python -m benchmarks.wardrobe [NAME ...]`.

The bodies are the mean shape and, of two hundred random shapes, the tallest, the shortest, and the heaviest and the
lightest for their height. Each garment is settled and checked (`hemline.tryon.fitness`). Draws
docs/wardrobe/named.png.
"""

import argparse
from pathlib import Path

import numpy as np
import trimesh

from hemline import bodies, pictures
from hemline.bodies import Body, ShapedBody
from hemline.tryon import fitness, open_garment

OUT = Path(__file__).parents[1] / "docs" / "wardrobe" / "named.png"
NAMES = ("cape-light", "skirt-light", "tshirt-light", "longsleeve-light", "trousers-light", "dress-light")
COUNT, SEED, TILE = 200, 3, (240, 320)


def shapes(body: Body) -> dict[str, ShapedBody]:
    """Returns the five bodies by name."""
    generator = np.random.default_rng(SEED)
    samples = [body.shaped(generator.normal(size=16).astype(np.float32)) for _ in range(COUNT)]
    height = np.array([np.ptp(each.vertices[:, 1]) for each in samples])
    volume = np.array([trimesh.Trimesh(each.vertices, body.faces, process=False).volume for each in samples])
    girth = volume / height**2
    picked = {"tall": height.argmax(), "short": height.argmin(), "heavy": girth.argmax(), "thin": girth.argmin()}
    return {"mean": body.shaped()} | {name: samples[int(index)] for name, index in picked.items()}


def main() -> None:
    """Settles, prints and draws."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=NAMES, help="Garments. Defaults to all light ones.")
    options = parser.parse_args()
    tiles, captions = [], []
    bodies_by_name = shapes(bodies.load("anny24"))
    for name in options.names:
        for title, shaped in bodies_by_name.items():
            garment = open_garment(name, shaped, tryon="never", dressed=False)
            result = fitness(garment, shaped)
            print(f"{name:<18}{title:<7}{result.reason or 'worn':<8}", end="")
            print("  ".join(f"{key} {value:.3g}" for key, value in result.figures.items()), flush=True)
            vertices = garment.dressed(shaped).vertices if result.rest is None else result.rest.vertices[0]
            drawn = [(shaped.vertices, shaped.body.faces, "body"), (vertices, garment.faces, "cloth")]
            tiles.append(pictures.picture_of(drawn, size=TILE))
            captions.append(f"{name}, {title}")
    wide = len(bodies_by_name)
    rows = [pictures.side_by_side(tiles[at : at + wide], captions[at : at + wide]) for at in range(0, len(tiles), wide)]
    OUT.parent.mkdir(exist_ok=True)
    pictures.write_png(OUT, np.concatenate(rows))


if __name__ == "__main__":
    main()

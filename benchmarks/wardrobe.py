"""The clothes that ship, on five bodies: `python -m benchmarks.wardrobe [NAME ...]`; no name: all light ones.

Of two hundred random shapes (betas of one standard deviation) the tallest, the shortest, the heaviest and the lightest
for their height, and the mean. Each garment settles and is judged (`hemline.tryon.fitness`); pictures go to
docs/wardrobe/named.png.
"""

import sys
from pathlib import Path

import numpy as np
import trimesh

from hemline import bodies, garments, pictures
from hemline.bodies import Body, ShapedBody
from hemline.tryon import fitness

OUT = Path(__file__).parents[1] / "docs" / "wardrobe" / "named.png"
NAMES = ("cape-light", "skirt-light", "tshirt-light", "longsleeve-light", "trousers-light", "dress-light")
COUNT, SEED, TILE = 200, 3, (240, 320)


def shapes(body: Body) -> dict[str, ShapedBody]:
    """The five."""
    generator = np.random.default_rng(SEED)
    every = [body.shaped(generator.normal(size=16).astype(np.float32)) for _ in range(COUNT)]
    height = np.array([np.ptp(each.vertices[:, 1]) for each in every])
    volume = np.array([trimesh.Trimesh(each.vertices, body.faces, process=False).volume for each in every])
    girth = volume / height**2
    picked = {"tall": height.argmax(), "short": height.argmin(), "heavy": girth.argmax(), "thin": girth.argmin()}
    return {"mean": body.shaped()} | {name: every[int(index)] for name, index in picked.items()}


def main() -> None:
    """Settle, print, draw."""
    tiles, captions = [], []
    on = shapes(bodies.load("anny24"))
    for name in sys.argv[1:] or NAMES:
        for title, shaped in on.items():
            garment = garments.open_garment(name, shaped, dressed=False)
            found = fitness(garment, shaped)
            print(f"{name:<18}{title:<7}{found.reason or 'worn':<8}", end="")
            print("  ".join(f"{key} {value:.3g}" for key, value in found.figures.items()), flush=True)
            vertices = garment.dressed(shaped).vertices if found.rest is None else found.rest.vertices[0]
            drawn = [(shaped.vertices, shaped.body.faces, "body"), (vertices, garment.faces, "cloth")]
            tiles.append(pictures.picture_of(drawn, size=TILE))
            captions.append(f"{name}, {title}")
    wide = len(on)
    rows = [pictures.side_by_side(tiles[at : at + wide], captions[at : at + wide]) for at in range(0, len(tiles), wide)]
    OUT.parent.mkdir(exist_ok=True)
    pictures.write_png(OUT, np.concatenate(rows))


if __name__ == "__main__":
    main()

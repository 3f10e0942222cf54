"""Makes the shipped clothes: `python -m hemline.models.make.wardrobe DATA`, where DATA is the folder `garments`.

Each mesh is tried on the mean `anny24`, settled there, and written with its cut, so that the file holds all that the
simulator needs. Sources: shirts and trousers are from MakeHuman (CC0), the dress from the GarmentCode programs (MIT).
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

from hemline import bodies
from hemline.errors import BadGarment
from hemline.garments.material import Material
from hemline.garments.shipped import WARDROBE_FOLDER
from hemline.tryon.try_on import try_on


@dataclass(frozen=True)
class ClothesSource:
    """Mesh file, material and licence of shipped clothes."""

    mesh: str
    material: str
    licence: str


SOURCES = {
    "tshirt": ClothesSource("makehuman_cc0/tshirt_sub1.obj", "jersey", "CC0-1.0, MakeHuman"),
    "longsleeve": ClothesSource("makehuman_cc0/longsleeve_sub1.obj", "jersey", "CC0-1.0, MakeHuman"),
    "trousers": ClothesSource("makehuman_cc0/jeans_sub1.obj", "cotton", "CC0-1.0, MakeHuman"),
    "dress": ClothesSource(
        "garmentcode_mit/dress_mean_all.obj", "cotton", "MIT, (c) 2024 Maria Korosteleva, GarmentCode"
    ),
}


def main() -> None:
    """Makes all clothes, or the named ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="Folder with the mesh files.")
    parser.add_argument("names", nargs="*", default=list(SOURCES), help="Names of clothes. Defaults to all.")
    options = parser.parse_args()
    shaped = bodies.load("anny24").shaped()
    WARDROBE_FOLDER.mkdir(parents=True, exist_ok=True)
    for name in options.names:
        source = SOURCES[name]
        tried = try_on(options.data / source.mesh, shaped)
        if tried.fitness.reason or tried.fitness.rest is None:
            raise BadGarment(f"'{name}' must be worn", tried.fitness.reason, "look at its mesh")
        garment = replace(
            tried.garment,
            name=name,
            vertices=tried.fitness.rest.vertices[0],
            material=Material.of(source.material),
            flat_rest=True,
            notes=(f"made of {source.mesh} ({source.licence})", *tried.garment.notes),
        )
        garment.save(WARDROBE_FOLDER / f"{name}.safetensors")


if __name__ == "__main__":
    main()

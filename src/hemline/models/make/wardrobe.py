"""Make the clothes that ship: `python -m hemline.models.make.wardrobe DATA`, DATA being the folder `garments`.

Each mesh is tried on the mean `anny24`, settles there, and is written with its cut, so that the file holds all that
the simulator needs. Sources: shirts and trousers are MakeHuman's (CC0), the dress is of GarmentCode's programs (MIT).
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

from hemline import bodies
from hemline.errors import BadGarment
from hemline.garments.material import Material
from hemline.garments.wardrobe import FOLDER
from hemline.tryon.try_on import try_on


@dataclass(frozen=True)
class Source:
    """Where one comes from."""

    mesh: str
    material: str
    licence: str


SOURCES = {
    "tshirt": Source("makehuman_cc0/tshirt_sub1.obj", "jersey", "CC0-1.0, MakeHuman"),
    "longsleeve": Source("makehuman_cc0/longsleeve_sub1.obj", "jersey", "CC0-1.0, MakeHuman"),
    "trousers": Source("makehuman_cc0/jeans_sub1.obj", "cotton", "CC0-1.0, MakeHuman"),
    "dress": Source("garmentcode_mit/dress_mean_all.obj", "cotton", "MIT, (c) 2024 Maria Korosteleva, GarmentCode"),
}


def main() -> None:
    """Make all, or those named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("names", nargs="*", default=list(SOURCES))
    arguments = parser.parse_args()
    shaped = bodies.load("anny24").shaped()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in arguments.names:
        source = SOURCES[name]
        tried = try_on(arguments.data / source.mesh, shaped)
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
        garment.save(FOLDER / f"{name}.safetensors")


if __name__ == "__main__":
    main()

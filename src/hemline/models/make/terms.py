"""Writes the licences of its sources into each shipped file: `python -m hemline.models.make.terms [--unfitted]`.

It is the last step after a shipped file was made. Arrays, and so the hashes of bodies and garments, do not change.
NOTICE and `README.md` beside the models say the same in more words. With `--unfitted` it first writes
`live.safetensors` and `skinned.safetensors`, which hold the default options of these animators and nothing else.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load

from hemline.animators.live import Live
from hemline.animators.skinned import Skinned
from hemline.animators.terms import MADE_OF
from hemline.files import atomic_write
from hemline.files.tensors import tensor_bytes
from hemline.motions.terms import CMU_TERMS

from .body import LICENCE as BODY
from .wardrobe import SOURCES

FOLDER = Path(__file__).parents[1]
OWN = "CC0-1.0 as far as the hemline authors' own part goes"
TRAINED_ON = (
    "trained on garments of the hemline authors (CC0-1.0), of MakeHuman (CC0-1.0) and of GarmentCode "
    "(MIT, (c) 2024 Maria Korosteleva)"
)


def _mesh(name: str) -> str:
    """Returns the note on the mesh of a wardrobe garment."""
    return f"{MADE_OF}{SOURCES[name].mesh} ({SOURCES[name].licence})"


TERMS: dict[str, tuple[str, ...]] = {
    "cape": (BODY, CMU_TERMS, OWN),
    "skirt": (BODY, CMU_TERMS, OWN),
    "knee-dress": (BODY, CMU_TERMS, OWN),
    "robe": (BODY, CMU_TERMS, OWN),
    "tshirt-light": (BODY, _mesh("tshirt"), CMU_TERMS, OWN),
    "longsleeve-light": (BODY, _mesh("longsleeve"), CMU_TERMS, OWN),
    "trousers-light": (BODY, _mesh("trousers"), CMU_TERMS, OWN),
    "lag": (BODY, TRAINED_ON, CMU_TERMS, OWN),
    "swingar": (BODY, TRAINED_ON, CMU_TERMS, OWN),
    "anny24-sdf": (BODY, CMU_TERMS, OWN),
    "live": (OWN,),
    "skinned": (OWN,),
}
"""Licences of each file that holds `licences`: of the body, the garment mesh, and the motions of the fit."""
CLIPS = ("excerpts", "varied")
"""Files of clips, each of which has CMU's terms."""


def read_contents(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Returns the arrays and the JSON metadata of a shipped file."""
    data = path.read_bytes()
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    return load(data), json.loads(header["__metadata__"]["hemline"])


def add_terms(name: str, metadata: dict[str, Any]) -> dict[str, Any]:
    """Returns the JSON metadata of a file with its licences set.

    Args:
        name: Name of the file without its ending.
        metadata: Its JSON metadata.
    """
    if name in CLIPS:
        clips = {clip: entry | {"licence": CMU_TERMS} for clip, entry in metadata["motions"].items()}
        return metadata | {"motions": clips}
    return metadata | {"licences": list(TERMS[name])}


def main() -> None:
    """Writes the files whose licences changed, and prints their names."""
    parser = argparse.ArgumentParser(description="Write the licences of its sources into each shipped file.")
    parser.add_argument("--unfitted", action="store_true", help="Write the models that hold options only first.")
    if parser.parse_args().unfitted:
        for model in (Live(), Skinned()):
            model.save(FOLDER / f"{model.name}.safetensors")
    for name in (*TERMS, *CLIPS):
        path = FOLDER / f"{name}.safetensors"
        arrays, metadata = read_contents(path)
        updated = add_terms(name, metadata)
        if updated != metadata:
            with atomic_write(path) as temporary:
                temporary.write_bytes(tensor_bytes(arrays, updated))
            sys.stdout.write(f"{path.name}\n")


if __name__ == "__main__":
    main()

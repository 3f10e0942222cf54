"""Write into each file that ships whose data it is made of: `python -m hemline.models.make.terms`.

The last step of whatever makes one of them. Of a file the terms alone change: its arrays, and so the hashes of bodies
and garments, stay as they are, bit for bit. NOTICE and `README.md` beside the models say the same in more words.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load

from hemline.animators.terms import MADE_OF
from hemline.files import written_whole
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
    """The note of a garment of the wardrobe."""
    return f"{MADE_OF}{SOURCES[name].mesh} ({SOURCES[name].licence})"


TERMS: dict[str, tuple[str, ...]] = {
    "cape": (BODY, CMU_TERMS, OWN),
    "skirt": (BODY, CMU_TERMS, OWN),
    "tshirt-light": (BODY, _mesh("tshirt"), CMU_TERMS, OWN),
    "longsleeve-light": (BODY, _mesh("longsleeve"), CMU_TERMS, OWN),
    "trousers-light": (BODY, _mesh("trousers"), CMU_TERMS, OWN),
    "lag": (BODY, TRAINED_ON, CMU_TERMS, OWN),
    "swingar": (BODY, CMU_TERMS, OWN),
    "anny24-sdf": (BODY, CMU_TERMS, OWN),
    "live": (OWN,),
}
"""Of each file that holds `licences`: of the body, of the garment's mesh, of the motions that it was fitted to."""
CLIPS = "excerpts"
"""The file of clips, each of which has CMU's terms."""


def contents(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Arrays and JSON of a file that ships."""
    data = path.read_bytes()
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    return load(data), json.loads(header["__metadata__"]["hemline"])


def with_terms(name: str, metadata: dict[str, Any]) -> dict[str, Any]:
    """The JSON of a file with its terms as they are.

    Args:
        name: The file's, without its ending.
        metadata: Its JSON.
    """
    if name == CLIPS:
        clips = {clip: told | {"licence": CMU_TERMS} for clip, told in metadata["motions"].items()}
        return metadata | {"motions": clips}
    return metadata | {"licences": list(TERMS[name])}


def main() -> None:
    """Write those whose terms are others, and say which."""
    for name in (*TERMS, CLIPS):
        path = FOLDER / f"{name}.safetensors"
        arrays, metadata = contents(path)
        stated = with_terms(name, metadata)
        if stated != metadata:
            with written_whole(path) as temporary:
                temporary.write_bytes(tensor_bytes(arrays, stated))
            sys.stdout.write(f"{path.name}\n")


if __name__ == "__main__":
    main()

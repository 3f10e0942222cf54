"""`hemline character MODEL -o FILE.vrm`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class CharacterOptions:
    """Options of `hemline character`."""

    model: Annotated[str, tyro.conf.Positional]
    """Model of rope chains: a file, or the name of a shipped model (cape, skirt)."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """File to write (.vrm)."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape."""
    body: str | None = None
    """Body to use, with the topology of the model's body. Defaults to the body of the model."""
    json: bool = False
    """Print one JSON object with file, size [bytes], and numbers of vertices, chains, bones and colliders."""


def run(options: CharacterOptions) -> int:
    """Settles the garment in the T-pose and writes the file."""
    from hemline.animators import load
    from hemline.cli.model import body_of
    from hemline.export import check_character_path, write_vrm
    from hemline.playback import character

    check_character_path(options.output)
    model = load(options.model)
    person = character(model, body_of(model, options.body, options.betas))
    write_vrm(options.output, person)
    if not options.json:
        print(options.output)
        return 0
    summary = {
        "file": str(options.output),
        "bytes": options.output.stat().st_size,
        "vertices": {mesh.name: len(mesh.vertices) for mesh in person.meshes},
        "chains": len(person.chains.joints),
        "bones": len(person.chains.bones),
        "colliders": len(person.capsules.joints),
    }
    print(json.dumps(summary))
    return 0

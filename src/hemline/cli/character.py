"""`hemline character MODEL -o FILE.vrm`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class Arguments:
    """Write a body in a garment as VRM 1.0; an engine swings the garment by itself."""

    model: Annotated[str, tyro.conf.Positional]
    """A model file of rope chains, or the name of a shipped one: cape, skirt."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The file: .vrm."""
    betas: tuple[float, ...] = ()
    """Shape of the body."""
    body: str | None = None
    """Another body of the same topology; left out: the model's."""
    json: bool = False
    """Print one JSON object: file, bytes, vertices, chains, bones, colliders."""


def run(arguments: Arguments) -> int:
    """Settle the garment in the T-pose, write."""
    from hemline.animators import load
    from hemline.export import check_character_path, write_vrm
    from hemline.playback import character

    from .model import body_of

    check_character_path(arguments.output)
    model = load(arguments.model)
    person = character(model, body_of(model, arguments.body, arguments.betas))
    write_vrm(arguments.output, person)
    if not arguments.json:
        print(arguments.output)
        return 0
    said = {
        "file": str(arguments.output),
        "bytes": arguments.output.stat().st_size,
        "vertices": {mesh.name: len(mesh.vertices) for mesh in person.meshes},
        "chains": len(person.chains.joints),
        "bones": len(person.chains.bones),
        "colliders": len(person.capsules.joints),
    }
    print(json.dumps(said))
    return 0

"""`hemline body CHARACTER -o BODY.safetensors`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from .progress import note
from .written import check_paths


@dataclass(frozen=True)
class Arguments:
    """Make a body of a rigged character, or of an SMPL file."""

    character: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="CHARACTER")]
    """A .glb, .vrm (0.x, 1.0) or .gltf with a skin; or SMPL .npz, .pkl."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Where the body is written, .safetensors: every --body takes it."""
    height: float | None = None
    """How tall it is to be [m]; left out: as it is, its unit guessed from its legs."""
    unit: str | None = None
    """Unit of its positions (m, dm, cm, mm, inch); left out: guessed."""
    picture: Path | None = None
    """Where a picture of the body, at rest and in the T-pose, is written, .png; none unless given."""
    json: bool = False
    """Print one JSON object: vertices, triangles, height [m], what was found."""


def run(arguments: Arguments) -> int:
    """Read, say what was found, write."""
    from hemline import bodies
    from hemline.errors import BadInput

    check_paths((arguments.output, ".safetensors"), (arguments.picture, ".png"))
    if arguments.character.suffix.lower() in bodies.CHARACTERS:
        body, found = bodies.read_character(arguments.character, height=arguments.height, unit=arguments.unit)
        notes = found.notes
    elif arguments.height is not None or arguments.unit is not None:
        raise BadInput("--height and --unit are for .glb, .vrm and .gltf", arguments.character.name, "leave them out")
    else:
        body, notes = bodies.read(arguments.character), ()
    bodies.write(arguments.output, body)
    if arguments.picture is not None:
        _draw(arguments.picture, body)
    height = float(body.template[:, 1].max() - body.template[:, 1].min())
    if arguments.json:
        said = {"file": str(arguments.output), "vertices": len(body.template), "triangles": len(body.faces)}
        print(json.dumps(said | {"height_m": height, "notes": list(notes)}))
        return 0
    for line in notes:
        note(f"- {line}")
    print(arguments.output)
    return 0


def _draw(path: Path, body) -> None:
    """The body at rest and in the T-pose, from the front and from the side."""
    import numpy as np

    from hemline import pictures
    from hemline.motions import Pose

    shaped = body.shaped()
    identity = np.tile(np.array([1, 0, 0, 0], np.float32), (24, 1))
    upright = shaped.posed(Pose(identity, shaped.joints[0])).vertices + np.array([2.0, 0, 0], np.float32)
    vertices, faces = np.concatenate([shaped.vertices, upright]), body.faces
    both = np.concatenate([faces, faces + len(shaped.vertices)])
    pictures.draw(path, [(vertices, both, "body")], ["front", "side"])

"""`hemline body CHARACTER -o BODY.safetensors`."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro

from hemline.cli.output import check_paths
from hemline.cli.progress import note


@dataclass(frozen=True)
class BodyOptions:
    """Options of `hemline body`."""

    character: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="CHARACTER")]
    """Character to convert: a .glb, .gltf, .vrm (0.x, 1.0) or .fbx file with a skin, or an SMPL .npz or .pkl file.
    With --accessory it may also be anny24 or a body file."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Body file to write (.safetensors). Every --body option accepts it."""
    height: float | None = None
    """Height to scale the body to [m]. By default the height in the file is kept, in a unit guessed from the legs."""
    unit: str | None = None
    """Unit of the positions in the file: m, dm, cm, mm or inch. By default it is guessed."""
    accessory: tuple[str, ...] = ()
    """Rigid meshes that the body carries, each with its joint, such as pads.glb:spine3. Garments go over them.
    A mesh lies at its place on the body at rest, or its origin is that of the joint. By default there are none."""
    picture: Path | None = None
    """Picture of the body at rest and in the T-pose to write (.png). By default none is written."""
    json: bool = False
    """Print one JSON object with the file, the numbers of vertices and triangles, the height [m] and the notes."""


def run(options: BodyOptions) -> int:
    """Reads the character, reports the guesses, and writes the body."""
    from hemline import bodies
    from hemline.errors import BadInput

    check_paths((options.output, ".safetensors"), (options.picture, ".png"))
    accessories = [bodies.Accessory.parse(each) for each in options.accessory]
    if options.character.suffix.lower() in bodies.CHARACTERS:
        body, conversion = bodies.read_character(options.character, height=options.height, unit=options.unit)
        notes = conversion.notes
    elif options.height is not None or options.unit is not None:
        raise BadInput("--height and --unit are for .glb, .vrm and .gltf", options.character.name, "leave them out")
    else:
        shipped = str(options.character) in bodies.names()
        body, notes = bodies.load(str(options.character)) if shipped else bodies.read(options.character), ()
    if accessories:
        # models that were fitted on the file without accessories know it by this name, see `bodies.load`
        body, accessory_notes = bodies.attach(replace(body, name=str(options.character)), accessories)
        notes += accessory_notes
    bodies.write(options.output, body)
    if options.picture is not None:
        _draw(options.picture, body)
    height = float(body.template[:, 1].max() - body.template[:, 1].min())
    if options.json:
        summary = {"file": str(options.output), "vertices": len(body.template), "triangles": len(body.faces)}
        print(json.dumps(summary | {"height_m": height, "notes": list(notes)}))
        return 0
    for line in notes:
        note(f"- {line}")
    print(options.output)
    return 0


def _draw(path: Path, body) -> None:
    """Draws the body at rest and in the T-pose, from the front and from the side."""
    import numpy as np

    from hemline import pictures
    from hemline.motions import Pose

    shaped = body.shaped()
    identity = np.tile(np.array([1, 0, 0, 0], np.float32), (24, 1))
    upright = shaped.posed(Pose(identity, shaped.joints[0])).vertices + np.array([2.0, 0, 0], np.float32)
    vertices, faces = np.concatenate([shaped.vertices, upright]), body.faces
    both = np.concatenate([faces, faces + len(shaped.vertices)])
    pictures.draw(path, [(vertices, both, "body")], ["front", "side"])

"""`hemline explain FILE`."""

import json
import shlex
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from hemline.cli.clip import Up
from hemline.cli.guide import say_next
from hemline.cli.progress import note
from hemline.errors import BadInput

Kind = Literal["clip", "garment", "character"]
"""What a file may be."""

_SCENES = (".glb", ".gltf", ".vrm", ".vrma", ".fbx")
_GARMENTS = (".toml", ".obj", ".ply", ".stl", ".mhclo")


@dataclass(frozen=True)
class ExplainOptions:
    """Options of `hemline explain`."""

    file: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """File to explain: a clip, a garment or a rigged character, or the name of a shipped clip or garment.
    FILE.glb:NAME selects a clip of several, FILE.obj:Shirt a part of a mesh."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """Picture to write (.png). Defaults to NAME.explained.png in this folder."""
    kind: Kind | None = None
    """Kind of the file: clip, garment or character. By default it is found.
    A .glb, .vrm or .fbx is a clip if something moves in its animation.
    Otherwise it is a character if its bones move head, hands and feet."""
    up: Up | None = None
    """Axis that is up in the file of a clip, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    json: bool = False
    """Print one JSON object with the kind of the file, the lines and the picture."""


def run(options: ExplainOptions) -> int:
    """Prints what was understood of the file, line by line as it is found, and writes the picture."""
    from hemline.files import check_writable
    from hemline.garments.reading.file_parts import split_part
    from hemline.motions import split_name

    file, part = split_name(options.file)
    if part is None:
        file, part = split_part(options.file)
    picture = options.output or Path(f"{file.stem.replace(':', '-')}.explained.png")
    if picture.suffix.lower() != ".png":
        cure = f"name it {picture.stem}.png"
        raise BadInput("the picture of explain must end in .png", f"'{picture.suffix}'", cure)
    check_writable(picture)
    kind = options.kind or _kind_of(file, options.file)
    if options.up is not None and kind != "clip":
        raise BadInput("--up is for clips", f"a {kind}", "leave it out, or write 'up' in a TOML of the garment")
    lines = _EXPLAIN[kind](options, picture)
    if options.json:
        print(json.dumps({"file": options.file, "kind": kind, "lines": list(lines), "picture": str(picture)}))
        return 0
    for line in lines:
        print(line, flush=True)
    note(f"picture: {picture}")
    say_next(_NEXT[kind].format(shlex.quote(options.file)))
    return 0


def _kind_of(file: Path, name: str) -> Kind:
    """Returns what a file is: scenes are clips if they have an animation."""
    ending = file.suffix.lower()
    if ending in _GARMENTS or (not ending and _is_garment(name)):
        return "garment"
    if ending in _SCENES:
        from hemline.bodies.character.is_character import is_character
        from hemline.files.gltf import read_gltf

        scene = read_gltf(file, error=BadInput)
        if not scene.all("animations"):
            return "character" if is_character(file) else "garment"
        if scene.all("skins"):
            if not _moves(name) and is_character(file):
                note("nothing moves in its animation, so that the character is explained; otherwise: --kind clip")
                return "character"
            note("the animation is explained; for the mesh and its bones: --kind character")
        return "clip"
    if ending == ".safetensors":
        from hemline.files import read_metadata

        with suppress(BadInput):
            read_metadata(file, "garment")
            return "garment"
    return "clip"


def _moves(name: str) -> bool:
    """Whether a clip shows more than one pose, or cannot be read; exports of a character may hold an idle take."""
    import numpy as np

    from hemline import motions

    with suppress(BadInput):
        clip = motions.open_motion(name)
        return float(max(np.ptp(clip.rotations, axis=0).max(), np.ptp(clip.translations, axis=0).max())) > STILL
    return True


def _is_garment(name: str) -> bool:
    """Whether this is the name of a garment that ships or is generated, such as dress:7."""
    from hemline import garments
    from hemline.garments.generate import is_spec

    return name in garments.names() or is_spec(name)


def _explain_clip(options: ExplainOptions, picture: Path) -> Iterable[str]:
    from .explain_motion import draw_clip, explain_clip

    clip = explain_clip(options.file, up=options.up)
    draw_clip(picture, clip)
    return clip.lines


def _explain_garment(options: ExplainOptions, picture: Path) -> Iterable[str]:
    from .explain_garment import explain_garment

    return explain_garment(options.file, picture)


def _explain_character(options: ExplainOptions, picture: Path) -> Iterable[str]:
    from .explain_character import explain_character

    return explain_character(Path(options.file), picture)


STILL = 1e-3
"""Largest change of a quaternion's component, and of the pelvis' place [m], in a clip in which nothing moves."""

_NEXT = {
    "clip": "hemline animate cape -m {} -o cape.glb",
    "garment": "hemline make {} -o model.safetensors",
    "character": "hemline body {} -o body.safetensors",
}
"""Command to try with a file of each kind."""
_EXPLAIN = {"clip": _explain_clip, "garment": _explain_garment, "character": _explain_character}

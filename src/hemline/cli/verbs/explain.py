"""`hemline explain FILE`."""

import importlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.cli.clip import Up
from hemline.cli.progress import note
from hemline.errors import BadInput

_SCENES = (".glb", ".gltf", ".vrm", ".vrma", ".fbx")
_GARMENTS = (".toml", ".obj", ".ply", ".stl", ".mhclo")


@dataclass(frozen=True)
class ExplainOptions:
    """Options of `hemline explain`."""

    file: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """File to explain: a clip (BVH, FBX, GLB or SMPL .npz), the name of a shipped clip, or a garment.
    FILE.glb:NAME selects a clip of several."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """Picture to write (.png). Defaults to NAME.explained.png in this folder."""
    up: Up | None = None
    """Axis that is up in the file of a clip, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""


def run(options: ExplainOptions) -> int:
    """Prints what was understood of the file, and writes the picture."""
    from hemline.files import check_writable
    from hemline.motions import split_name

    file = split_name(options.file)[0]
    picture = options.output or Path(f"{file.stem}.explained.png")
    if picture.suffix.lower() != ".png":
        cure = f"name it {picture.stem}.png"
        raise BadInput("the picture of explain must end in .png", f"'{picture.suffix}'", cure)
    check_writable(picture)
    explain = _explain_clip if _is_clip(file) else _explain_garment
    for line in explain(options, picture):
        print(line)
    note(f"picture: {picture}")
    return 0


def _is_clip(file: Path) -> bool:
    """Whether a file is a clip; scenes are if they have an animation."""
    ending = file.suffix.lower()
    if ending in _GARMENTS:
        return False
    if ending in _SCENES:
        from hemline.files.gltf import read_gltf

        return bool(read_gltf(file, error=BadInput).all("animations"))
    return True


def _explain_clip(options: ExplainOptions, picture: Path) -> tuple[str, ...]:
    from .explain_motion import draw_clip, explain_clip

    clip = explain_clip(options.file, up=options.up)
    draw_clip(picture, clip)
    return clip.lines


def _explain_garment(options: ExplainOptions, picture: Path) -> tuple[str, ...]:
    if importlib.util.find_spec(".explain_garment", __package__) is None:
        raise BadInput("explain knows clips", options.file, "try it on: 'hemline tryon' says what it understood")
    module = importlib.import_module(".explain_garment", __package__)
    return tuple(module.explain_garment(options.file, picture))

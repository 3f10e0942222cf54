"""`hemline generate KIND -o GARMENT`."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from .progress import note


@dataclass(frozen=True)
class Generate:
    """Make a garment from its measures."""

    kind: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="KIND")]
    """top, dress, skirt, trousers or jumpsuit."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Where it is written: .safetensors, or .obj with a .toml beside it, to be edited in Blender."""
    seed: int | None = None
    """Start from the random design of this seed, as KIND:SEED does; otherwise from plain measures."""
    edge: float = 0.02
    """Length of its edges, 0.008 to 0.05 [m]."""
    vertices: int | None = None
    """Number of vertices wanted, in place of --edge: about 600 to 12,000."""
    picture: Path | None = None
    """Where a picture of it on the body is written, .png; none unless given."""
    betas: tuple[float, ...] = ()
    """Shape of the body: a few numbers of about -3 to 3; what is left out is 0, the mean."""
    body: str = "anny24"
    """The body: anny24, or a file (.safetensors; a character, .glb or .vrm; SMPL .npz or .pkl)."""


def schema(words: Sequence[str]) -> type:
    """The flags of the verb; measures that are not given are those of the design that the words begin with."""
    from hemline.garments.generate import Measures

    options = ("measures", tyro.conf.OmitArgPrefixes[Measures], field(default_factory=lambda: _start(words)))
    return make_dataclass("Arguments", [options], bases=(Generate,), frozen=True)


def run(arguments: Any) -> int:
    """Generate, and write."""
    from hemline import bodies, garments, pictures
    from hemline.errors import BadInput, BadOutput
    from hemline.files import check_writable
    from hemline.garments.generate import Design, generated, write_with_toml

    for path, endings in ((arguments.output, (".safetensors", ".obj")), (arguments.picture, (".png",))):
        if path is not None and path.suffix not in endings:
            what = f"{path} must end in {' or '.join(endings)}"
            raise BadOutput(what, path.suffix or "no ending", f"name it {path.stem}{endings[0]}")
        if path is not None:
            check_writable(path)
    if arguments.seed is not None and arguments.seed < 0:
        raise BadInput("--seed must not be negative", arguments.seed, "give 0 or more")
    design = Design(arguments.kind, **asdict(arguments.measures))
    shaped = bodies.load(arguments.body).shaped(arguments.betas)
    size = {"edge": arguments.edge, "vertex_count": arguments.vertices}
    garment = generated(design, shaped, **size, name=arguments.output.stem)
    note(garments.explain(garment))
    if arguments.output.suffix == ".obj":
        write_with_toml(arguments.output, garment)
    else:
        garment.save(arguments.output)
    if arguments.picture:
        body, cloth = (shaped.vertices, shaped.body.faces, "body"), (garment.vertices, garment.faces, "cloth")
        pictures.draw(arguments.picture, [body, cloth], ["front", "side", "back"])
    print(arguments.output)
    return 0


def _start(words: Sequence[str]) -> Any:
    """The measures that the design begins with: those of a seed, or plain ones of that kind."""
    from hemline.garments.generate import KINDS, Measures, plain_design, random_design

    kind: Any = next((each for word in words for each in KINDS if each == word), None)
    if kind is None:
        return Measures()
    seed = next((words[at + 1] for at, word in enumerate(words[:-1]) if word == "--seed"), "")
    seed = next((word.partition("=")[2] for word in words if word.startswith("--seed=")), seed)
    design = random_design(kind, int(seed)) if seed.isdecimal() else plain_design(kind)
    return Measures(**{each.name: getattr(design, each.name) for each in fields(Measures)})

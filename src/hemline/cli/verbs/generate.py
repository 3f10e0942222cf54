"""`hemline generate KIND -o GARMENT`."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from hemline.cli.progress import note


@dataclass(frozen=True)
class GenerateOptions:
    """Options of `hemline generate`, without the measures."""

    kind: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="KIND")]
    """Kind of garment: top, dress, skirt, trousers or jumpsuit."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Garment file to write: .safetensors, or .obj with a .toml file beside it for editing in Blender."""
    seed: int | None = None
    """Seed of the random design to start from, as in KIND:SEED. By default the plain design of the kind is used."""
    edge: float = 0.02
    """Target edge length of the mesh, 0.008 to 0.05 [m]."""
    vertices: int | None = None
    """Target number of vertices, about 600 to 12,000, instead of --edge. By default --edge decides."""
    picture: Path | None = None
    """Picture of the garment on the body to write (.png). By default none is written."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape."""
    body: str = "anny24"
    """Body to use: anny24, or a file (.safetensors, a .glb or .vrm character, or SMPL .npz or .pkl)."""
    json: bool = False
    """Print one JSON object with the file, and the numbers of vertices and triangles."""


def schema(words: Sequence[str]) -> type:
    """Returns the options of the verb; measures default to those of the design that the words name."""
    from hemline.garments.generate import Measures

    measures_field = (
        "measures",
        tyro.conf.OmitArgPrefixes[Measures],
        field(default_factory=lambda: _default_measures(words)),
    )
    return make_dataclass("GenerateOptions", [measures_field], bases=(GenerateOptions,), frozen=True)


def run(options: Any) -> int:
    """Generates the garment and writes it."""
    from hemline import bodies, garments, pictures
    from hemline.errors import BadInput, BadOutput
    from hemline.files import check_writable
    from hemline.garments.generate import Design, generate_garment, write_with_toml

    for path, endings in ((options.output, (".safetensors", ".obj")), (options.picture, (".png",))):
        if path is not None and path.suffix not in endings:
            what = f"{path} must end in {' or '.join(endings)}"
            raise BadOutput(what, path.suffix or "no ending", f"name it {path.stem}{endings[0]}")
        if path is not None:
            check_writable(path)
    if options.seed is not None and options.seed < 0:
        raise BadInput("--seed must not be negative", options.seed, "give 0 or more")
    design = Design(options.kind, **asdict(options.measures))
    shaped = bodies.load(options.body).shaped(options.betas)
    size = {"edge": options.edge, "vertex_count": options.vertices}
    garment = generate_garment(design, shaped, **size, name=options.output.stem)
    note(garments.explain(garment))
    if options.output.suffix == ".obj":
        write_with_toml(options.output, garment)
    else:
        garment.save(options.output)
    if options.picture:
        body, cloth = (shaped.vertices, shaped.body.faces, "body"), (garment.vertices, garment.faces, "cloth")
        pictures.draw(options.picture, [body, cloth], ["front", "side", "back"])
    if options.json:
        counts = {"vertices": len(garment.vertices), "triangles": len(garment.faces)}
        print(json.dumps({"file": str(options.output), **counts}))
        return 0
    print(options.output)
    return 0


def _default_measures(words: Sequence[str]) -> Any:
    """Returns the measures of the design of a seed, or the plain ones of the kind."""
    from hemline.garments.generate import KINDS, Measures, plain_design, random_design

    kind: Any = next((word for word in words if word in KINDS), None)
    if kind is None:
        return Measures()
    seed = next((words[at + 1] for at, word in enumerate(words[:-1]) if word == "--seed"), "")
    seed = next((word.partition("=")[2] for word in words if word.startswith("--seed=")), seed)
    design = random_design(kind, int(seed)) if seed.isdecimal() else plain_design(kind)
    return Measures(**{measure.name: getattr(design, measure.name) for measure in fields(Measures)})

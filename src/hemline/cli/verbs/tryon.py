"""`hemline tryon GARMENT -o GARMENT.safetensors`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.cli.output import check_paths
from hemline.cli.progress import bars, note


@dataclass(frozen=True)
class TryonOptions:
    """Options of `hemline tryon`."""

    garment: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """Garment to try on: a mesh, a TOML file that names one, a .mhclo file, or the name of a garment.
    FILE.obj:Shirt is the part of a mesh with that name."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Garment file to write (.safetensors). The verbs simulate and drape accept it."""
    picture: Path | None = None
    """Picture of the garment on the body to write (.png). By default none is written."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape."""
    body: str = "anny24"
    """Body to use: anny24, or a file (.safetensors, a .glb or .vrm character, or SMPL .npz or .pkl)."""
    unit: str | None = None
    """Unit of the mesh: m, dm, cm, mm, in or ft. By default it is guessed from the size of the mesh."""
    scaled: bool = True
    """Scale the garment, by a factor of 0.67 to 1.49, if it was clearly made for a body of another size.
    With --no-scaled its size is kept."""
    seconds: float = 80.0
    """Processor time after which the search is given up [s]."""
    json: bool = False
    """Print one JSON object with the file, the figures of the fit and the warnings."""


def run(options: TryonOptions) -> int:
    """Tries the garment on; if it cannot be worn, returns status 1 and writes nothing."""
    check_paths((options.output, ".safetensors"), (options.picture, ".png"))
    from hemline import bodies, garments, pictures
    from hemline.errors import SimulationFailed
    from hemline.tryon import try_on

    shaped = bodies.load(options.body).shaped(options.betas)
    with bars() as display:
        task = display.add_task("try on", total=None)
        tried = try_on(
            options.garment,
            shaped,
            unit=options.unit,
            scaled=options.scaled,
            say=note,
            seconds=options.seconds,
            progress=lambda done, total: display.update(task, completed=done, total=total),
        )
    note(garments.explain(tried.garment))
    if tried.fitness.reason or tried.fitness.rest is None:
        raise SimulationFailed(f"{tried.garment.name} cannot be worn: {tried.fitness.reason}")
    for warning in tried.fitness.warnings:
        note(f"warning: {warning}" + ("" if options.picture else "; --picture shows how it is worn"))
    tried.garment.save(options.output)
    if not tried.garment.is_on(shaped):
        note("written on the shape that it was made on, not dressed: give the same --betas to what simulates it")
    vertices = tried.fitness.rest.vertices[0]
    if options.picture is not None:
        drawn = [(shaped.vertices, shaped.body.faces, "body"), (vertices, tried.garment.faces, "cloth")]
        pictures.write_png(options.picture, pictures.picture_of(drawn, size=(480, 640)))
    if options.json:
        warnings, figures = list(tried.fitness.warnings), {key: float(v) for key, v in tried.fitness.figures.items()}
        print(json.dumps({"file": str(options.output), "figures": figures, "warnings": warnings}))
        return 0
    print("worn: " + "  ".join(f"{key} {value:.3g}" for key, value in tried.fitness.figures.items()))
    return 0

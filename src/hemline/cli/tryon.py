"""`hemline tryon GARMENT -o GARMENT.safetensors`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from .progress import bars, note
from .written import check_paths


@dataclass(frozen=True)
class Arguments:
    """Put a garment that was made on another body onto this one."""

    garment: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """A mesh, a TOML that names one, a .mhclo; or a garment by name, to see it on a body."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Where the worn garment is written, .safetensors: 'hemline simulate' and 'drape' take it."""
    picture: Path | None = None
    """Where a picture of it on the body is written, .png; none unless given."""
    betas: tuple[float, ...] = ()
    """Shape of the body: a few numbers of about -3 to 3; what is left out is 0, the mean."""
    body: str = "anny24"
    """The body: anny24, or a file (.safetensors; a character, .glb or .vrm; SMPL .npz or .pkl)."""
    unit: str | None = None
    """Unit of the mesh (m, dm, cm, mm, in, ft); guessed from its size unless given."""
    scaled: bool = True
    """Change its size, by up to 40 %, where it was plainly made for a body of another size; --no-scaled keeps it."""


def run(arguments: Arguments) -> int:
    """Try on; status 1 when it cannot be worn, and nothing is written then."""
    from hemline import bodies, garments, pictures
    from hemline.errors import SimulationFailed
    from hemline.tryon import try_on

    check_paths((arguments.output, ".safetensors"), (arguments.picture, ".png"))
    shaped = bodies.load(arguments.body).shaped(arguments.betas)
    with bars() as display:
        task = display.add_task("try on", total=None)
        tried = try_on(
            arguments.garment,
            shaped,
            unit=arguments.unit,
            scaled=arguments.scaled,
            say=note,
            progress=lambda done, total: display.update(task, completed=done, total=total),
        )
    note(garments.explain(tried.garment))
    if tried.fitness.reason or tried.fitness.rest is None:
        raise SimulationFailed(f"{tried.garment.name} cannot be worn: {tried.fitness.reason}")
    for warning in tried.fitness.warnings:
        note(f"warning: {warning}" + ("" if arguments.picture else "; --picture shows how it is worn"))
    tried.garment.save(arguments.output)
    if not tried.garment.is_on(shaped):
        note("written on the shape that it was made on, not dressed: give the same --betas to what simulates it")
    vertices = tried.fitness.rest.vertices[0]
    if arguments.picture is not None:
        drawn = [(shaped.vertices, shaped.body.faces, "body"), (vertices, tried.garment.faces, "cloth")]
        pictures.write_png(arguments.picture, pictures.picture_of(drawn, size=(480, 640)))
    print("worn: " + "  ".join(f"{key} {value:.3g}" for key, value in tried.fitness.figures.items()))
    return 0

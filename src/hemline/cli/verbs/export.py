"""`hemline export DATASET --take N -o FILE`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from hemline.cli.output import Output
from hemline.errors import BadInput

if TYPE_CHECKING:
    from hemline.datasets import Take
    from hemline.export import Clip
    from hemline.garments import Garment


@dataclass(frozen=True)
class ExportOptions:
    """Options of `hemline export`."""

    dataset: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DATASET")]
    """Dataset folder made by simulate."""
    take: int
    """Number of the take, from 0. Takes are ordered by clip name; long clips are split into parts of ten seconds."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """File to write; its ending selects the format: .glb .usdc .vat .obj .npz .pc2 .mdd, or a picture: .png .webp."""
    lead_in: bool = False
    """Include the lead-in, the frames before the clip in which the cloth reaches its first pose."""
    model: str | None = None
    """Model that transfers the take to the body shape of --betas.
    It must know the effect of body shape on this garment (--animator agentdress).
    By default the take is shown as simulated."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape.
    They need --model."""
    skinned: bool = False
    """Write the garment as a skinned mesh with bones, about a hundredth of the size (.glb, .usdc)."""
    bones: int | None = None
    """Number of bones of a skinned garment, 1 to 256. Defaults to 60."""
    quantized: bool = False
    """Store positions with two bytes per number and normals with one, about half the size (.glb)."""
    character: Path | None = None
    """Character file (.glb or .vrm) that the body was made from.
    The .glb output shows its own meshes and materials instead of the body. By default the body is shown."""
    json: bool = False
    """Print one JSON object with the files, their size [bytes], and the error of a skinned garment [mm]."""


def run(options: ExportOptions) -> int:
    """Reads the take, poses the body that it was simulated on, and writes both."""
    from hemline.datasets import open_dataset
    from hemline.playback.record import record_take

    output = Output(options.output, options.skinned, options.bones, options.quantized, options.character)
    dataset = open_dataset(options.dataset)
    rows = [row for row in dataset.rows() if row.kind == "clip"]
    if not 0 <= options.take < len(rows):
        there = f"the takes 0 to {len(rows) - 1}" if rows else "no takes of clips"
        raise BadInput(f"{options.dataset} has {there}", f"--take {options.take}", "name one of them")
    take = dataset.take(rows[options.take])
    body = dataset.body.shaped(take.betas)
    own = output.own_mesh(body)
    if options.model is not None:
        clip = _transfer(options, dataset.garment, take)
    elif options.betas:
        cure = "name one with --model, such as tshirt-light"
        raise BadInput("a take is shown on another shape by a model that knows what shapes do", "--betas alone", cure)
    else:
        clip = record_take(take, dataset.garment, body, lead_in=options.lead_in)
    output.write(clip, as_json=options.json, own=own)
    return 0


def _transfer(options: ExportOptions, garment: "Garment", take: "Take") -> "Clip":
    from hemline.cli.model import open_model
    from hemline.playback import record, redress_take

    if options.lead_in:
        raise BadInput("another shape is shown without the lead-in", "--lead-in and --model", "leave --lead-in out")
    animator, body = open_model(str(options.model), None, None, options.betas)
    if animator.garment.hash != garment.hash:
        got = f"'{garment.name}' for '{animator.garment.name}'"
        raise BadInput("model and take must be of the same garment", got, "fit the model to anchors of that garment")
    return record(
        redress_take(animator, take, body),
        garment_name=garment.name,
        garment_faces=garment.faces,
        motion=take.motion,
        fps=take.motion.fps,
    )

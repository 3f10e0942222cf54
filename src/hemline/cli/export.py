"""`hemline export DATASET --take N -o FILE`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from hemline.errors import BadInput

from .written import Output

if TYPE_CHECKING:
    from hemline.datasets import Take
    from hemline.export import Clip
    from hemline.garments import Garment


@dataclass(frozen=True)
class Arguments:
    """Write one simulated take, without its lead-in."""

    dataset: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DATASET")]
    """The folder that `hemline simulate` made."""
    take: int
    """Which of its takes, counted from 0: clips in the order of their names, long ones in parts of ten seconds."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The file; its ending chooses the format: .glb .usdc .vat .obj .npz .pc2 .mdd, or a picture: .png .webp."""
    lead_in: bool = False
    """Also the frames before the clip, in which the cloth is led into its first pose."""
    model: str | None = None
    """Show it on a body of another shape: a model of this garment that knows what shapes do (--animator agentdress)."""
    betas: tuple[float, ...] = ()
    """That shape."""
    skinned: bool = False
    """The garment as a skinned mesh of bones found in its motion: a hundredth of the size (.glb .usdc)."""
    bones: int | None = None
    """How many bones, 1 to 256; left out: 60."""
    quantized: bool = False
    """Two bytes a number for positions, one for normals: half the size (.glb)."""
    character: Path | None = None
    """The .glb or .vrm that the body was made of: its own meshes and materials are shown in its place (.glb)."""
    json: bool = False
    """Print one JSON object: files, bytes, and how far the skinned garment is from the played one [mm]."""


def run(arguments: Arguments) -> int:
    """Read the take, skin the body it was simulated against, write."""
    from hemline import bodies
    from hemline.datasets import open_dataset
    from hemline.playback.record import recorded_take

    output = Output(arguments.output, arguments.skinned, arguments.bones, arguments.quantized, arguments.character)
    dataset = open_dataset(arguments.dataset)
    rows = [row for row in dataset.rows() if row.kind == "clip"]
    if not 0 <= arguments.take < len(rows):
        there = f"the takes 0 to {len(rows) - 1}" if rows else "no takes of clips"
        raise BadInput(f"{arguments.dataset} has {there}", f"--take {arguments.take}", "name one of them")
    take = dataset.take(rows[arguments.take])
    body = bodies.load(dataset.garment.body_name).shaped(take.betas)
    own = output.own_mesh(body)
    if arguments.model is not None:
        clip = _redressed(arguments, dataset.garment, take)
    elif arguments.betas:
        cure = "name one with --model, such as tshirt-light"
        raise BadInput("a take is shown on another shape by a model that knows what shapes do", "--betas alone", cure)
    else:
        clip = recorded_take(take, dataset.garment, body, lead_in=arguments.lead_in)
    output.write(clip, as_json=arguments.json, own=own)
    return 0


def _redressed(arguments: Arguments, garment: "Garment", take: "Take") -> "Clip":
    from hemline.playback import record, redressed

    from .model import open_model

    if arguments.lead_in:
        raise BadInput("another shape is shown without the lead-in", "--lead-in and --model", "leave --lead-in out")
    animator, body = open_model(str(arguments.model), None, None, arguments.betas)
    if animator.garment.hash != garment.hash:
        got = f"'{garment.name}' for '{animator.garment.name}'"
        raise BadInput("model and take must be of the same garment", got, "fit the model to anchors of that garment")
    return record(
        redressed(animator, take, body),
        garment_name=garment.name,
        garment_faces=garment.faces,
        motion=take.motion,
        fps=take.motion.fps,
    )

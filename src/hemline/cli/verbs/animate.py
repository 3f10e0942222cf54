"""`hemline animate [MODEL] --motion FILE -o out.glb`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.cli.clip import Up, cut
from hemline.cli.output import Output
from hemline.cli.progress import bars, note
from hemline.cli.wind import CALM, Wind
from hemline.errors import BadInput


@dataclass(frozen=True)
class AnimateOptions:
    """Options of `hemline animate`."""

    motion: Annotated[str, tyro.conf.arg(aliases=["-m"])]
    """Clip to play: a BVH, FBX, GLB or SMPL .npz file, or the name of a shipped excerpt.
    FILE.glb:NAME selects a clip of several."""
    model: Annotated[str | None, tyro.conf.Positional] = None
    """Model to play: a file, or the name of a shipped model.
    Defaults to live, which simulates the garment of --garment."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write; its ending selects the format. Defaults to MOTION.glb beside the clip."""
    garment: str | None = None
    """Garment to dress, by name or file, for a model that plays any garment."""
    material: str | None = None
    """Material of the garment, if the model knows several: cotton, silk, denim, wool, jersey or paper.
    Defaults to the material of the model or of the garment."""
    wind: Wind = CALM
    """Wind velocity along x, y (up) and z [m/s], for models of ropes and for live. By default there is no wind."""
    over: tuple[str, ...] = ()
    """Layers over the garment, from the inside out, each kept outside the one beneath.
    They are garments for a model that plays any garment, otherwise models with garments of their own.
    By default there are none."""
    thickness_mm: float = 1.5
    """Minimum distance of a garment that is pushed off the one beneath, above 0 and at most 10 [mm]."""
    betas: tuple[float, ...] = ()
    """Shape coefficients of the body, about -3 to 3 each. Missing coefficients are 0, which is the mean shape."""
    clamp_betas: bool = False
    """Clamp the betas to the range that the model was fitted on.
    Without it, betas outside the range cause a warning."""
    shapes: str | None = None
    """Second model of the same garment, which knows the effect of body shape (--animator agentdress).
    MODEL plays on the body of its fit, and this model transfers the garment to the shape of --betas.
    By default MODEL plays on that shape itself."""
    body: str | None = None
    """Body to play on, with the topology of the model's body.
    A model that plays any garment takes any body or character file. Defaults to the body of the model."""
    fps: float = 30.0
    """Frame rate to play and write [frames/s]."""
    up: Up | None = None
    """Axis that is up in the clip, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    start: float = 0.0
    """Start time in the clip [s]."""
    seconds: float | None = None
    """Length of the clip to play [s]. Defaults to the rest of the clip."""
    untangle: bool = True
    """Move limbs that overlap in the clip out of each other first, since no cloth fits between them."""
    detail: float = 1.0
    """Fraction of the garment's vertices to play, above 0 and at most 1."""
    explain: bool = False
    """Report what was guessed about the clip."""
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


def run(options: AnimateOptions) -> int:
    """Plays the clip and writes the file."""
    from hemline import motions
    from hemline.animators import load
    from hemline.animators.redressed import AnimatorRedressed
    from hemline.arrays import Quaternions
    from hemline.cli.limbs import note_untangled
    from hemline.cli.model import open_model, report_relatives, warn_new_poses
    from hemline.playback import Frame, level_of, play, record

    motion = cut(motions.open_motion(options.motion, up=options.up), options.start, options.seconds)
    path = options.output or _output_beside(options.motion)
    output = Output(path, options.skinned, options.bones, options.quantized, options.character)
    animator, body = open_model(
        options.model or _default_model(options.garment),
        options.garment,
        options.body,
        options.betas,
        over=options.over,
        material=options.material,
        wind=options.wind,
        clamp=options.clamp_betas,
    )
    own = output.own_mesh(body)
    report_relatives(animator)
    if options.shapes is not None:
        animator = AnimatorRedressed(animator, load(options.shapes))
    garment = level_of(animator, options.detail).garment
    if options.explain:
        for line in motion.notes:
            note(f"{options.motion}: {line}")
    played = motion.resample(options.fps)
    novelties: list[float | None] = []
    rotations: list[Quaternions] = []
    with bars() as display:
        task = display.add_task("animate", total=len(played))

        def keep(frame: Frame) -> None:
            novelties.append(frame.novelty)
            rotations.append(frame.body.pose.rotations)
            display.advance(task)

        clip = record(
            play(
                animator,
                body,
                motion,
                fps=options.fps,
                untangle=options.untangle,
                detail=options.detail,
                thickness_mm=options.thickness_mm,
            ),
            garment_name=garment.name,
            garment_faces=garment.faces,
            motion=motion,
            fps=options.fps,
            keep=keep,
        )
    warn_new_poses(animator, novelties)
    note_untangled(played, rotations)
    output.write(clip, as_json=options.json, own=own)
    return 0


def _default_model(garment: str | None) -> str:
    """Returns the model that plays a garment if none is named.

    It is the most accurate model that plays any garment; writing a file does not need the fastest.

    Raises:
        BadInput: No garment is given either.
    """
    if garment is None:
        raise BadInput("a model to play, or a garment to wear, is needed", "neither", "name MODEL, or --garment FILE")
    return "live"


def _output_beside(motion: str) -> Path:
    from hemline.files.gltf import ENDINGS
    from hemline.motions import split_name

    path, _ = split_name(motion)
    if path.suffix.lower() in ENDINGS:
        raise BadInput("the name of the output is needed where the clip is in a GLB", motion, "name it with -o OUT.glb")
    return path.with_suffix(".glb") if path.suffix else Path(f"{motion}.glb")

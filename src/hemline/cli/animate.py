"""`hemline animate [MODEL] --motion FILE -o out.glb`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.errors import BadInput

from .clip import cut
from .progress import bars, note
from .written import Output


@dataclass(frozen=True)
class Arguments:
    """Play a model on a motion into a file."""

    motion: Annotated[str, tyro.conf.arg(aliases=["-m"])]
    """A clip (BVH, AMASS, GLB; FILE.glb:NAME of several), or the name of a shipped excerpt."""
    model: Annotated[str | None, tyro.conf.Positional] = None
    """A model file, or the name of a shipped model. Left out: `live`, which simulates the garment of --garment."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """The file; its ending chooses the format. Left out: MOTION.glb beside the motion."""
    garment: str | None = None
    """The garment to wear, by name or a file, for a model that was fitted on many."""
    material: str | None = None
    """What it is made of, where the model knows others than its own: cotton, silk, denim, wool, jersey, paper."""
    over: tuple[str, ...] = ()
    """What is worn over it, from the skin outwards, each kept out of what is beneath: garments, for a model that takes
    any; else models, each with its own garment."""
    thickness_mm: float = 1.5
    """Least distance of a garment from the one beneath it, where it must be moved [mm]."""
    betas: tuple[float, ...] = ()
    """Shape of the body."""
    clamp_betas: bool = False
    """Move them into the range in which the model is believed, see the warning that it gives without."""
    shapes: str | None = None
    """A model of the same garment that knows what shapes do (--animator agentdress): MODEL swings on the body of its
    fit, and this one puts the garment on the other shape."""
    body: str | None = None
    """Another body of the same topology, or any file of a body or character for a model that takes any garment; left
    out: the model's."""
    fps: float = 30.0
    """Frames a second."""
    start: float = 0.0
    """Where in the clip to begin [s]."""
    seconds: float | None = None
    """How much of the clip; left out: to its end [s]."""
    untangle: bool = False
    """Lift limbs out of each other first."""
    detail: float = 1.0
    """Share of the garment's vertices, above 0 and at most 1."""
    explain: bool = False
    """Say what was guessed about the clip."""
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
    """Play and write."""
    from hemline import motions
    from hemline.animators import load
    from hemline.animators.redressed import AnimatorRedressed
    from hemline.playback import Frame, level_of, play, record

    from .model import open_model, say_relatives, warn_new_poses

    motion = cut(motions.open_motion(arguments.motion), arguments.start, arguments.seconds)
    path = arguments.output or _beside(arguments.motion)
    output = Output(path, arguments.skinned, arguments.bones, arguments.quantized, arguments.character)
    animator, body = open_model(
        arguments.model or _any_garment(arguments.garment),
        arguments.garment,
        arguments.body,
        arguments.betas,
        over=arguments.over,
        material=arguments.material,
        clamp=arguments.clamp_betas,
    )
    own = output.own_mesh(body)
    say_relatives(animator)
    if arguments.shapes is not None:
        animator = AnimatorRedressed(animator, load(arguments.shapes))
    garment = level_of(animator, arguments.detail).garment
    if arguments.explain:
        for line in motion.notes:
            note(f"{arguments.motion}: {line}")
    total = len(motion.resampled(arguments.fps))
    novelties: list[float | None] = []
    with bars() as display:
        task = display.add_task("animate", total=total)

        def keep(frame: Frame) -> None:
            novelties.append(frame.novelty)
            display.advance(task)

        clip = record(
            play(
                animator,
                body,
                motion,
                fps=arguments.fps,
                untangle=arguments.untangle,
                detail=arguments.detail,
                thickness_mm=arguments.thickness_mm,
            ),
            garment_name=garment.name,
            garment_faces=garment.faces,
            motion=motion,
            fps=arguments.fps,
            keep=keep,
        )
    warn_new_poses(animator, novelties)
    output.write(clip, as_json=arguments.json, own=own)
    return 0


def _any_garment(garment: str | None) -> str:
    """What plays a garment into a file where no model is named: the best of those that take any.

    A file can wait for some 20 ms a frame, so it is not the fastest.
    """
    if garment is None:
        raise BadInput("a model to play, or a garment to wear, is needed", "neither", "name MODEL, or --garment FILE")
    return "live"


def _beside(motion: str) -> Path:
    from hemline.files.gltf import ENDINGS
    from hemline.motions import split_name

    path, _ = split_name(motion)
    if path.suffix.lower() in ENDINGS:
        raise BadInput("the name of the output is needed where the clip is in a GLB", motion, "name it with -o OUT.glb")
    return path.with_suffix(".glb") if path.suffix else Path(f"{motion}.glb")

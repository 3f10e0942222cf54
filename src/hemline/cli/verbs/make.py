"""`hemline make GARMENT -o MODEL`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.cli.clip import Up
from hemline.cli.output import check_paths
from hemline.cli.progress import note, stages
from hemline.errors import BadInput


@dataclass(frozen=True)
class MakeOptions:
    """Options of `hemline make`."""

    garment: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """Garment mesh, garment file, or the name of a garment. A mesh that does not sit on the body is tried on."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Model file to write (.safetensors). A report (.html) and a folder (.making) are written beside it."""
    minutes: float = 10.0
    """Time that the run may take [min]. More time means more clips and poses."""
    ms: float = 16.0
    """Longest time of a frame on this machine [ms]; 16 ms are a frame at 60 frames per second.
    A slower method is chosen only if no faster one plays the garment well."""
    animator: str | None = None
    """Method to use: agentdress, ropes, skinned, lag, swingar or live. By default all suitable ones are compared."""
    motion: Annotated[tuple[str, ...], tyro.conf.arg(aliases=["-m"])] = ()
    """Clips to simulate: .bvh or AMASS .npz files, or names of shipped excerpts.
    Defaults to all excerpts but dance, on which methods are compared, and 24 short sections of other recordings."""
    up: Up | None = None
    """Axis that is up in the files of clips, such as z, or -y as in a camera's coordinates (--up=-y).
    By default it is found from the body: up is where the head is."""
    material: str | None = None
    """Material of the garment: cotton, silk, denim, wool, jersey or paper. Defaults to the garment's own material."""
    body: str = "anny24"
    """Body to use: anny24, or a file (.safetensors, a .glb or .vrm character, or SMPL .npz or .pkl)."""
    jobs: int = 2
    """Number of processes for simulation. The result does not depend on it."""
    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://host:8786, whose workers do the work; see docs/scale.md.
    By default it is done on this machine."""
    seed: int = 0
    """Seed of the fit. The same seed gives the same model on one machine."""
    json: bool = False
    """Print the model, the report and the figures of all methods as one JSON object."""


def run(options: MakeOptions) -> int:
    """Makes the model; returns status 1 if the best method does not play the garment well."""
    from hemline.make import MakeSettings, make_model

    check_paths((options.output, ".safetensors"))
    if options.jobs < 1:
        raise BadInput("--jobs must be at least 1", options.jobs, "leave it out for 2")
    settings = MakeSettings(minutes=options.minutes, ms=options.ms, animator=options.animator or "", seed=options.seed)
    with stages() as progress:
        outcome = make_model(
            options.garment,
            options.output,
            settings,
            clips=options.motion,
            up=options.up,
            material=options.material,
            body=options.body,
            jobs=options.jobs,
            scheduler=options.scheduler,
            say=note,
            progress=progress,
        )
    if options.json:
        print(
            json.dumps(
                {
                    "model": str(outcome.model),
                    "report": str(outcome.report),
                    "folder": str(outcome.folder),
                    "seconds": outcome.seconds,
                    "chosen": outcome.chosen.method,
                    "faults": list(outcome.faults),
                    "trials": [trial.entries() for trial in outcome.trials],
                    "truth": outcome.truth.entries(),
                }
            )
        )
        return 1 if outcome.faults else 0
    print(f"{'method':<12}{'error mm':>10}{'stretch %':>11}{'skin %':>8}{'frame ms':>10}{'MB':>7}")
    for trial in outcome.trials:
        if trial.failed:
            print(f"{trial.method:<12}{trial.failed}")
            continue
        print(
            f"{trial.method:<12}{trial.error_mm:>10.1f}{trial.stretch_p99:>11.1f}{trial.skin_seen:>8.2f}"
            f"{trial.frame_ms:>10.2f}{trial.model_mb:>7.1f}"
        )
    print(f"{'simulation':<22}{outcome.truth.stretch_p99:>11.1f}")
    print(f"chosen: {outcome.chosen.method}, {outcome.model}; report: {outcome.report}")
    for fault in outcome.faults:
        note(f"warning: {fault}")
    return 1 if outcome.faults else 0

"""Times the way from a foreign mesh to a fitted model: `python -m benchmarks.own_garment [MESH]`.

Runs `hemline tryon`, `simulate` (the first five seconds of 25 recordings of ../shared/data/motion), `fit` and
`animate` with the time of each. Then two shipped excerpts, whose subjects are not in the fit, are simulated, the model
is compared with them, and the worst frame of each is drawn without the whole-cloth step, with it, and simulated. Files
go to out/own_garment, where a stopped run continues. Writes one JSON line to benchmarks/results/own_garment.jsonl.
"""

import argparse
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import hemline
from benchmarks.clips import all_clips, select_evenly
from hemline import motions, pictures
from hemline.bench.machine import commit, machine

ROOT = Path(__file__).parents[1]
MESH = ROOT.parent / "shared" / "data" / "garments" / "garmentcode_mit" / "skirt_circle_mean_all.obj"
WORK = ROOT / "out" / "own_garment"
CLIPS, SECONDS = 25, "5"
SIZE = (560, 640)
HELD_OUT = ("run", "dance")
"""Shipped excerpts for the evaluation; recordings of their subjects are not in the fit."""


def steps(mesh: Path, work: Path) -> dict[str, list[str]]:
    """Returns the commands by name, each without `hemline`."""
    subjects = {motions.subject_of(name) for name in HELD_OUT}
    files = select_evenly([file for file in all_clips() if motions.subject_of(file) not in subjects], CLIPS)
    garment, data, model = work / "garment.safetensors", work / "data", work / "model.safetensors"
    truth = work / "truth"
    return {
        "tryon": ["tryon", str(mesh), "-o", str(garment), "--picture", str(work / "worn.png")],
        "simulate": [
            "simulate",
            str(garment),
            "-m",
            *map(str, files),
            "-o",
            str(data),
            "--seconds",
            SECONDS,
            "--jobs",
            "2",
            "--quantised",
        ],
        "fit": ["fit", str(data), "--animator", "ropes", "-o", str(model)],
        "animate": ["animate", str(model), "--motion", HELD_OUT[0], "-o", str(work / "run.glb")],
        "simulate held out": ["simulate", str(garment), "-m", *HELD_OUT, "-o", str(truth), "--jobs", "2"],
        **{
            f"evaluate {name}": [
                "evaluate",
                str(model),
                "--motion",
                name,
                "--truth",
                str(truth),
                "--json",
                "--picture",
                str(work / f"{name}.png"),
            ]
            for name in HELD_OUT
        },
    }


def draw_worst(work: Path, name: str) -> None:
    """Draws the most stretched frame of a held-out clip without the whole-cloth step, with it, and simulated."""
    model, truth = hemline.load(work / "model.safetensors"), hemline.datasets.open_dataset(work / "truth")
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    take = next(truth.take(row) for row in truth.clips() if row.clip == name)
    frames_by_step = {whole: [] for whole in (False, True)}
    for whole, frames in frames_by_step.items():
        hemline.evaluate(model, body, take.motion, truth=truth, whole=whole, keep=frames.append)
    edges = hemline.meshes.edge_strains
    faces = model.garment.faces
    strains = [np.percentile(edges(f.vertices, faces, model.garment.rest_edges), 99) for f in frames_by_step[False]]
    worst = int(np.argmax(strains))
    posed = frames_by_step[True][worst].body
    meshes = [(frames_by_step[whole][worst].vertices, "cloth") for whole in (False, True)]
    meshes.append((take.vertices[take.clip_frames[worst]], "truth"))
    views = [
        pictures.picture_of([(posed.vertices, posed.faces, "body"), (each, faces, colour)], "three_quarter", size=SIZE)
        for each, colour in meshes
    ]
    pictures.write_png(work / f"{name}-worst.png", pictures.side_by_side(views))


def main() -> None:
    """Runs the commands, times them and records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "mesh", nargs="?", type=Path, default=MESH, help="Mesh file. Defaults to the circle skirt of GarmentCode."
    )
    parser.add_argument("--afresh", action="store_true", help="Delete the files of an earlier run.")
    options = parser.parse_args()
    work = WORK / options.mesh.stem
    if options.afresh:
        shutil.rmtree(work, ignore_errors=True)
    continued = work.exists()
    work.mkdir(parents=True, exist_ok=True)
    seconds, printed = {}, {}
    for name, command in steps(options.mesh, work).items():
        began = time.perf_counter()
        done = subprocess.run(["hemline", *command], stdout=subprocess.PIPE, text=True, check=False)
        seconds[name] = round(time.perf_counter() - began, 1)
        printed[name] = done.stdout
        print(f"{name}: {seconds[name]} s, status {done.returncode}\n{done.stdout[-1500:]}", flush=True)
        if done.returncode == 2:
            sys.exit(f"{name} refused")
    for name in HELD_OUT:
        draw_worst(work, name)
    minutes = sum(seconds[step] for step in ("tryon", "simulate", "fit")) / 60
    figures = {name: json.loads(printed[f"evaluate {name}"]) | {"model": options.mesh.stem} for name in HELD_OUT}
    row = {
        "mesh": options.mesh.name,
        "clips": CLIPS,
        "seconds": seconds,
        # times of a continued run are meaningless
        "minutes_to_model": None if continued else round(minutes, 1),
        "figures": figures,
        "machine": machine(),
        "commit": commit(),
    }
    with (ROOT / "benchmarks" / "results" / "own_garment.jsonl").open("a") as stream:
        stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()

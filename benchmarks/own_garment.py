"""From somebody's mesh to a fitted model, command by command: `python -m benchmarks.own_garment [MESH]`.

`hemline tryon`, `simulate` (25 recordings of ../shared/data/motion, the first five seconds of each), `fit`, `animate`,
with the time of each; then two shipped excerpts, whose subjects are not in the fit, are simulated and the model is
evaluated against them, and the worst frame of each is drawn: without the whole-cloth step, with it, the simulation.
MESH is the circle skirt of GarmentCode unless given. Work goes to out/own_garment and is
continued there; `--afresh` begins again. One JSON line goes to benchmarks/results/own_garment.jsonl.
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
from benchmarks.clips import every_clip, spread
from hemline import motions, pictures
from hemline.bench.machine import commit, machine

ROOT = Path(__file__).parents[1]
MESH = ROOT.parent / "shared" / "data" / "garments" / "garmentcode_mit" / "skirt_circle_mean_all.obj"
WORK = ROOT / "out" / "own_garment"
CLIPS, SECONDS = 25, "5"
SIZE = (560, 640)
HELD_OUT = ("run", "dance")
"""Shipped excerpts on which the model is judged; recordings of their subjects are left out of the fit."""


def steps(mesh: Path, work: Path) -> dict[str, list[str]]:
    """The commands, each without `hemline`."""
    known = {motions.subject_of(name) for name in HELD_OUT}
    files = spread([file for file in every_clip() if motions.subject_of(file) not in known], CLIPS)
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
    """The frame of a held-out clip that is most stretched without the whole-cloth step: without, with, simulated."""
    model, truth = hemline.load(work / "model.safetensors"), hemline.datasets.open_dataset(work / "truth")
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    take = next(truth.take(row) for row in truth.clips() if row.clip == name)
    kept = {whole: [] for whole in (False, True)}
    for whole, frames in kept.items():
        hemline.evaluate(model, body, take.motion, truth=truth, whole=whole, keep=frames.append)
    edges = hemline.meshes.edge_strains
    faces = model.garment.faces
    strains = [np.percentile(edges(f.vertices, faces, model.garment.rest_edges), 99) for f in kept[False]]
    worst = int(np.argmax(strains))
    posed = kept[True][worst].body
    meshes = [(kept[whole][worst].vertices, "cloth") for whole in (False, True)]
    meshes.append((take.vertices[take.clip_frames[worst]], "truth"))
    views = [
        pictures.picture_of([(posed.vertices, posed.faces, "body"), (each, faces, colour)], "three_quarter", size=SIZE)
        for each, colour in meshes
    ]
    pictures.write_png(work / f"{name}-worst.png", pictures.side_by_side(views))


def main() -> None:
    """Run the commands, time them, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", nargs="?", type=Path, default=MESH)
    parser.add_argument("--afresh", action="store_true", help="begin again")
    arguments = parser.parse_args()
    work = WORK / arguments.mesh.stem
    if arguments.afresh:
        shutil.rmtree(work, ignore_errors=True)
    continued = work.exists()
    work.mkdir(parents=True, exist_ok=True)
    seconds, said = {}, {}
    for name, command in steps(arguments.mesh, work).items():
        began = time.perf_counter()
        done = subprocess.run(["hemline", *command], stdout=subprocess.PIPE, text=True, check=False)
        seconds[name] = round(time.perf_counter() - began, 1)
        said[name] = done.stdout
        print(f"{name}: {seconds[name]} s, status {done.returncode}\n{done.stdout[-1500:]}", flush=True)
        if done.returncode == 2:
            sys.exit(f"{name} refused")
    for name in HELD_OUT:
        draw_worst(work, name)
    minutes = sum(seconds[step] for step in ("tryon", "simulate", "fit")) / 60
    figures = {name: json.loads(said[f"evaluate {name}"]) | {"model": arguments.mesh.stem} for name in HELD_OUT}
    row = {
        "mesh": arguments.mesh.name,
        "clips": CLIPS,
        "seconds": seconds,
        # of a run that was continued the times say nothing
        "minutes_to_model": None if continued else round(minutes, 1),
        "figures": figures,
        "machine": machine(),
        "commit": commit(),
    }
    with (ROOT / "benchmarks" / "results" / "own_garment.jsonl").open("a") as stream:
        stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()

"""Pictures of the worst frames of a model on many clips.

Run `python -m papers.rope_chains.worst_frames MODEL CLIP... -o FOLDER`. MODEL is a file or the name of a shipped model,
CLIP the name of a shipped clip or a recording. Each clip is played with the model's own bones, on the body of the fit
or on another shape (`--betas`). The script takes the frame of each clip with the largest 99th percentile of stretch,
and draws the worst of them, ten unless `--worst` is given, from both sides into FOLDER. It appends one JSON line for
each clip to benchmarks/results/rope_chains_watched.jsonl.
"""

import argparse
import json
from pathlib import Path

import numpy as np

import hemline
from hemline import metrics, pictures
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.meshes import rest_lengths

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "rope_chains_watched.jsonl"
SIZE = (900, 900)
VIEWS = ("three_quarter", "back_three_quarter")


def worst_frame(model, body, name: str, seconds: float) -> tuple[dict, tuple]:
    """Returns the figures of a clip, and stretch, number and frame of its worst frame."""
    motion = hemline.motions.open_motion(name)
    first, last = hemline.motions.longest_clean(motion)
    motion = motion[first:last]
    motion = motion[: max(2, round(seconds * motion.fps) + 1)]
    edges, lengths = rest_lengths(model.garment.faces, model.garment.rest_edges)
    counted = ~np.isin(edges, model.garment.pins.vertices).all(axis=1)
    edges, lengths = edges[counted], lengths[counted]
    stretches, moved, pinched, worst = [], [], [], (-1.0, 0, None)
    for index, frame in enumerate(hemline.play(model, body, motion, fps=30, untangle=True)):
        stretches.append(metrics.stretch_percent(frame.vertices, edges, lengths))
        moved.append(metrics.resolved_percent(frame.before_projection, frame.vertices))
        pinched.append(len(frame.report.pinched))
        if stretches[-1][0] > worst[0]:
            worst = (stretches[-1][0], index, frame)
    row = {"clip": Path(name).stem, "frames": len(stretches)} | metrics.stretch_figures(stretches)
    return row | {"projection_moves": float(np.mean(moved)), "pinched": float(np.mean(pinched))}, worst


def main() -> None:
    parser = argparse.ArgumentParser(description="The worst frames of a model on many clips.")
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("clips", nargs="+", help="shipped clips, or recordings")
    parser.add_argument("-o", "--output", type=Path, required=True, help="where the pictures go")
    parser.add_argument("--seconds", type=float, default=6.0, help="how much of each clip")
    parser.add_argument("--betas", type=float, nargs="*", help="shape of the body; that of the fit unless given")
    parser.add_argument("--worst", type=int, default=10, help="how many pictures")
    options = parser.parse_args()
    use_threads(1)
    model = hemline.load(options.model)
    shape = model.garment.body_betas if options.betas is None else options.betas
    body = hemline.bodies.load(model.body_name).shaped(shape)
    common = {"model": model.garment.name, "betas": [float(b) for b in shape], "machine": machine(), "commit": commit()}
    options.output.mkdir(parents=True, exist_ok=True)
    found = []
    for name in options.clips:
        row, worst = worst_frame(model, body, name, options.seconds)
        print(
            f"{row['clip']:<14} {row['frames']:>4} frames  stretch p99 {row['p99_mean']:5.1f} %, worst "
            f"{row['p99_worst']:5.1f} %  long {row['long']:.3f} %  projection moves {row['projection_moves']:.2f} %",
            flush=True,
        )
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row | common) + "\n")
        found.append((row["clip"], *worst))
    for rank, (clip, stretch, index, frame) in enumerate(sorted(found, key=lambda each: -each[1])[: options.worst], 1):
        meshes = [(frame.body.vertices, frame.body.faces, "body"), (frame.vertices, model.garment.faces, "cloth")]
        path = options.output / f"{rank:02d}-{clip}-{index}.png"
        pictures.write_png(
            path, pictures.side_by_side([pictures.picture_of(meshes, view, size=SIZE) for view in VIEWS])
        )
        print(f"{path}  {stretch:.1f} %")


if __name__ == "__main__":
    main()

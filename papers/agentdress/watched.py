"""A close-fitting garment watched: `python -m papers.agentdress.watched MODEL CLIP... -o FOLDER`.

MODEL is a file or the name of a shipped model, a CLIP a shipped one or a recording. Each clip is played on bodies of
several shapes: the mean one, and random ones of four betas. Of each clip and shape the figures of `hemline evaluate`
are kept in FOLDER, and the frame whose edges are stretched most, drawn from both sides. A command that is run again
goes on; another model or another commit wants another folder.

One JSON line goes to benchmarks/results/agentdress_watched.jsonl; the page papers/agentdress/pages/watched-GARMENT.md and the
picture of its worst frames are made anew.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import hemline
from hemline import metrics, pictures
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.compiled import use_threads
from hemline.meshes import rest_lengths
from hemline.playback import Frame, evaluate
from hemline.sim import random_shapes
from papers.agentdress.watched_page import write_page

ROOT = Path(__file__).parents[2]
ROWS = "rows.jsonl"
RESULTS = ROOT / "benchmarks" / "results" / "agentdress_watched.jsonl"
SIZE = (360, 480)
VIEWS = ("three_quarter", "back_three_quarter")
BETAS = 4
"""Of a random body, so many betas are drawn; the paper has as many."""
SHOWN = 4
"""Frames on the page."""


def shapes(body: hemline.bodies.Body, count: int, seed: int) -> list[np.ndarray]:
    """The mean shape and random ones."""
    drawn = random_shapes(body, count - 1, seed)
    return [np.zeros(BETAS, np.float32), *(np.array(each[:BETAS], np.float32) for each in drawn)]


def watched(
    model: AnimatorAgentDress, body: ShapedBody, motion: hemline.motions.Motion
) -> tuple[dict[str, Any], tuple[float, int, Frame]]:
    """Figures of one clip on one body, and its worst frame."""
    edges, lengths = rest_lengths(model.garment.faces, model.garment.rest_edges)
    worst: list[tuple[float, int, Frame]] = []
    count = 0

    def keep(frame: Frame) -> None:
        nonlocal count
        stretch = metrics.stretch_percent(frame.vertices, edges, lengths)[0]
        if not worst or stretch > worst[0][0]:
            worst[:] = [(stretch, count, frame)]
        count += 1

    figures = evaluate(model, body, motion, untangle=True, keep=keep).figures
    return figures, worst[0]


def row_of(clip: str, shape: int, figures: dict[str, Any]) -> dict[str, Any]:
    """What is kept of a clip on a shape."""
    inside, through, stretch = (figures[name] for name in ("inside_percent", "skin_through_percent", "stretch_percent"))
    return {
        "clip": clip,
        "shape": shape,
        "frames": figures["frames"],
        "inside_before": inside["before"],
        "inside_after": inside["worst_frame_after"],
        "pinched": inside["pinched"],
        "through": through["mean"],
        "through_worst": through["worst_frame"],
        "through_buried": through["buried"],
        "stretch_p99": stretch["p99_mean"],
        "long": stretch["long"],
        "crossing": figures["self_crossing_percent"]["mean"],
        "novelty_worst": figures["novelty"]["worst_frame"],
    }


def drawn(model: AnimatorAgentDress, frame: Frame) -> np.ndarray:
    """A frame from both sides."""
    meshes = [(frame.body.vertices, frame.body.faces, "body"), (frame.vertices, model.garment.faces, "cloth")]
    return pictures.side_by_side([pictures.picture_of(meshes, view, size=SIZE) for view in VIEWS])


def kept_rows(folder: Path) -> dict[tuple[str, int], dict[str, Any]]:
    """What a folder holds already, by clip and shape."""
    file = folder / ROWS
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    return {(row["clip"], row["shape"]): row for row in rows}


def main() -> None:
    """Play, measure, draw, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("clips", nargs="+", help="shipped clips, or recordings")
    parser.add_argument("-o", "--output", type=Path, required=True, help="rows, and pictures of the worst frames")
    parser.add_argument("--shapes", type=int, default=8, help="bodies, the mean one first")
    parser.add_argument("--seconds", type=float, default=3.0, help="how much of each clip")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    use_threads(1)
    model = hemline.load(asked.model)
    assert isinstance(model, AnimatorAgentDress)
    body = hemline.bodies.load(model.body_name)
    bodies = [body.shaped(each) for each in shapes(body, asked.shapes, asked.seed)]
    asked.output.mkdir(parents=True, exist_ok=True)
    found = kept_rows(asked.output)
    for name in asked.clips:
        clip, motion = Path(name).stem, hemline.motions.open_motion(name)
        first, last = hemline.motions.longest_clean(motion)
        motion = motion[first:last]
        motion = motion[: max(2, round(asked.seconds * motion.fps))]
        for number, shaped in enumerate(bodies):
            if (clip, number) in found:
                continue
            figures, (stretch, index, frame) = watched(model, shaped, motion)
            picture = pictures.add_caption(
                drawn(model, frame), f"{clip}, body {number}, frame {index}: p99 {stretch:.0f} %"
            )
            pictures.write_png(asked.output / f"{clip}-{number}.png", picture)
            row = row_of(clip, number, figures) | {"stretch_worst": stretch}
            with (asked.output / ROWS).open("a") as stream:
                stream.write(json.dumps(row) + "\n")
            found[clip, number] = row
            told = "  ".join(f"{k} {v:.3g}" for k, v in row.items() if isinstance(v, float))
            print(f"{clip:<12} {number}  {told}", flush=True)
    rows = [found[Path(name).stem, number] for name in asked.clips for number in range(len(bodies))]
    worst = sorted(rows, key=lambda each: -each["stretch_worst"])
    row = {
        "garment": model.garment.name,
        "shapes": [[round(float(beta), 2) for beta in each.betas[:BETAS]] for each in bodies],
        "seconds": asked.seconds,
        "rows": rows,
        "machine": machine(),
        "commit": commit(),
    }
    pages = ROOT / "papers" / "agentdress" / "pages"
    shown = [np.asarray(Image.open(asked.output / f"{each['clip']}-{each['shape']}.png")) for each in worst[:SHOWN]]
    pictures.write_png(pages / f"watched-{model.garment.name}.png", np.concatenate(shown, axis=0))
    print(write_page(row, pages))
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()

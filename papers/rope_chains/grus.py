"""Comparison of rope chains with recurrent networks.

Run `python -m papers.rope_chains.grus MODEL TAKES TRUTH`. MODEL is a file or the name of a shipped model, TAKES a
dataset of the same garment to train on (its training split with mirror images; the validation split chooses the epoch),
TRUTH a dataset of clips that were not trained on. Each clip of TRUTH, and three of the training split, are played with
the bones of one recurrent network for each chain, with the model's ropes, and with its learned bones, all through the
networks of the model. The script prints the mean distances of free bones and of vertices to the simulation; the latter
by `hemline.evaluate`, with the whole-cloth step and the projection.

It appends one JSON line for each clip to benchmarks/results/rope_chains_grus.jsonl and writes the page
papers/rope_chains/pages/grus-NAME.md, with the frame of a training clip (Fig. 13) and of a held-out clip (Fig. 14) in
which the recurrent networks have the largest error.
"""

import argparse
import json
import time
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

import hemline
from hemline import pictures
from hemline.animators.ropes.bones.bones import bones_of_mesh, rest_bones
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.learning.key_frame import to_key_frame
from papers.rope_chains.baselines import Baseline
from papers.rope_chains.baselines.gru_training import GruOptions, train_grus

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "rope_chains_grus.jsonl"
PAGES = ROOT / "papers" / "rope_chains" / "pages"
SIZE = (480, 560)
FIGURES = {"trained on": ("13", "seen in training"), "held out": ("14", "never seen")}
PAGE = """\
# Rope chains beside recurrent networks: {name}

Written by `python -m papers.rope_chains.grus {model} TAKES TRUTH` at commit {commit}, on {machine}, one
thread: one recurrent network (GRU) for each of {chains} chains, trained on {frames} frames and their mirror images in
{seconds:.0f} s. All rows go through the same networks from bones to mesh, the whole-cloth step and the projection.

{table}

The paper: the recurrent networks are noisy on frames of the training, which the skinning and shape networks smooth, and
generalise very poorly to others: their dynamics are wrong (section 9, Figs. 13, 14).
{pictures}"""
PICTURE = """
## Fig. {number}: a clip {seen} ({clip})

The frame in which the recurrent networks are farthest off. {columns}, simulation.

![Fig. {number}]({file})
"""
TRAINING_CLIPS = 3
"""Number of takes of the training split that are played, evenly spread over it."""


class EpochTimer:
    """Prints the duration of an epoch."""

    def __init__(self):
        self.begun = time.perf_counter()

    def __call__(self, stage: str, done: int, total: int) -> None:
        if done == 1:
            self.begun = time.perf_counter()
        elif done == total or done % 10 == 0:
            cost = (time.perf_counter() - self.begun) / (done - 1)
            print(f"{stage}: epoch {done} of {total}, {cost:.2f} s each", flush=True)


def bones_mm(model, source, body, take) -> float:
    """Returns the mean distance of free bones to the simulated ones along a clip [mm]."""
    ropes, motion, off = model.ropes, take.motion, []
    free, rest = ropes.parents >= 0, rest_bones(ropes, model.rest, body)
    state = source.start(body.posed(motion[0]))
    for index in range(len(motion)):
        posed = body.posed(motion[index])
        state, moved = source.step(state, posed, 1 / motion.fps, rest)
        truth = to_key_frame(posed.transforms[model.key], bones_of_mesh(ropes, take.vertices[index], posed)) - rest
        off.append(np.linalg.norm((moved.reshape(-1, 3) - truth)[free], axis=1).mean())
    return 1e3 * float(np.mean(np.array(off)[take.clip_frames]))


def evaluate_clip(model, animators: dict, body, dataset, row) -> tuple[dict, np.ndarray]:
    """Returns errors of all animators on a clip, and a picture of the frame with the largest error of the first."""
    take, found, frames = dataset.take(row), {}, {}
    for name, (animator, source) in animators.items():
        frames[name] = []
        figures = hemline.evaluate(animator, body, take.motion, truth=dataset, keep=frames[name].append).figures
        mesh = figures["vertex_error_mm"]["mean"]
        found[name] = {"bones_mm": bones_mm(model, source, body, take), "mesh_mm": mesh}
    truth = take.vertices[take.clip_frames]
    off = [np.linalg.norm(f.vertices - v, axis=1).mean() for f, v in zip(frames["gru"], truth, strict=True)]
    worst = int(np.argmax(off))
    shown_body, faces = frames["gru"][worst].body, model.garment.faces
    meshes = [(each[worst].vertices, "cloth") for each in frames.values()] + [(truth[worst], "truth")]
    views = [
        pictures.picture_of(
            [(shown_body.vertices, shown_body.faces, "body"), (vertices, faces, colour)],
            "back_three_quarter",
            size=SIZE,
        )
        for vertices, colour in meshes
    ]
    figures = {"clip": row.clip, "part": row.part, "frames": row.clip_frames} | found
    return figures, pictures.side_by_side(views)


def table_row(row: dict, names) -> str:
    """Returns one clip as a row of the table."""
    cells = (f"{row[name]['bones_mm']:.1f}; {row[name]['mesh_mm']:.1f}" for name in names)
    return f"| {row['side']} | {row['clip']} | {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description="A recurrent network for each chain in the place of the ropes.")
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("takes", type=Path, help="a dataset to train on")
    parser.add_argument("truth", type=Path, help="a dataset of clips that were not trained on")
    parser.add_argument("--epochs", type=int, default=GruOptions.epochs, help="passes over the training set")
    arguments = parser.parse_args()
    use_threads(1)
    model, options = hemline.load(arguments.model), GruOptions(epochs=arguments.epochs)
    takes, truth = (hemline.datasets.open_dataset(folder) for folder in (arguments.takes, arguments.truth))
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    begun = time.perf_counter()
    grus = train_grus(TakeFrames.of(takes), model.ropes, options, seed=0, progress=EpochTimer())
    seconds, shown_rows = time.perf_counter() - begun, takes.split("train")
    count = sum(row.clip_frames for row in shown_rows)
    print(f"{len(grus.cells.slots)} chains, {count} frames to train on: {seconds:.0f} s, reading included")
    ropes = replace(model, learned=None)
    animators = {"gru": (Baseline.of(model, "gru", source=grus), grus), "ropes": (ropes, ropes.source)}
    if model.learned:
        animators["learned"] = (model, model.source)
    chosen = np.linspace(0, len(shown_rows) - 1, min(TRAINING_CLIPS, len(shown_rows))).astype(int)
    plan = [("trained on", takes, shown_rows[k]) for k in chosen] + [("held out", truth, row) for row in truth.clips()]
    common = {"model": model.garment.name, "machine": machine(), "commit": commit(), "threads": 1}
    common |= {"options": asdict(options), "frames_trained": count, "training_s": seconds}
    table = [
        f"| side | clip | {' | '.join(f'{name}: bones; mesh, mm' for name in animators)} |",
        "|---" * (2 + len(animators)) + "|",
    ]
    print("\n".join(table), flush=True)
    rows, drawn = [], []
    for side, dataset, clip in plan:
        figures, picture = evaluate_clip(model, animators, body, dataset, clip)
        rows.append({"side": side} | figures)
        table.append(table_row(rows[-1], animators))
        print(table[-1], flush=True)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(rows[-1] | common) + "\n")
        if [row["side"] for row in rows].count(side) == 1:
            number, seen = FIGURES[side]
            file = f"grus-{model.garment.name}-{number}.png"
            pictures.write_png(PAGES / file, picture)
            columns = ", ".join(animators)
            drawn.append(PICTURE.format(number=number, seen=seen, clip=clip.clip, columns=columns, file=file))
    for side in FIGURES:
        mean = {
            name: {key: np.mean([row[name][key] for row in rows if row["side"] == side]) for key in rows[0][name]}
            for name in animators
        }
        table.append(table_row({"side": side, "clip": "mean"} | mean, animators))
        print(table[-1])
    page = PAGE.format(
        name=model.garment.name,
        model=Path(arguments.model).name,
        commit=commit(),
        machine=machine(),
        chains=len(grus.cells.slots),
        frames=count,
        seconds=seconds,
        table="\n".join(table),
        pictures="".join(drawn),
    )
    (PAGES / f"grus-{model.garment.name}.md").write_text(page)


if __name__ == "__main__":
    main()

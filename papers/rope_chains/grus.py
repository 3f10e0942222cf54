"""Comparison of rope chains with recurrent networks.

Run `python -m papers.rope_chains.grus MODEL TAKES TRUTH`. MODEL is a file or the name of a shipped model, TAKES a
dataset of the same garment to train on (the validation split chooses the epoch), TRUTH a dataset of clips that were not
trained on. One recurrent network for each chain is trained twice: as the paper has it (inputs are the pose, 4,000
frames), and on all frames and their mirror images with the body's velocities as further inputs. Each clip of TRUTH, and
three of the training split, are played with both, and with the model's own bones, all through the networks of the
model. Distances of vertices are those of `hemline.evaluate`, with the whole-cloth step and the projection.

It appends one JSON line for each clip to benchmarks/results/rope_chains_grus.jsonl and writes the page
papers/rope_chains/pages/grus-NAME.md, with the frame of a training clip (Fig. 13) and of a held-out clip (Fig. 14) in
which the recurrent networks of the paper have the largest error.
"""

import argparse
import json
import time
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import numpy as np

import hemline
from hemline import pictures
from hemline.animators.ropes.bones.bones import bones_of_mesh, rest_bones
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.datasets import Row
from hemline.learning.key_frame import to_key_frame
from papers.rope_chains.baselines import Baseline
from papers.rope_chains.baselines.gru_training import PRINTED, PRINTED_FRAMES, GruOptions, train_grus
from papers.rope_chains.hem import BANDS, hem_in_key, power_by_band

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "rope_chains_grus.jsonl"
PAGES = ROOT / "papers" / "rope_chains" / "pages"
SIZE = (480, 560)
FIGURES = {"trained on": ("13", "seen in training"), "held out": ("14", "never seen")}
PAGE = """\
# Rope chains beside recurrent networks: {name}

Written by `python -m papers.rope_chains.grus {model} TAKES TRUTH` at commit {commit}, on {machine}, one
thread. *Printed* is one recurrent network (GRU) for each of {chains} chains as the paper has it: its inputs are the
pose, and it was trained on {printed_frames} frames ({printed_s:.0f} s). *All data* has the velocities of the body as
further inputs, and was trained on all {frames} frames and their mirror images ({more_s:.0f} s). *Own* are the bones of
the model. All go through the same networks from bones to mesh, the whole-cloth step and the projection.

Mean distance of the bones from the simulated ones [mm]:

{bones}

Mean distance of the vertices from the simulation [mm]:

{mesh}

Jerk and the power of the hem's motion by band, relative to the simulation (jerk: mean over clips; power: geometric
mean):

{motion}

The paper: the recurrent networks are noisy on frames of the training, which the skinning and shape networks smooth, and
generalise very poorly to others: their dynamics are wrong (Section 9, Figs. 13 and 14). Here the error of the bones is
larger on held-out clips than on those of the training by a factor of {growth_printed:.2f} as printed, of
{growth_more:.2f} with all data, and of {growth_own:.2f} with the model's own bones. On held-out clips the error of the
own bones is {share_printed:.2f} times that of the networks as printed, and {share_more:.2f} times that of those with
all data.
{pictures}"""
PICTURE = """
## Fig. {number}: a clip {seen} ({clip})

The frame in which the recurrent networks as printed are farthest off. From left to right: {columns}, simulation.

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
    """Returns figures of all animators on a clip, and a picture of the frame with the largest error of the first."""
    take, found, frames = dataset.take(row), {}, {}
    truth = take.vertices[take.clip_frames]
    for name, (animator, source) in animators.items():
        frames[name] = []
        figures = hemline.evaluate(animator, body, take.motion, truth=dataset, keep=frames[name].append).figures
        shown = [frame.vertices for frame in frames[name]]
        powers = [
            power_by_band(hem_in_key(model, frames[name], vertices), take.motion.fps) for vertices in (shown, truth)
        ]
        found[name] = {
            "bones_mm": bones_mm(model, source, body, take),
            "mesh_mm": figures["vertex_error_mm"]["mean"],
            "jerk_ratio": figures["jerk_m_s3"]["ratio"],
            "hem_power_ratio": [ours / max(theirs, 1e-12) for ours, theirs in zip(*powers, strict=True)],
        }
    off = [
        np.linalg.norm(f.vertices - v, axis=1).mean() for f, v in zip(frames[next(iter(frames))], truth, strict=True)
    ]
    worst = int(np.argmax(off))
    shown_body, faces = frames[next(iter(frames))][worst].body, model.garment.faces
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


def mean_of(rows: list[dict], side: str, name: str, key: str) -> float:
    """Returns the mean of a figure over the clips of one side."""
    return float(np.mean([row[name][key] for row in rows if row["side"] == side]))


def clip_table(rows: list[dict], names: list[str], key: str) -> str:
    """Returns the table of a figure by clip, with the means of both sides."""
    lines = [f"| side | clip | {' | '.join(names)} |", "|---" * (2 + len(names)) + "|"]
    lines += [
        f"| {row['side']} | {row['clip']} | " + " | ".join(f"{row[name][key]:.1f}" for name in names) + " |"
        for row in rows
    ]
    for side in FIGURES:
        lines.append(f"| {side} | mean | " + " | ".join(f"{mean_of(rows, side, n, key):.1f}" for n in names) + " |")
    return "\n".join(lines)


def motion_table(rows: list[dict], names: list[str]) -> str:
    """Returns the table of jerk and hem power."""
    bands = [f"power, {low:g} to {high:g} Hz" for low, high in BANDS]
    lines = [f"| side | bones | jerk | {' | '.join(bands)} |", "|---" * (3 + len(bands)) + "|"]
    for side in FIGURES:
        for name in names:
            ratios = [row[name]["hem_power_ratio"] for row in rows if row["side"] == side]
            powers = np.exp(np.mean(np.log(np.maximum(ratios, 1e-12)), axis=0))
            cells = " | ".join(f"{each:.2f}" for each in powers)
            lines.append(f"| {side} | {name} | {mean_of(rows, side, name, 'jerk_ratio'):.2f} | {cells} |")
    return "\n".join(lines)


def spread_clips(rows: list[Row]) -> list[Row]:
    """Returns `TRAINING_CLIPS` rows, evenly spread over those of clips that were simulated in one take."""
    takes = Counter(row.clip for row in rows)
    whole = [row for row in rows if takes[row.clip] == 1]
    return [whole[k] for k in np.linspace(0, len(whole) - 1, min(TRAINING_CLIPS, len(whole))).astype(int)]


def main() -> None:
    """Trains, plays, measures and writes the page."""
    parser = argparse.ArgumentParser(description="A recurrent network for each chain in the place of the ropes.")
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("takes", type=Path, help="a dataset to train on")
    parser.add_argument("truth", type=Path, help="a dataset of clips that were not trained on")
    parser.add_argument("--epochs", type=int, default=GruOptions.epochs, help="passes over all data")
    arguments = parser.parse_args()
    use_threads(1)
    model = hemline.load(arguments.model)
    takes, truth = (hemline.datasets.open_dataset(folder) for folder in (arguments.takes, arguments.truth))
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    source, trained_rows = TakeFrames.of(takes), takes.split("train")
    trainings = {"printed": PRINTED, "all data": GruOptions(epochs=arguments.epochs)}
    animators, seconds = {}, {}
    for name, options in trainings.items():
        begun = time.perf_counter()
        grus = train_grus(source, model.ropes, options, seed=0, progress=EpochTimer())
        seconds[name] = time.perf_counter() - begun
        animators[name] = (Baseline.of(model, "gru", source=grus), grus)
        print(f"{name}: {seconds[name]:.0f} s, reading included", flush=True)
    animators["own"] = (model, model.source)
    names, count = list(animators), sum(row.clip_frames for row in trained_rows)
    plan = [("trained on", takes, row) for row in spread_clips(trained_rows)]
    plan += [("held out", truth, row) for row in truth.clips()]
    common = {"model": model.garment.name, "machine": machine(), "commit": commit(), "threads": 1}
    common |= {"options": {name: asdict(each) for name, each in trainings.items()}, "training_s": seconds}
    rows, drawn = [], []
    for side, dataset, clip in plan:
        figures, picture = evaluate_clip(model, animators, body, dataset, clip)
        rows.append({"side": side} | figures)
        print(json.dumps(rows[-1]), flush=True)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(rows[-1] | common) + "\n")
        if [row["side"] for row in rows].count(side) == 1:
            number, seen = FIGURES[side]
            file = f"grus-{model.garment.name}-{number}.png"
            pictures.write_png(PAGES / file, picture)
            columns = ", ".join(names)
            drawn.append(PICTURE.format(number=number, seen=seen, clip=clip.clip, columns=columns, file=file))
    held = {name: mean_of(rows, "held out", name, "bones_mm") for name in names}
    growth = {name: held[name] / mean_of(rows, "trained on", name, "bones_mm") for name in names}
    page = PAGE.format(
        name=model.garment.name,
        model=Path(arguments.model).name,
        commit=commit(),
        machine=machine(),
        chains=len(animators["printed"][1].cells.slots),
        printed_frames=min(PRINTED_FRAMES, count),
        frames=count,
        printed_s=seconds["printed"],
        more_s=seconds["all data"],
        bones=clip_table(rows, names, "bones_mm"),
        mesh=clip_table(rows, names, "mesh_mm"),
        motion=motion_table(rows, names),
        growth_printed=growth["printed"],
        growth_more=growth["all data"],
        growth_own=growth["own"],
        share_printed=held["own"] / held["printed"],
        share_more=held["own"] / held["all data"],
        pictures="".join(drawn),
    )
    (PAGES / f"grus-{model.garment.name}.md").write_text(page)
    print(page)


if __name__ == "__main__":
    main()

"""Figures and pictures of a model of rope chains in playing.

Run `python -m papers.rope_chains.play_clips MODEL TRUTH`. MODEL is a file or the name of a shipped model, TRUTH a
dataset of the same garment with clips of subjects that were not part of the fit. The cape's page uses the output of
`hemline simulate cape -m run walk jump turn kick dance daz_rig/135_04.bvh 06_05.bvh 01_05.bvh 02_08.bvh -o cape-test
--seconds 5`, run in the folder of the recordings. Each clip is played three times: with the model's own bones, with
those but without the whole-cloth step, and driven by simulated bones. The rest drape moved rigidly with the key joint
is the reference without a model. Then the body stands still for five seconds in its rest pose, and is frozen in the
middle of a run.

The script appends one JSON line for each clip to benchmarks/results/rope_chains_played.jsonl and writes the page
papers/rope_chains/pages/MODEL.md, with pictures of the worst frame of each clip: without the step, with it, and the
simulation.
"""

import argparse
import json
from pathlib import Path

import numpy as np

import hemline
from hemline import pictures
from hemline.arrays import FramesOfVertices
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.learning.key_frame import to_key_frame
from hemline.motions.motion import Motion
from hemline.sim import SimSettings, simulate

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "rope_chains_played.jsonl"
PICTURES = ROOT / "papers" / "rope_chains" / "pages"
BANDS = ((0.0, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0))
"""Frequency bands of the hem's motion [Hz]."""
HEM = 10
"""Percentage of the vertices that are the hem: the lowest ones at rest."""
STANDING_S, FROZEN_AT_S, FROZEN_S = 5.0, 1.0, 4.0
LOOK_CLOSER = (640, 640)


class FrameList:
    """Collects the frames of a clip."""

    def __init__(self):
        self.frames = []

    def __call__(self, frame):
        self.frames.append(frame)

    @property
    def vertices(self) -> FramesOfVertices:
        return np.stack([frame.vertices for frame in self.frames])


def hem_in_key(model, frames, vertices: FramesOfVertices) -> np.ndarray:
    """Returns the hem in the frame of the key joint, less its mean over the clip [m]."""
    hem = model.rest[:, 1] <= np.percentile(model.rest[:, 1], HEM)
    keys = [frame.body.transforms[model.key] for frame in frames]
    seen = np.stack([to_key_frame(key, each[hem]) for key, each in zip(keys, vertices, strict=True)])
    return seen - seen.mean(axis=0)


def power_by_band(seen: np.ndarray, fps: float) -> list[float]:
    """Returns the mean power of the hem's motion in each of `BANDS` [m^2]."""
    window = np.hanning(len(seen))[:, None, None]
    power = (np.abs(np.fft.rfft(seen * window, axis=0)) ** 2).mean(axis=(1, 2))
    at = np.fft.rfftfreq(len(seen), 1 / fps)
    return [float(power[(at >= low) & (at < high)].sum()) for low, high in BANDS]


def evaluate_clip(model, body, truth, row) -> dict:
    """Returns all figures of one clip."""
    take = truth.take(row)
    ways = {"own": {}, "own, step off": {"whole": False}, "truth": {"drive": "truth"}}
    found, kept = {}, {}
    for name, options in ways.items():
        kept[name] = FrameList()
        evaluation = hemline.evaluate(model, body, take.motion, truth=truth, keep=kept[name], **options)
        found[name] = {
            key: evaluation.figures[key]
            for key in (
                "vertex_error_mm",
                "stretch_percent",
                "inside_percent",
                "resolved_percent",
                "ripple_deg",
                "jerk_m_s3",
                "frame_ms",
            )
        }
    clip = ~take.lead_in
    vertices, frames = take.vertices[clip], kept["own"].frames
    powers = [
        power_by_band(hem_in_key(model, frames, each), take.motion.fps) for each in (kept["own"].vertices, vertices)
    ]
    carried = [model.rest @ f.body.transforms[model.key][:, :3].T + f.body.transforms[model.key][:, 3] for f in frames]
    stiff = 1e3 * float(np.linalg.norm(np.stack(carried) - vertices, axis=2).mean())
    worst = int(np.argmax([_longest(model, frame) for frame in kept["own, step off"].frames]))
    meshes = [
        (kept["own, step off"].frames[worst].vertices, "cloth"),
        (frames[worst].vertices, "cloth"),
        (vertices[worst], "truth"),
    ]
    _picture(PICTURES / f"{model.garment.name}-{row.clip}.png", frames[worst].body, meshes, model.garment.faces)
    ratios = [ours / max(theirs, 1e-12) for ours, theirs in zip(*powers, strict=True)]
    return {"clip": row.clip, "frames": len(frames), "stiff_mm": stiff, "hem_power_ratio": ratios} | found


def _longest(model, frame) -> float:
    strains = hemline.metrics.edge_strains(frame.vertices, model.garment.faces, model.garment.rest_edges)
    return float(np.percentile(strains, 99))


def _picture(path: Path, body, meshes, faces) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    views = [
        pictures.picture_of(
            [(body.vertices, body.faces, "body"), (vertices, faces, colour)], "back_three_quarter", size=LOOK_CLOSER
        )
        for vertices, colour in meshes
    ]
    pictures.write_png(path, pictures.side_by_side(views))


def standing_figures(model, body) -> dict:
    """Returns the drift of ropes and vertices from the settled drape while the body stands still [mm]."""
    posed = body.posed(body.rest_pose)
    state, free = model.ropes.start(posed), model.ropes.parents >= 0
    begun, speeds = state.positions[free], []
    for _ in range(round(30 * STANDING_S)):
        state = model.ropes.step(state, posed, 1 / 30)
        speeds.append(np.linalg.norm(state.velocities[free], axis=1).mean())
    drift = np.linalg.norm(state.positions[free] - begun, axis=1)
    player = hemline.Player.prepare(model, body)
    shown_state = player.start(body.rest_pose, pre_roll=STANDING_S)
    _, frame = player.step(shown_state, body.rest_pose, 1 / 30)
    away = np.linalg.norm(frame.vertices - model.rest, axis=1)
    return {
        "ropes_drift_mm": 1e3 * float(drift.mean()),
        "ropes_speed_mm_s": 1e3 * float(np.mean(speeds[-30:])),
        "played_drift_mm": 1e3 * float(away.mean()),
    }


def frozen_figures(model, body) -> dict:
    """Returns how far and when the hem swings on after the body stops in the middle of a run, and how fast that decays.

    The figures are those of the model and of the simulation.
    """
    run = body.placed(hemline.motions.load("run").resample(30))
    stop, still = round(30 * FROZEN_AT_S), round(30 * FROZEN_S)
    index = np.concatenate([np.arange(stop), np.full(still, stop)])
    motion = Motion(
        run.rotations[index], run.translations[index], 30.0, run.leg_length, "frozen run", run.source, run.licence
    )
    frames = np.stack([frame.vertices for frame in hemline.play(model, body, motion, fps=None, placed=True)])
    take = simulate(model.garment, body, motion, SimSettings(fps=30.0))
    hem = model.rest[:, 1] <= np.percentile(model.rest[:, 1], HEM)
    figures = {}
    for name, vertices in (("frozen", frames), ("frozen_truth", take.vertices[~take.lead_in])):
        path = vertices[stop:, hem].mean(axis=1)
        away = np.linalg.norm(path - path[-15:].mean(axis=0), axis=1)
        lasting = np.flatnonzero(away > away.max() / np.e)
        figures |= {
            f"{name}_swing_mm": 1e3 * float(away.max()),
            f"{name}_lag_s": float(away.argmax() / 30),
            f"{name}_decay_s": float(lasting[-1] / 30),
        }
    return figures


def table_row(row: dict) -> str:
    """Returns one clip as a row of the table."""
    own, off, driven = row["own"], row["own, step off"], row["truth"]
    stretch, torn = own["stretch_percent"], off["stretch_percent"]
    bands = " ".join(f"{each:.2f}" for each in row["hem_power_ratio"])
    return (
        f"| {row['clip']} | {own['vertex_error_mm']['mean']:.0f}; {driven['vertex_error_mm']['mean']:.1f}; "
        f"{row['stiff_mm']:.0f} | {torn['p99_mean']:.0f} -> {stretch['p99_mean']:.0f} | "
        f"{torn['p99_worst']:.0f} -> {stretch['p99_worst']:.0f} | {torn['long']:.2f} -> {stretch['long']:.2f} | "
        f"{off['inside_percent']['before']:.1f} -> {own['inside_percent']['before']:.2f} | "
        f"{off['resolved_percent']:.1f} -> {own['resolved_percent']:.2f} | {own['inside_percent']['after']:.2f} | "
        f"{own['jerk_m_s3']['ratio']:.2f} | {own['ripple_deg']['mean']:.1f} ({own['ripple_deg']['truth']:.1f}) | "
        f"{bands} | {own['frame_ms']['median']:.2f} ({own['frame_ms']['stages']['whole']:.2f}) |"
    )


HEADER = """\
| clip | error mm: own; by simulated bones; rigid rest drape | stretch p99 % | worst frame % | > 30 % long, % | \
inside before, % | projection moves, % | inside after, % | jerk / truth | ripples deg (truth) | \
hem power / truth by band | frame ms (step) |
|---|---|---|---|---|---|---|---|---|---|---|---|"""


PAGE = """\
# The {name} in playing

Written by `python -m papers.rope_chains.play_clips {model} TRUTH` at commit {commit}, on {machine}, one thread.
TRUTH holds clips of subjects that were not part of the fit; "->": without and with the [whole-cloth step](\
../../src/hemline/collide/whole/README.md). The other columns are with it.

{table}

Means over the clips: own error {own:.0f} mm, by simulated bones {driven:.1f} mm, the rest drape moved rigidly
{stiff:.0f} mm; stretch p99 {stretch:.1f} % (worst frame {worst:.0f} %), without the step {torn:.1f} %
({torn_worst:.0f} %); {long:.3f} % of the edges are more than 30 % too long, without the step {torn_long:.2f} %; inside
before the projection {before:.2f} %; the projection moves {resolved:.2f} % of the vertices by more than a millimetre.
Jerk is {jerk:.2f} times that of the simulation, the hem's power from 0 to 1, 2, 4 and 8 Hz {power} times.

Standing still for {standing:.0f} s in the rest pose, the ropes drift {ropes_drift_mm:.1f} mm from the settled drape
(in the last second they move at {ropes_speed_mm_s:.1f} mm/s), and what is played {played_drift_mm:.1f} mm.
When the body is frozen in the middle of a run, the hem is farthest from where it comes to hang, {frozen_swing_mm:.0f}
mm, after {frozen_lag_s:.2f} s, and within a third of that for good after {frozen_decay_s:.2f} s. In the simulation:
{frozen_truth_swing_mm:.0f} mm, {frozen_truth_lag_s:.2f} s, {frozen_truth_decay_s:.2f} s.

## The worst frame of each clip

By stretch of what the projection alone makes: without the step, with it, the simulation.

{pictures}
"""


def page(model_name: str, model, rows: list[dict], still: dict) -> str:
    """Returns the page of a model."""

    def mean(of) -> float:
        return float(np.mean([of(row) for row in rows]))

    own, off = ([row[way] for row in rows] for way in ("own", "own, step off"))
    return PAGE.format(
        name=model.garment.name,
        model=model_name,
        commit=commit(),
        machine=machine(),
        table="\n".join([HEADER, *map(table_row, rows)]),
        own=mean(lambda row: row["own"]["vertex_error_mm"]["mean"]),
        driven=mean(lambda row: row["truth"]["vertex_error_mm"]["mean"]),
        stiff=mean(lambda row: row["stiff_mm"]),
        stretch=mean(lambda row: row["own"]["stretch_percent"]["p99_mean"]),
        worst=max(each["stretch_percent"]["p99_worst"] for each in own),
        torn=mean(lambda row: row["own, step off"]["stretch_percent"]["p99_mean"]),
        torn_worst=max(each["stretch_percent"]["p99_worst"] for each in off),
        torn_long=mean(lambda row: row["own, step off"]["stretch_percent"]["long"]),
        power=", ".join(f"{each:.2f}" for each in np.mean([row["hem_power_ratio"] for row in rows], axis=0)),
        long=mean(lambda row: row["own"]["stretch_percent"]["long"]),
        before=mean(lambda row: row["own"]["inside_percent"]["before"]),
        resolved=mean(lambda row: row["own"]["resolved_percent"]),
        jerk=mean(lambda row: row["own"]["jerk_m_s3"]["ratio"]),
        standing=STANDING_S,
        pictures="\n\n".join(f"![{row['clip']}]({model.garment.name}-{row['clip']}.png)" for row in rows),
        **still,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Figures and pictures of a model of rope chains in playing.")
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("truth", type=Path, help="a dataset of clips that the model was not fitted to")
    options = parser.parse_args()
    use_threads(1)
    model, truth = hemline.load(options.model), hemline.datasets.open_dataset(options.truth)
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    common = {"model": model.garment.name, "machine": machine(), "commit": commit(), "threads": 1}
    print(HEADER, flush=True)
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    rows = []
    for row in truth.clips():
        rows.append(evaluate_clip(model, body, truth, row))
        print(table_row(rows[-1]), flush=True)
    still = standing_figures(model, body) | frozen_figures(model, body)
    print(" ".join(f"{name} {value:.2f}" for name, value in still.items()))
    with RESULTS.open("a") as stream:
        stream.writelines(json.dumps(each | common) + "\n" for each in [*rows, still])
    (PICTURES / f"{model.garment.name}.md").write_text(page(options.model, model, rows, still))


if __name__ == "__main__":
    main()

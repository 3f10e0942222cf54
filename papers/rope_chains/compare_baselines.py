"""Comparison of rope chains with the paper's baselines.

Run `python -m papers.rope_chains.compare_baselines MODEL TAKES TRUTH`. MODEL is a file or the name of a shipped model,
TAKES the dataset of its fit, TRUTH a dataset of clips that were not part of a fit. Each row is an animator, played on
each clip of TRUTH by `hemline.evaluate` with the whole-cloth step and the projection:

- the model; its ropes without the bone correction; ropes that are evolved and projected (section 5); ropes that leave
  the body along the gradient, or back along their path (section 6);
- ropes without the bone correction whose constants are fitted again for each of these two ways out;
- mass-spring nets of three stiffnesses in place of the ropes (section 3);
- linear and dual-quaternion skinning in place of the networks (section 7), with weights by distance, or fitted to
  frames of TAKES;
- the rest drape moved rigidly with the key joint.

The column "by simulated bones" is the error of the skin alone. The script appends one JSON line for each row to
benchmarks/results/rope_chains_baselines.jsonl and writes the page papers/rope_chains/pages/baselines-NAME.md.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

import hemline
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.bones import bones_of_mesh, rest_bones
from hemline.animators.ropes.fit.calibrate import calibrate
from hemline.animators.ropes.fit.fit_ropes import calibration_clips
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.learning.key_frame import to_key_frame
from papers.rope_chains.baselines import Baseline, BoneSkin, MassSpringNet

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "rope_chains_baselines.jsonl"
PAGES = ROOT / "papers" / "rope_chains" / "pages"
STIFFNESSES = (5.0, 50.0, 500.0)
"""Stiffnesses of the springs of the nets [N/m]."""
FRAMES = 200
"""Frames of TAKES that skinning weights are fitted to, spread evenly over the takes to train on."""
COLUMNS = {
    "error, mm": ("own_mm", ".1f"),
    "by simulated bones, mm": ("driven_mm", ".1f"),
    "stretch p99, %": ("stretch_p99", ".1f"),
    "worst frame, %": ("stretch_worst", ".0f"),
    "> 30 % long, %": ("long", ".3f"),
    "jerk / simulation": ("jerk", ".2f"),
    "animator, ms": ("ms", ".2f"),
}
"""Columns of the table: figure and format."""
PAGE = """\
# Rope chains compared with baselines: {name}

Written by `python -m papers.rope_chains.compare_baselines {model} TAKES TRUTH` at commit {commit}, on {machine}, one
thread. Means over {clips} clips of subjects that were not part of the fit, with the whole-cloth step and the projection
in every row. TAKES had {takes} takes. Weights of fitted skins are from {frames} frames of them.

{table}

*Calibrated* ropes have springs and damping that were fitted again with that way out of the body, to the same windows of
TAKES; without the bone correction, as the row *without correction*, which they are to be compared with. Skinning in the
place of the networks is played with the bones of that row, too. The nets have the masses, the air and the support of
the drape that the ropes have. Times count only if no other program ran.

What the paper says: mass-spring nets lock or overstretch (section 3); evolve and project damps (section 5); pushing out
along the gradient lets cloth slip round (section 6); the standard skinnings give no reasonable results from ropes
(section 7).
"""


WAYS_OUT = {
    "calibrated, out along the gradient": {"position_push": "gradient"},
    "calibrated, back along the path": {"position_push": "history", "velocity_push": "history"},
}
"""Ways of the ropes out of the body that springs and damping are fitted for again."""


def sample_frames(model, body, takes) -> tuple[np.ndarray, np.ndarray]:
    """Returns displacements of bones and vertices in the key frame, in frames of the takes to train on [m]."""
    rest, rows = rest_bones(model.ropes, model.rest, body), takes.split("train")
    counts = np.array([row.clip_frames for row in rows])
    chosen = np.linspace(0, counts.sum() - 1, min(FRAMES, counts.sum())).astype(int)
    bones, vertices = [], []
    for row, first in zip(rows, np.cumsum(counts) - counts, strict=True):
        here = chosen[(chosen >= first) & (chosen < first + row.clip_frames)] - first
        if not len(here):
            continue
        take = takes.take(row)
        for frame in take.clip_frames[here]:
            posed, seen = body.posed(take.motion[int(frame)]), take.vertices[frame]
            key = posed.transforms[model.key].astype(np.float64)
            bones.append(to_key_frame(key, bones_of_mesh(model.ropes, seen, posed)) - rest)
            vertices.append(to_key_frame(key, seen) - model.rest)
    return np.stack(bones), np.stack(vertices)


def animators(model, body, takes) -> dict:
    """Returns the animators of all rows by name."""
    constants = model.ropes.constants

    def on(**changes):
        return replace(model, ropes=model.ropes.with_constants(replace(constants, **changes)))

    plain = BoneSource(model.ropes, model.correction.with_zero_output())
    rest = rest_bones(model.ropes, model.rest, body)
    near = BoneSkin.near(model.ropes, model.rest, rest)
    fitted = near.fit(*sample_frames(model, body, takes), model.rest, rest)
    found = {
        "the model": model,
        "ropes without correction": Baseline.of(model, "ropes without correction", source=plain),
        "ropes, evolve and project": on(position_update="project"),
        "ropes, out along the gradient": on(position_push="gradient"),
        "ropes, back along the path": on(position_push="history", velocity_push="history"),
    }
    clips = calibration_clips(TakeFrames.of(takes), model.ropes, body, train=True)
    for name, ways in WAYS_OUT.items():
        changed = model.ropes.with_constants(replace(constants, **ways))
        source = BoneSource(calibrate(changed, body, clips), plain.correction)
        found[name] = Baseline.of(model, name, source=source)
    for stiffness in STIFFNESSES:
        name = f"mass-spring net, {stiffness:g} N/m"
        found[name] = Baseline.of(model, name, source=MassSpringNet.of(model.ropes, stiffness))
    skins = {
        "linear skinning, weights by distance": near,
        "linear skinning, fitted weights": fitted,
        "dual quaternions, fitted weights": replace(fitted, blending="dual"),
    }
    return found | {name: Baseline.of(model, name, source=plain, skin=skin) for name, skin in skins.items()}


def evaluate_row(name, animator, body, truth) -> dict:
    """Returns the means over the clips for one row."""
    own, driven = [], []
    for row in truth.clips():
        motion = truth.take(row).motion
        own.append(hemline.evaluate(animator, body, motion, truth=truth).figures)
        if name == "the model" or "skinning" in name or "quaternions" in name:
            driven.append(hemline.evaluate(animator, body, motion, truth=truth, drive="truth").figures)

    def mean(figures, *keys):
        def value(each):
            for key in keys:
                each = each[key]
            return each

        return float(np.mean([value(each) for each in figures])) if figures else None

    return {
        "animator": name,
        "own_mm": mean(own, "vertex_error_mm", "mean"),
        "driven_mm": mean(driven, "vertex_error_mm", "mean"),
        "stretch_p99": mean(own, "stretch_percent", "p99_mean"),
        "stretch_worst": max(each["stretch_percent"]["p99_worst"] for each in own),
        "long": mean(own, "stretch_percent", "long"),
        "jerk": mean(own, "jerk_m_s3", "ratio"),
        "ms": mean(own, "frame_ms", "stages", "animator"),
    }


def rigid_mm(model, body, truth) -> float:
    """Returns the mean error of the rest drape moved rigidly with the key joint [mm]."""
    errors = []
    for row in truth.clips():
        take = truth.take(row)
        for frame in take.clip_frames:
            key = body.posed(take.motion[int(frame)]).transforms[model.key]
            errors.append(np.linalg.norm(model.rest @ key[:, :3].T + key[:, 3] - take.vertices[frame], axis=1).mean())
    return 1e3 * float(np.mean(errors))


def table_row(row: dict) -> str:
    """Returns one row of the table."""
    cells = ("" if row.get(key) is None else format(row[key], style) for key, style in COLUMNS.values())
    return f"| {row['animator']} | {' | '.join(cells)} |"


def main() -> None:
    """Plays all rows and writes the page."""
    parser = argparse.ArgumentParser(description="Comparison of rope chains with the paper's baselines.")
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("takes", type=Path, help="the dataset of the fit")
    parser.add_argument("truth", type=Path, help="a dataset of clips that the model was not fitted to")
    options = parser.parse_args()
    use_threads(1)
    model = hemline.load(options.model)
    takes, truth = (hemline.datasets.open_dataset(folder) for folder in (options.takes, options.truth))
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    common = {"model": model.garment.name, "machine": machine(), "commit": commit(), "threads": 1}
    lines = [f"| animator | {' | '.join(COLUMNS)} |", "|---" * (1 + len(COLUMNS)) + "|"]
    print("\n".join(lines), flush=True)
    for name, animator in animators(model, body, takes).items():
        row = evaluate_row(name, animator, body, truth)
        lines.append(table_row(row))
        print(lines[-1], flush=True)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row | common) + "\n")
    lines.append(table_row({"animator": "the rest drape, moved rigidly", "own_mm": rigid_mm(model, body, truth)}))
    print(lines[-1])
    page = PAGE.format(
        name=model.garment.name,
        model=Path(options.model).name,
        commit=commit(),
        machine=machine(),
        clips=len(truth.clips()),
        takes=len(takes.clips()),
        frames=FRAMES,
        table="\n".join(lines),
    )
    (PAGES / f"baselines-{model.garment.name}.md").write_text(page)


if __name__ == "__main__":
    main()

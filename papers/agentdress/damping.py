"""How long distances to anchors should linger: `python -m papers.agentdress.damping MODEL TRUTH`.

MODEL is a file or the name of a shipped model, TRUTH a dataset of the same garment with clips that it was not fitted
to (`hemline simulate tshirt-light -m walk run kick jump dance -o TRUTH`). Each clip is played with a range of time
constants (`decay_seconds`, Eq. 9 of the paper as a time), and measured: the force that is left on what is shown, its
jerk beside that of the simulation, its error, how far it is from what plays without decay, and how late it is.

The value that is chosen is the longest whose residual on the median vertex is no more than 5 % above the least (the
paper: the largest damping ratio while the norm of the residual is still low). One JSON line a time constant goes to
benchmarks/results/agentdress_damping.jsonl; the page papers/agentdress/pages/damping.md and its picture are made anew.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

import hemline
from hemline import bodies
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Float, FramesOfVertices
from hemline.bench.machine import commit, machine
from hemline.bodies.body import ShapedBody
from hemline.compiled import use_threads
from hemline.datasets import Take, open_dataset
from hemline.metrics.jerk_m_s3 import JERK_FRAMES, jerk_m_s3
from hemline.playback.player.frame import Frame
from papers.agentdress.damping_page import write
from papers.agentdress.residual import Residual

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "agentdress_damping.jsonl"
SECONDS = (0.0, 0.05, 0.1, 0.2, 0.5)
EVERY = 6
"""Of so many frames the residual of one is measured."""
LEAST_PARTS = 10
"""Lateness is looked for in steps of this part of a frame."""
FARTHEST_FRAMES = 9
SPARSE = 10
"""Of so many vertices one is looked at for it."""
LOW = 1.05
"""A residual is low up to so many times the least one."""

Offsets = Float[np.ndarray, "frames verts 3"]


def lateness(damped: Offsets, plain: Offsets, fps: float) -> float:
    """By how much one course of offsets is behind another: where the two agree best [s].

    Args:
        damped: What is late [m].
        plain: What it follows [m].
        fps: Frames a second.
    """
    inner = np.arange(FARTHEST_FRAMES, len(plain))
    tried = np.arange(FARTHEST_FRAMES * LEAST_PARTS + 1) / LEAST_PARTS

    def apart(frames: float) -> float:
        at = inner - frames
        low = np.floor(at).astype(int)
        high = np.minimum(low + 1, len(plain) - 1)
        share = (at - low)[:, None, None]
        earlier = (1 - share) * plain[low] + share * plain[high]
        return float(np.linalg.norm(damped[inner] - earlier, axis=2).mean())

    return float(min(tried, key=apart)) / fps


def longest_low(residuals: dict[float, float]) -> float:
    """The longest time constant up to which the residual stays low.

    Args:
        residuals: By time constant.
    """
    bound = LOW * min(residuals.values())
    longest = min(residuals)
    for seconds in sorted(residuals):
        if residuals[seconds] <= bound:
            longest = seconds
    return longest


def played(model: AnimatorAgentDress, body: ShapedBody, take: Take, seconds: float) -> list[Frame]:
    """Frames of a clip, its lead-in left out."""
    animator = replace(model, config=replace(model.config, decay_seconds=seconds))
    frames = hemline.play(animator, body, take.motion, fps=None, placed=True)
    return [frame for frame, leading in zip(frames, take.lead_in, strict=True) if not leading]


def jerk(vertices: FramesOfVertices, fps: float) -> float:
    """Mean jerk over a clip [m/s^3]."""
    return float(np.mean([jerk_m_s3(vertices[at : at + JERK_FRAMES], fps) for at in range(len(vertices) - 3)]))


def beside(model: AnimatorAgentDress, binding: Binding, frames: list[Frame]) -> Offsets:
    """What is shown beside skinning, in the turned frames of the vertices [m]."""
    return np.array(
        [binding.offsets(each.body.transforms, model.tables.rest, each.vertices) for each in frames], np.float32
    )


def main() -> None:
    """Play, measure, print, record, draw."""
    parser = argparse.ArgumentParser(description="How long distances to anchors should linger.")
    parser.add_argument("model")
    parser.add_argument("truth", type=Path)
    asked = parser.parse_args()
    use_threads(1)
    model, truth = hemline.load(asked.model), open_dataset(asked.truth)
    body, tables = bodies.load(model.body_name).shaped(model.garment.body_betas), model.tables
    binding, residual = Binding(tables.indices, tables.weights, tables.nearest), Residual(model.garment, body)
    found: dict[float, list[dict]] = {seconds: [] for seconds in SECONDS}
    for row in truth.clips():
        take = truth.take(row)
        fps, simulated = take.motion.fps, take.vertices[take.clip_frames]
        plain, told_jerk = None, jerk(simulated, fps)
        for seconds in SECONDS:
            frames = played(model, body, take, seconds)
            vertices, offsets = np.stack([each.vertices for each in frames]), beside(model, binding, frames)
            plain = offsets if plain is None else plain
            left = np.mean([residual.left(each.body, each.vertices) for each in frames[::EVERY]], axis=0)
            found[seconds].append(
                {
                    "clip": row.clip,
                    "frames": len(frames),
                    "residual_n": float(left[0]),
                    "residual_weights": float(left[1]),
                    "jerk_m_s3": jerk(vertices, fps),
                    "jerk_ratio": jerk(vertices, fps) / told_jerk,
                    "error_mm": 1e3 * float(np.linalg.norm(vertices - simulated, axis=2).mean()),
                    "apart_mm": 1e3 * float(np.linalg.norm(offsets - plain, axis=2).mean()),
                    "late_ms": 1e3 * lateness(offsets[:, ::SPARSE], plain[:, ::SPARSE], fps),
                }
            )
            told = "  ".join(f"{k} {v:.2f}" for k, v in found[seconds][-1].items() if isinstance(v, float))
            print(f"{row.clip:<6} {seconds:<5} {told}", flush=True)
        poses = [body.posed(take.motion[int(frame)]) for frame in take.clip_frames[::EVERY]]
        left = [residual.left(posed, each) for posed, each in zip(poses, simulated[::EVERY], strict=True)]
        norm, median = (float(each) for each in np.mean(left, axis=0))
        found[SECONDS[0]][-1] |= {"simulated_residual_n": norm, "simulated_residual_weights": median}
        print(f"{row.clip:<6} simulated, residual {norm:.2f} N, {median:.2f} weights", flush=True)
    common = {"garment": model.garment.name, "machine": machine(), "threads": 1, "commit": commit()}
    rows = [{"decay_seconds": seconds, "clips": each} | common for seconds, each in found.items()]
    with RESULTS.open("a") as stream:
        stream.writelines(json.dumps(row) + "\n" for row in rows)
    residuals = {
        row["decay_seconds"]: float(np.mean([each["residual_weights"] for each in row["clips"]])) for row in rows
    }
    write(rows, longest_low(residuals), model.config.decay_seconds, LOW)


if __name__ == "__main__":
    main()

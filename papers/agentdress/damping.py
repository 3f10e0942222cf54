"""How quickly the garment should follow the pose: `python -m papers.agentdress.damping MODEL TRUTH`.

MODEL is a model file or the name of a shipped model, TRUTH a dataset of the same garment with clips outside its
training set (`hemline simulate tshirt-light -m walk run kick jump dance -o TRUTH`). Each clip is played with several
time constants (`decay_seconds`, Eq. 9 of the paper). Measured are the residual force on the garment, its jerk relative
to the simulation, its error, its distance from playback without decay, and its delay.

The chosen value is the longest whose residual on the median vertex is at most 5 % above the least; the paper chooses
the largest damping ratio that keeps the norm of the residual low. Writes papers/agentdress/pages/damping.md with its
picture, and a row per time constant in benchmarks/results/agentdress_damping.jsonl.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import hemline
from hemline import bodies
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Float, FramesOfVertices
from hemline.bodies.body import ShapedBody
from hemline.compiled import use_threads
from hemline.datasets import Take, open_dataset
from hemline.metrics.jerk_m_s3 import JERK_FRAMES, jerk_m_s3
from hemline.playback.player.frame import Frame
from papers.agentdress.models.ablations import binding_of
from papers.agentdress.settled.residual import Residual
from papers.report import ROOT, Page, Row, mean_of, origin_of, parse_options, record, verdict
from papers.rope_chains.drawing.figure import axes, save_sheet

NAME = "agentdress_damping"
PAGES = ROOT / "papers" / "agentdress" / "pages"
DEFAULT = AgentDressConfig().decay_seconds
SECONDS = (0.0, 0.05, 0.1, 0.2, 0.5)
FPS = 30.0
"""Frame rate at which a time constant corresponds to a damping ratio of the paper."""
STEP = 6
"""Step between the frames whose residual is measured."""
SUBFRAMES = 10
"""Resolution of delays, as a fraction of a frame."""
MOST_FRAMES = 9
"""Largest delay that is tried [frames]."""
SPARSE = 10
"""Step between the vertices that determine the delay."""
LOW = 1.05
"""Ratio to the least residual up to which a residual counts as low."""
MOST_JERK = 1.5

Offsets = Float[np.ndarray, "frames verts 3"]


def write_page(rows: Sequence[Row]) -> str:
    """Writes the page; returns the text.

    Args:
        rows: One row per time constant; the first one is without decay.
    """
    first, names = rows[0], ("residual_weights", "residual_n", "jerk_ratio", "error_mm", "apart_mm", "late_ms")
    default = next((row for row in rows if row["decay_seconds"] == DEFAULT), first)
    seconds, jerk_ratio = choose_seconds(rows), mean_of(default["clips"], "jerk_ratio")
    worst = max(clip["jerk_ratio"] for clip in default["clips"])
    best = min(rows, key=lambda row: mean_of(row["clips"], "error_mm"))
    page = Page("How quickly the garment follows the pose")
    page.text(origin_of(first, "python -m papers.agentdress.damping MODEL TRUTH"))
    page.text(f"""
        {first["garment"]} on {", ".join(clip["clip"] for clip in first["clips"])}, mean shape. Eq. 9 and Fig. 3 of the
        appendix of Wu et al. 2021: joints follow the pose with a damping ratio, which is a time constant here. The
        ratio in the table is that of {FPS:g} frames per second.
    """)
    page.picture("residual and jerk against the time constant", "damping.png")
    page.text(f"""
        Means over the clips, and every sixth frame for the residual. The residual is the force on the shown garment
        (membrane, bending, gravity, contact): on the median vertex, relative to the weight of a vertex; and the norm
        over all vertices, as in the paper, which a few strongly stretched triangles dominate. The simulated garments,
        which move, have a residual of {mean_of(first["clips"], "simulated_residual_weights"):.1f} weights and
        {mean_of(first["clips"], "simulated_residual_n"):.1f} N. Jerk is relative to that of the simulation. The change
        is the mean distance from playback without decay, the delay the time shift of best agreement with it.
    """)
    page.table(
        {
            "time constant, s": "g",
            "damping ratio": ".2f",
            "residual, weights": ".1f",
            "residual, N": ".0f",
            "jerk, relative": ".2f",
            "error, mm": ".2f",
            "change, mm": ".2f",
            "delay, ms": ".0f",
            "jerk of the worst clip": ".2f",
        },
        (
            [row["decay_seconds"], damping_ratio(row["decay_seconds"])]
            + [mean_of(row["clips"], name) for name in names]
            + [max(clip["jerk_ratio"] for clip in row["clips"])]
            for row in rows
        ),
    )
    page.text(f"""
        The paper chooses the largest damping ratio that keeps the residual low, without numbers. Here a residual on the
        median vertex counts as low up to {100 * (LOW - 1):.0f} % above the least one, which gives {seconds:g} s. The
        default is {DEFAULT:g} s, and the error is least at {best["decay_seconds"]:g} s. A recorded arm may twist by 40
        degrees per frame, and a garment that lags behind is then torn at the sleeve. The goal for jerk, at most
        {MOST_JERK:g} times that of the simulation, is {verdict(jerk_ratio, at_most=MOST_JERK)} with the default
        ({jerk_ratio:.2f}, worst clip {worst:.2f}).
    """)
    page.section("Clips, with the default time constant").table(
        {
            "clip": "",
            "residual of the simulation, weights": ".1f",
            "residual, weights": ".1f",
            "jerk, relative": ".2f",
            "error, mm": ".2f",
            "delay, ms": ".0f",
        },
        (
            [clip["clip"], plain["simulated_residual_weights"]]
            + [clip[name] for name in ("residual_weights", "jerk_ratio", "error_mm", "late_ms")]
            for clip, plain in zip(default["clips"], first["clips"], strict=True)
        ),
    )
    return page.write(PAGES / "damping.md")


def draw(rows: Sequence[Row]) -> None:
    """Draws residual, jerk and error over the time constant."""
    sheet, (plots,) = axes(1, 3, width=3.4, height=3.0)
    titles = {"residual_weights": "residual, weights", "jerk_ratio": "jerk / simulated", "error_mm": "error, mm"}
    for plot, (name, title) in zip(plots, titles.items(), strict=True):
        plot.plot([row["decay_seconds"] for row in rows], [mean_of(row["clips"], name) for row in rows], "o-", ms=3)
        plot.axvline(choose_seconds(rows), color="tab:green", lw=0.8, label="chosen by the residual")
        plot.axvline(DEFAULT, color="grey", ls=":", label="default")
        plot.set(xlabel="time constant, s", ylabel=title)
    plots[0].legend(fontsize=6)
    save_sheet(sheet, PAGES, "damping.png")


def damping_ratio(seconds: float) -> float:
    """Returns the damping ratio of the paper for a time constant, at `FPS`."""
    return float(np.exp(-1 / (FPS * seconds))) if seconds else 0.0


def choose_seconds(rows: Sequence[Row]) -> float:
    """Returns the longest time constant of low residual [s]."""
    return longest_low({row["decay_seconds"]: mean_of(row["clips"], "residual_weights") for row in rows})


def delay(damped: Offsets, plain: Offsets, fps: float) -> float:
    """Returns the time shift at which one sequence of offsets agrees best with another [s].

    Args:
        damped: The delayed sequence [m].
        plain: The sequence that it follows [m].
        fps: Frames per second.
    """
    inner = np.arange(MOST_FRAMES, len(plain))
    candidates = np.arange(MOST_FRAMES * SUBFRAMES + 1) / SUBFRAMES

    def distance(frames: float) -> float:
        at = inner - frames
        low = np.floor(at).astype(int)
        high = np.minimum(low + 1, len(plain) - 1)
        fraction = (at - low)[:, None, None]
        earlier = (1 - fraction) * plain[low] + fraction * plain[high]
        return float(np.linalg.norm(damped[inner] - earlier, axis=2).mean())

    return float(min(candidates, key=distance)) / fps


def longest_low(residuals: dict[float, float]) -> float:
    """Returns the longest time constant whose residual is low, given residuals by time constant."""
    bound = LOW * min(residuals.values())
    return max([min(residuals), *(seconds for seconds, residual in residuals.items() if residual <= bound)])


def play_clip(model: AnimatorAgentDress, body: ShapedBody, take: Take, seconds: float) -> list[Frame]:
    """Plays the clip of a take with a time constant; returns the frames without the lead-in."""
    animator = replace(model, config=replace(model.config, decay_seconds=seconds))
    frames = hemline.play(animator, body, take.motion, fps=None, placed=True)
    return [frame for frame, leading in zip(frames, take.lead_in, strict=True) if not leading]


def mean_jerk(vertices: FramesOfVertices, fps: float) -> float:
    """Returns the mean jerk over a clip [m/s^3]."""
    return float(np.mean([jerk_m_s3(vertices[at : at + JERK_FRAMES], fps) for at in range(len(vertices) - 3)]))


def offsets_of(model: AnimatorAgentDress, binding: Binding, frames: list[Frame]) -> Offsets:
    """Returns the offsets of the shown garments from the skinned one, in rotated vertex frames [m]."""
    return np.array(
        [binding.offsets(each.body.transforms, model.tables.rest, each.vertices) for each in frames], np.float32
    )


def main() -> None:
    """Plays, measures, records, draws and writes the page."""
    options = parse_options(__doc__, "model", "truth")
    use_threads(1)
    model, truth = hemline.load(options.model), open_dataset(options.truth)
    body = bodies.load(model.body_name).shaped(model.garment.body_betas)
    binding, residual = binding_of(model), Residual(model.garment, body)
    clips: dict[float, list[dict]] = {seconds: [] for seconds in SECONDS}
    for row in truth.clips():
        take = truth.take(row)
        fps, simulated = take.motion.fps, take.vertices[take.clip_frames]
        plain, jerk = None, mean_jerk(simulated, fps)
        for seconds in SECONDS:
            frames = play_clip(model, body, take, seconds)
            vertices, offsets = np.stack([each.vertices for each in frames]), offsets_of(model, binding, frames)
            plain = offsets if plain is None else plain
            norm, median = np.mean([residual.measure(each.body, each.vertices) for each in frames[::STEP]], axis=0)
            clips[seconds].append(
                {
                    "clip": row.clip,
                    "frames": len(frames),
                    "residual_n": float(norm),
                    "residual_weights": float(median),
                    "jerk_m_s3": mean_jerk(vertices, fps),
                    "jerk_ratio": mean_jerk(vertices, fps) / jerk,
                    "error_mm": 1e3 * float(np.linalg.norm(vertices - simulated, axis=2).mean()),
                    "apart_mm": 1e3 * float(np.linalg.norm(offsets - plain, axis=2).mean()),
                    "late_ms": 1e3 * delay(offsets[:, ::SPARSE], plain[:, ::SPARSE], fps),
                }
            )
            print(row.clip, seconds, clips[seconds][-1], flush=True)
        poses = [body.posed(take.motion[int(frame)]) for frame in take.clip_frames[::STEP]]
        sizes = [residual.measure(posed, each) for posed, each in zip(poses, simulated[::STEP], strict=True)]
        norm, median = (float(each) for each in np.mean(sizes, axis=0))
        clips[SECONDS[0]][-1] |= {"simulated_residual_n": norm, "simulated_residual_weights": median}
    rows = [{"decay_seconds": seconds, "clips": each, "garment": model.garment.name} for seconds, each in clips.items()]
    rows = record(NAME, *rows)
    draw(rows)
    print(write_page(rows))


if __name__ == "__main__":
    main()

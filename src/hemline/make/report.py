"""The page about a model that was made: one HTML file that opens without a network."""

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hemline import garments, pictures
from hemline.datasets import Dataset
from hemline.export.images import render_frames
from hemline.files import atomic_write
from hemline.garments import Garment
from hemline.motions import Motion
from hemline.pictures.compare import scale_colours
from hemline.playback import record

from .choice import faults
from .clock import time_text
from .plan import DataPlan
from .regions import Regions
from .trial import Played, Trial, truth_vertices

VIEW_SIZE = (360, 480)
"""Width and height of a picture [pixels]."""
TURN_FRAMES, TURN_FPS = 24, 8.0
"""Number of pictures of the turning garment, and how many are shown in a second."""
MOVING_STEP = 2
"""The moving picture shows one of this number of frames."""
NUMBERS = (
    ("error_mm", "error [mm]", 1),
    ("stretch_p99", "stretch, p99 [%]", 1),
    ("stretch_worst", "in the worst frame [%]", 0),
    ("skin_seen", "skin seen [%]", 2),
    ("limbs_through", "limbs through [%]", 2),
    ("inside", "inside the body [%]", 2),
    ("jerk", "jerk / simulation", 2),
    ("frame_ms", "frame [ms]", 2),
    ("model_mb", "file [MB]", 1),
)
"""Figures of the table: attribute of a `Trial`, heading, decimals."""
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; margin: 1rem 0 } td, th { padding: .3rem .7rem; border-bottom: 1px solid #ddd }
td { text-align: right } td:first-child, th:first-child { text-align: left } th { font-weight: 600 }
tr.chosen { background: #eef6ee } img { max-width: 100%; margin: .3rem .3rem .3rem 0 } pre { background: #f5f5f5;
padding: .7rem; white-space: pre-wrap } .fault { color: #a33 } figcaption { color: #555; font-size: .9rem }
"""


@dataclass(frozen=True)
class Report:
    """What the page tells.

    Attributes:
        garment: The garment.
        regions: Where it hangs.
        plan: What was simulated.
        trials: Figures of all methods.
        truth: Figures of the simulation.
        chosen: The method that was chosen, with its frames.
        check: Dataset of the clip that methods were compared on.
        motion: That clip.
        model: The model file.
        seconds: Time that the run took [s].
        simulated: Number of vertices that were simulated for the fits.
    """

    garment: Garment
    regions: Regions
    plan: DataPlan
    trials: tuple[Trial, ...]
    truth: Trial
    chosen: Played
    check: Dataset
    motion: Motion
    model: Path
    seconds: float
    simulated: int


def write_report(path: Path, report: Report) -> Path:
    """Writes the page, whole or not at all, and returns its path.

    Raises:
        BadOutput: The path cannot be written.
    """
    content = "\n".join(
        [
            f"<title>{html.escape(report.garment.name)}</title><style>{STYLE}</style>",
            f"<h1>{html.escape(report.garment.name)}</h1>",
            _summary(report),
            f"<figure>{_image(_moving(report), 'webp')}<figcaption>The model on '{html.escape(report.motion.name)}', "
            "a clip that it was not fitted to.</figcaption></figure>",
            "<h2>What was understood</h2>",
            f"<pre>{html.escape(garments.explain(report.garment))}</pre>",
            f"<figure>{_image(_turning(report), 'webp')}<figcaption>At rest. Pale cloth lies close to the body, "
            f"dark cloth hangs: {100 * report.regions.hanging_fraction:.0f} % of the area hangs.</figcaption></figure>",
            "<h2>Methods</h2>",
            _table(report),
            "<h2>Worst frames</h2>",
            "<p>The simulation, the model, and the model coloured by its error.</p>",
            *_worst_frames(report),
            "<h2>Next</h2>",
            f"<pre>{html.escape(chr(10).join(next_commands(report.model)))}</pre>",
        ]
    )
    with atomic_write(path) as temporary:
        temporary.write_text(f'<!doctype html><html lang="en"><meta charset="utf-8">\n{content}\n</html>\n', "utf-8")
    return path


def next_commands(model: Path) -> list[str]:
    """Returns three commands that play, measure and show a model."""
    name = f"'{model}'" if " " in str(model) else str(model)
    return [
        f"hemline animate {name} -m dance -o dance.glb",
        f"hemline evaluate {name} -m run",
        f"hemline view {name}",
    ]


def _summary(report: Report) -> str:
    trial, wrong = report.chosen.trial, faults(report.chosen.trial, report.truth)
    line = (
        f"<p><b>{trial.method}</b> was chosen: {trial.error_mm:.1f} mm from the simulation, {trial.frame_ms:.2f} ms "
        f"a frame, {trial.model_mb:.1f} MB. Made in {time_text(report.seconds)}.</p>"
    )
    if wrong:
        line += "<p class='fault'>No method is sound on this garment. What is wrong with the best one:</p><ul>"
        line += "".join(f"<li class='fault'>{html.escape(fault)}</li>" for fault in wrong) + "</ul>"
    return line


def _table(report: Report) -> str:
    head = "".join(f"<th>{heading}</th>" for _, heading, _ in NUMBERS)
    rows = [f"<tr><th>method</th>{head}</tr>"]
    for trial in (*report.trials, report.truth):
        mark = " class='chosen'" if trial is report.chosen.trial else ""
        if trial.failed:
            rows.append(
                f"<tr><td>{trial.method}</td><td colspan='{len(NUMBERS)}'>{html.escape(trial.failed)}</td></tr>"
            )
            continue
        known = (
            {"stretch_p99", "stretch_worst", "limbs_through"}
            if trial is report.truth
            else {name for name, *_ in NUMBERS}
        )
        cells = "".join(
            f"<td>{getattr(trial, name):.{digits}f}</td>" if name in known else "<td></td>"
            for name, _, digits in NUMBERS
        )
        rows.append(f"<tr{mark}><td>{'simulation' if trial is report.truth else trial.method}</td>{cells}</tr>")
    left_out = "".join(f"<li>{html.escape(reason)}</li>" for reason in report.plan.left_out)
    verts = len(report.garment.vertices)
    coarse = f", simulated with {report.simulated} of its {verts} vertices" if report.simulated < verts else ""
    data = (
        f"<p>Measured on '{html.escape(report.motion.name)}', {report.motion.seconds:.1f} s, which no method was "
        f"fitted to; fitted to {report.plan.frames} frames and {report.plan.drapes} drapes{coarse}.</p>"
    )
    return f"<table>{''.join(rows)}</table>{data}" + (f"<ul>{left_out}</ul>" if left_out else "")


def _worst_frames(report: Report) -> list[str]:
    faces = report.garment.faces
    truth = truth_vertices(report.check, report.motion)
    figures = []
    for number in report.chosen.worst:
        frame = report.chosen.frames[number]
        body = (frame.body.vertices, frame.body.faces)
        picture = pictures.comparison(frame.vertices, truth[number], faces, body=body, size=VIEW_SIZE)
        figures.append(f"<figure>{_image([picture], 'png')}<figcaption>Frame {number}.</figcaption></figure>")
    return figures


def _moving(report: Report) -> list[np.ndarray]:
    """Returns the pictures of the chosen model on the clip."""
    garment, motion = report.garment, report.motion
    frames = report.chosen.frames[::MOVING_STEP]
    clip = record(
        frames, garment_name=garment.name, garment_faces=garment.faces, motion=motion, fps=motion.fps / MOVING_STEP
    )
    return list(render_frames(clip, view="front", size=VIEW_SIZE, frames=range(clip.frame_count)))


def _turning(report: Report) -> list[np.ndarray]:
    """Returns pictures of the garment at rest from all sides, coloured by how much it hangs."""
    shaped = report.chosen.frames[0].body.shaped
    rest = report.check.rest(report.garment.body_betas).vertices[0]
    colours = scale_colours(report.regions.hanging)
    body = np.asarray(shaped.vertices, np.float64)
    everything = np.concatenate([body, rest])
    found = []
    for turn in np.linspace(0, 2 * np.pi, TURN_FRAMES, endpoint=False):
        about_y = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
        surfaces = [
            pictures.ShadedSurface((body @ about_y.T).astype(np.float32), shaped.body.faces, pictures.BODY),
            pictures.ShadedSurface(
                (rest @ about_y.T).astype(np.float32), report.garment.faces, colours=colours, sheen=0.0
            ),
        ]
        camera = pictures.frame_points((everything @ about_y.T).astype(np.float32), "front", size=VIEW_SIZE)
        found.append(pictures.render(surfaces, camera, VIEW_SIZE, ground=float(everything[:, 1].min())))
    return found


def _image(frames: Sequence[np.ndarray], kind: str) -> str:
    """Returns the tag of a picture, or of a moving one, that holds its own bytes."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / f"picture.{kind}"
        if kind == "png":
            pictures.write_png(file, frames[0])
        else:
            pictures.write_webp(file, list(frames), TURN_FPS if len(frames) == TURN_FRAMES else 15.0)
        content = base64.b64encode(file.read_bytes()).decode()
    return f"<img alt='' src='data:image/{kind};base64,{content}'>"

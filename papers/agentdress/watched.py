"""A garment on many clips and bodies: `python -m papers.agentdress.watched MODEL CLIP... --output FOLDER`.

MODEL is a model file or the name of a shipped model, a CLIP a shipped one or a recording. Each clip is played on the
mean body and on random bodies of four betas. FOLDER takes the figures of `hemline evaluate` for each clip and body, and
a picture of the frame whose edges are stretched most. With `--simulated N` the garment is simulated on the first N
bodies as well, in motion, and its stretch stands beside. A repeated command continues; use another folder for another
model or commit.

Writes papers/agentdress/pages/watched-GARMENT.md with a picture of the worst frames, and a row in
benchmarks/results/agentdress_watched.jsonl.
"""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import hemline
from hemline import metrics, pictures
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bodies import ShapedBody
from hemline.compiled import use_threads
from hemline.errors import SimulationFailed
from hemline.meshes import rest_lengths
from hemline.playback import Frame, evaluate
from hemline.sim import SimSettings, random_shapes, simulate
from papers.report import ROOT, Page, Row, join_numbers, mean_of, origin_of, parse_options, record

NAME = "agentdress_watched"
PAGES = ROOT / "papers" / "agentdress" / "pages"
ROWS = "rows.jsonl"
PICTURE_SIZE = (360, 480)
VIEWS = ("three_quarter", "back_three_quarter")
BETAS = 4
"""Number of random betas of a body, as in the paper."""
WORST_FRAMES = 4
FIGURES = {
    "inside_after": ("vertices inside after the projection, not pinched, worst frame, %", 0.0),
    "through": ("covered skin visible in front of the cloth, %", 0.1),
    "through_worst": ("covered skin visible in front of the cloth, worst frame, %", None),
    "through_buried": ("covered skin in front of the cloth, hidden by another part of the body, %", None),
    "inside_before": ("vertices inside before the projection, %", None),
    "pinched": ("pinched vertices, %", None),
    "stretch_p99": ("stretch of edges, p99, %", None),
    "long": ("edges more than 30 % too long, %", None),
    "longest": ("longest edge of all, over its length on the pattern, %", 300.0),
    "crossing": ("edges that cross the cloth, %", None),
}
"""Description and largest wanted value of each figure."""
SIMULATED = ("stretch_p99", "long", "longest")
"""Figures that are measured of the simulation too."""
COLUMNS = {
    "inside_before": "inside before, %",
    "pinched": "pinched, %",
    "through": "visible skin, %",
    "stretch_p99": "stretch p99, %",
    "long": "long edges, %",
}


def write_page(row: Row) -> str:
    """Writes the page of a garment; returns the text."""
    rows, shapes, garment = row["rows"], row["shapes"], row["garment"]
    clips = list(dict.fromkeys(each["clip"] for each in rows))
    options = f"--shapes {len(shapes)} --seconds {row['seconds']:g}"
    page = Page(f"AgentDress on many clips and bodies: {garment}")
    page.text(origin_of(row, f"python -m papers.agentdress.watched {garment} CLIP... {options}"))
    page.text(f"""
        {len(clips)} clips on {len(shapes)} bodies, {sum(each["frames"] for each in rows)} frames, limbs first lifted
        out of each other (`untangle`). Body 0 is the mean one; the others have four random betas.
    """)
    summary = []
    for name, (description, goal) in FIGURES.items():
        if name not in rows[0]:  # rows of earlier runs
            continue
        worst = max(rows, key=lambda each: each[name])
        summary.append([description, goal, mean_of(rows, name), worst[name], worst["clip"], worst["shape"]])
    page.table({"figure": "", "goal": "g", "mean": ".3g", "worst": ".3g", "worst clip": "", "worst body": "d"}, summary)
    simulated = [each for each in rows if "simulated" in each]
    if simulated:
        page.section("Beside the simulation")
        page.text(f"""
            {len(simulated)} of these clips and bodies, simulated in motion with the frames of the clip as they are
            played. Means, and the largest of all for the longest edge.
        """)
        page.table(
            {"figure": "", "as played": ".3g", "simulation": ".3g"},
            [
                [
                    FIGURES[name][0],
                    how(each[name] for each in simulated),
                    how(each["simulated"][name] for each in simulated),
                ]
                for name, how in zip(SIMULATED, (_mean, _mean, max), strict=True)
            ],
        )
    page.picture("The worst frames", f"watched-{garment}.png")
    page.text("The frames with the largest stretch of edges, from both sides.")
    columns = {heading: ".2g" for heading in COLUMNS.values()}
    page.section("By clip").table(
        {"clip": "", **columns, "largest novelty": ".2f"},
        (
            [clip, *_means(rows, lambda each, clip=clip: each["clip"] == clip)]
            + [max(each["novelty_worst"] for each in rows if each["clip"] == clip)]
            for clip in clips
        ),
    )
    page.section("By body").table(
        {"betas": "", **columns},
        (
            [join_numbers(betas), *_means(rows, lambda each, number=number: each["shape"] == number)]
            for number, betas in enumerate(shapes)
        ),
    )
    return page.write(PAGES / f"watched-{garment}.md")


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


def _means(rows: Sequence[Row], selects: Callable[[Row], bool]) -> list[float]:
    chosen = [each for each in rows if selects(each)]
    return [mean_of(chosen, name) for name in COLUMNS]


def draw_shapes(body: hemline.bodies.Body, count: int, seed: int) -> list[np.ndarray]:
    """Returns the mean shape and random ones."""
    drawn = random_shapes(body, count - 1, seed)
    return [np.zeros(BETAS, np.float32), *(np.array(each[:BETAS], np.float32) for each in drawn)]


def play(
    model: AnimatorAgentDress, body: ShapedBody, motion: hemline.motions.Motion
) -> tuple[dict[str, Any], tuple[float, int, Frame]]:
    """Plays one clip on one body; returns its figures, and stretch [%], number and content of its worst frame."""
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


def simulate_stretch(
    model: AnimatorAgentDress, body: ShapedBody, motion: hemline.motions.Motion
) -> dict[str, float] | None:
    """Returns the stretch of the garment simulated over one clip [%]; None if the simulation fails."""
    garment = model.garment.dressed(body)
    try:
        take = simulate(garment, body, body.untangle_motion(body.placed(motion)), SimSettings(fps=motion.fps))
    except SimulationFailed:
        return None
    if take.failed:
        return None
    edges, lengths = rest_lengths(model.garment.faces, model.garment.rest_edges)
    frames = take.vertices[~take.lead_in]
    both = metrics.stretch_figures([metrics.stretch_percent(frame, edges, lengths) for frame in frames])
    longest = max(metrics.worst_edge_ratio(frame, edges, lengths) for frame in frames)
    return {"stretch_p99": both["p99_mean"], "long": both["long"], "longest": 100 * (float(longest) - 1)}


def row_of(clip: str, shape: int, figures: dict[str, Any]) -> Row:
    """Returns the row of a clip on a body."""
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
        "longest": 100 * (figures["worst_edge_ratio"] - 1),
        "crossing": figures["self_crossing_percent"]["mean"],
        "novelty_worst": figures["novelty"]["worst_frame"],
    }


def draw_frame(model: AnimatorAgentDress, frame: Frame) -> np.ndarray:
    """Draws a frame from both sides."""
    meshes = [(frame.body.vertices, frame.body.faces, "body"), (frame.vertices, model.garment.faces, "cloth")]
    return pictures.side_by_side([pictures.picture_of(meshes, view, size=PICTURE_SIZE) for view in VIEWS])


def read_folder(folder: Path) -> dict[tuple[str, int], Row]:
    """Reads the rows that a folder already holds, by clip and body."""
    file = folder / ROWS
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    return {(row["clip"], row["shape"]): row for row in rows}


def main() -> None:
    """Plays what is missing, measures, draws, records and writes the page."""
    options = parse_options(
        __doc__,
        "model",
        "clips...",
        output=(Path, "rows, and pictures of the worst frames"),
        shapes=(8, "number of bodies, the mean one first"),
        seconds=(3.0, "length of each clip [s]"),
        simulated=(0, "number of bodies on which the garment is simulated too"),
        seed=0,
    )
    use_threads(1)
    model = hemline.load(options.model)
    assert isinstance(model, AnimatorAgentDress)
    body = hemline.bodies.load(model.body_name)
    bodies = [body.shaped(each) for each in draw_shapes(body, options.shapes, options.seed)]
    options.output.mkdir(parents=True, exist_ok=True)
    found = read_folder(options.output)
    for name in options.clips:
        clip, motion = Path(name).stem, hemline.motions.open_motion(name)
        first, last = hemline.motions.longest_clean(motion)
        motion = motion[first:last]
        motion = motion[: max(2, round(options.seconds * motion.fps))]
        for number, shaped in enumerate(bodies):
            if (clip, number) in found:
                continue
            truth = simulate_stretch(model, shaped, motion) if number < options.simulated else None
            figures, (stretch, index, frame) = play(model, shaped, motion)
            caption = f"{clip}, body {number}, frame {index}: p99 {stretch:.0f} %"
            picture = pictures.add_caption(draw_frame(model, frame), caption)
            pictures.write_png(options.output / f"{clip}-{number}.png", picture)
            row = row_of(clip, number, figures) | {"stretch_worst": stretch}
            row |= {"simulated": truth} if truth else {}
            with (options.output / ROWS).open("a") as stream:
                stream.write(json.dumps(row) + "\n")
            found[clip, number] = row
            print(row, flush=True)
    rows = [found[Path(name).stem, number] for name in options.clips for number in range(len(bodies))]
    worst = sorted(rows, key=lambda each: -each["stretch_worst"])[:WORST_FRAMES]
    views = [np.asarray(Image.open(options.output / f"{each['clip']}-{each['shape']}.png")) for each in worst]
    pictures.write_png(PAGES / f"watched-{model.garment.name}.png", np.concatenate(views, axis=0))
    row = {
        "garment": model.garment.name,
        "shapes": [[round(float(beta), 2) for beta in each.betas[:BETAS]] for each in bodies],
        "seconds": options.seconds,
        "rows": rows,
    }
    print(write_page(*record(NAME, row)))


if __name__ == "__main__":
    main()

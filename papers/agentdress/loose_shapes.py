"""A loose garment on bodies that it was not fitted to: `python -m papers.agentdress.loose_shapes ANCHORS TEST`.

The shipped rope chains of the skirt are sampled at the vertices of the light skirt, on random bodies, and compared with
the light skirt simulated there. On other shapes the ropes hang from a rest garment fitted to that body ("dressed"), or
they swing on the mean body and AgentDress, fitted to a few anchors of the light skirt, adds the effect of the shape
(`AnimatorRedressed`). With the simulation on the mean body instead of the ropes, only the error of the shape remains.

ANCHORS and TEST are folders, made here and continued; `--motion` names the clips of the anchors. Writes
papers/agentdress/pages/loose_shapes.md with a picture, and a row in benchmarks/results/agentdress_loose_shapes.jsonl.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

import hemline
from hemline import bodies, garments, metrics, pictures
from hemline.animators import Animator, fit
from hemline.animators.redressed import AnimatorRedressed
from hemline.arrays import Faces, Vertices
from hemline.collide import inside
from hemline.compiled import use_threads
from hemline.datasets import Take, open_dataset
from hemline.meshes import rest_lengths
from hemline.playback import Player
from papers.agentdress.models.loose_animators import DressSimulation, OnLightSkirt, PlaySimulation
from papers.agentdress.settled.loose_data import SHAPES, Trial, make_anchors, make_trials
from papers.agentdress.settled.pairs import mean_distance_mm
from papers.report import ROOT, Page, Row, join_numbers, mean_of, origin_of, parse_options, record

NAME = "agentdress_loose_shapes"
PAGES = ROOT / "papers" / "agentdress" / "pages"
GARMENT, ROPES, CLIPS = "skirt-light", "skirt", ("walk", "dance")
INSIDE_STEP = 5
"""Step between the frames in which vertices inside the body are counted."""
PICTURE_SIZE = (300, 420)


def write_page(row: Row) -> str:
    """Writes the page; returns the text."""
    rows, shapes = row["rows"], row["bodies"]
    methods = {name: [each for each in rows if each["way"] == name] for name in dict.fromkeys(e["way"] for e in rows)}
    page = Page("A loose garment on other shapes")
    page.text(origin_of(row, "python -m papers.agentdress.loose_shapes ANCHORS TEST"))
    page.text(f"""
        The rope chains of the shipped skirt, sampled at the vertices of `{row["garment"]}`, in
        {" and ".join(f"`{clip}`" for clip in row["clips"])} ({row["seconds"]:g} s each), on {len(shapes)} random bodies
        of four betas, compared with the light skirt simulated there. AgentDress is fitted to {row["anchors"]} anchors
        of it on {row["shapes"]} shapes. The player processes all of them: it keeps the cloth in one piece and outside
        the body.
    """)
    page.text("""
        A model fitted on the mean body can be put on another shape in two ways. "Dressed": it swings there, from a rest
        garment fitted to that body. "Redressed" (`AnimatorRedressed`): it swings on the mean body, and AgentDress adds
        the effect of the shape. With the simulation on the mean body instead of the ropes, only the error of the shape
        remains; "as it is", carried by the pelvis, shows how large the effect of the shape is.
    """)
    page.table(
        {
            "method": "",
            "error, mm": ".1f",
            "error before the player, mm": ".1f",
            "stretch of edges, p99, %": ".1f",
            "inside before the player, %": ".1f",
        },
        (
            [name, *(mean_of(each, key) for key in ("error_mm", "animated_mm", "stretch_percent", "inside_percent"))]
            for name, each in methods.items()
        ),
    )
    nominal = " and ".join(f"{error:.1f} mm in `{clip}`" for clip, error in row["nominal_mm"].items())
    page.text(f"""
        Errors are mean distances of vertices from the simulation on that body. On the mean body the ropes err by
        {nominal}.
    """)
    page.section("Errors by body").table(
        {"error, mm": "", **{f"betas {join_numbers(betas)}": ".1f" for betas in shapes}},
        (
            [name, *(mean_of([e for e in each if e["body"] == n], "error_mm") for n in range(1, len(shapes) + 1))]
            for name, each in methods.items()
        ),
    )
    page.picture("the worst frame of each method", "loose_shapes.png")
    page.text("The frame of largest error of each method: simulated (blue), and as played.")
    return page.write(PAGES / "loose_shapes.md")


def draw_worst(faces: Faces, frames: Mapping[str, tuple[float, int, Vertices, Trial]]) -> None:
    """Draws the worst frame of each method next to the simulation, one row each.

    Args:
        faces: Triangles of the garment.
        frames: Error [mm], frame number, vertices [m] and trial of the worst frame, by method.
    """
    rows = []
    for name, (error, index, vertices, trial) in frames.items():
        body = bodies.load("anny24").shaped(trial.truth.betas).posed(trial.truth.motion[index])
        views = []
        for view in ("three_quarter", "back_three_quarter"):
            for cloth, colour in ((trial.truth.vertices[index], "truth"), (vertices, "cloth")):
                meshes = [(body.vertices, body.faces, "body"), (np.asarray(cloth), faces, colour)]
                views.append(pictures.picture_of(meshes, view, size=PICTURE_SIZE))
        caption = f"{name}: {trial.clip}, body {trial.body}, frame {index}, {error:.0f} mm"
        rows.append(pictures.add_caption(pictures.side_by_side(views), caption))
    pictures.write_png(PAGES / "loose_shapes.png", np.concatenate(rows, axis=0))


def methods_of(ropes: Animator, shapes: Animator, take: Take) -> dict[str, Animator]:
    """Returns the animators that are compared, by name."""
    garment = shapes.garment
    sampled = OnLightSkirt(garment, ropes)
    return {
        "ropes, garment dressed": sampled,
        "ropes, redressed": AnimatorRedressed(sampled, shapes),
        "simulation on the mean body, as it is": DressSimulation(garment, take, changed=False),
        "simulation on the mean body, garment dressed": DressSimulation(garment, take),
        "simulation on the mean body, redressed": AnimatorRedressed(PlaySimulation(garment, take), shapes),
    }


def play(animator: Animator, take: Take) -> tuple[dict[str, float], tuple[float, int, Vertices]]:
    """Plays an animator on the body of a take; returns figures, and error, number and vertices of the worst frame."""
    garment, body = animator.garment, bodies.load(animator.body_name).shaped(take.betas)
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    free = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    player = Player.prepare(animator, body, placed=True)
    dt, rows, worst = 1 / take.motion.fps, [], (-1.0, 0, take.vertices[0])
    state = player.start(take.motion[0], pre_roll=0.0, dt=dt)
    for index in range(len(take.motion)):
        state, frame = player.step(state, take.motion[index], dt)
        if take.lead_in[index]:
            continue
        error = mean_distance_mm(frame.vertices, take.vertices[index])
        row = {
            "error_mm": error,
            "animated_mm": mean_distance_mm(frame.animated, take.vertices[index]),
            "stretch_percent": metrics.stretch_percent(frame.vertices, edges[free], lengths[free])[0],
        }
        if index % INSIDE_STEP == 0:
            solid = frame.body.vertices, frame.body.faces
            row["inside_percent"] = 100 * float(inside(*solid, frame.animated).mean())
        rows.append(row)
        worst = max(worst, (error, index, frame.vertices), key=lambda each: each[0])
    return {name: mean_of([row for row in rows if name in row], name) for name in rows[0] | rows[-1]}, worst


def main() -> None:
    """Simulates what is missing, measures, records, draws and writes the page."""
    options = parse_options(
        __doc__,
        "anchors",
        "test",
        motion=([], "clips of the anchors; without, the anchors must exist"),
        count=(6, "number of anchors"),
        bodies=(4, "number of random bodies"),
        seconds=(2.0, "length of each clip [s]"),
        seed=0,
    )
    use_threads(1)
    garment = garments.load(GARMENT)
    if options.motion:
        make_anchors(options.anchors, garment, options.motion, count=options.count, seed=options.seed)
    shapes = fit(open_dataset(options.anchors), "agentdress")
    ropes = hemline.load(ROPES)
    assert isinstance(ropes, Animator) and isinstance(shapes, Animator)
    count = {"count": options.bodies, "seconds": options.seconds, "seed": options.seed}
    trials = make_trials(options.test, garment, CLIPS, **count)
    rows: list[dict[str, Any]] = []
    frames: dict[str, tuple[float, int, Vertices, Trial]] = {}
    sampled, means = OnLightSkirt(garment, ropes), {trial.clip: trial.mean for trial in trials}
    nominal = {clip: play(sampled, mean)[0]["error_mm"] for clip, mean in means.items()}
    for trial in trials:
        for name, animator in methods_of(ropes, shapes, trial.mean).items():
            figures, worst = play(animator, trial.truth)
            rows.append({"clip": trial.clip, "body": trial.body, "way": name} | figures)
            print(rows[-1], flush=True)
            if name not in frames or worst[0] > frames[name][0]:
                frames[name] = (*worst, trial)
    row = {
        "garment": GARMENT,
        "anchors": int(shapes.figures["anchors"]),
        "shapes": len(SHAPES),
        "shape_left_out_mm": shapes.figures["shape_left_out_mm"],
        "bodies": [[round(beta, 2) for beta in each.betas] for each in trials if each.clip == CLIPS[0]],
        "clips": list(CLIPS),
        "seconds": options.seconds,
        "nominal_mm": nominal,
        "rows": rows,
    }
    draw_worst(garment.faces, frames)
    print(write_page(*record(NAME, row)))


if __name__ == "__main__":
    main()

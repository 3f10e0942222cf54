"""Figures and pictures of a model of rope chains in playing.

Run `python -m papers.rope_chains.play_clips MODEL TRUTH`. MODEL is a file or the name of a shipped model, TRUTH a
dataset of the same garment with clips of subjects that were not part of the fit. The cape's page uses the output of
`hemline simulate cape -m run walk jump turn kick dance daz_rig/135_04.bvh 06_05.bvh 01_05.bvh 02_08.bvh -o cape-test
--seconds 5`, run in the folder of the recordings. Each clip is played three times: with the model's own bones, with
those but without the whole-cloth step, and driven by simulated bones. Beside it stand the rest drape moved rigidly with
the key joint, and two animators that need no fit: `skinned`, the garment moved with the body's skin, and `live`, a
coarse simulation while it plays. Then the body stands still for five seconds in its rest pose, and is frozen in the
middle of a run.

The script appends one JSON line for each clip to benchmarks/results/rope_chains_played.jsonl and writes the page
papers/rope_chains/pages/MODEL.md, with pictures of the worst frame of each clip: without the step, with it, and the
simulation.
"""

import numpy as np

import hemline
from hemline import pictures
from hemline.arrays import FramesOfVertices
from hemline.compiled import use_threads
from papers.report import ROOT, Page, Row, mean_of, origin_of, parse_options, record
from papers.rope_chains.hem import BAND_NAMES, frozen_figures, hem_in_key, power_by_band

PAGES = ROOT / "papers" / "rope_chains" / "pages"
STANDING_S = 5.0
WAYS = {"own": {}, "bare": {"whole": False}, "driven": {"drive": "truth"}}
"""Options of `hemline.evaluate` for each way to play a clip."""
UNFITTED = ("skinned", "live")
"""Animators that play any garment without a fit."""
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


def evaluate_clip(model, unfitted: dict, body, truth, row) -> Row:
    """Returns all figures of one clip, and draws its worst frame.

    Args:
        model: The model.
        unfitted: Animators of the same garment without a fit, by name.
        body: The body of the fit.
        truth: Clips of subjects that were not part of the fit.
        row: The clip.
    """
    take = truth.take(row)
    others = {name: hemline.evaluate(each, body, take.motion, truth=truth).figures for name, each in unfitted.items()}
    found, kept = {}, {}
    for name, options in WAYS.items():
        kept[name] = FrameList()
        found[name] = hemline.evaluate(model, body, take.motion, truth=truth, keep=kept[name], **options).figures
    vertices, frames = take.vertices[~take.lead_in], kept["own"].frames
    _draw_worst(model, row.clip, kept["bare"].frames, frames, vertices)
    shown, simulated = (hem_in_key(model, frames, each) for each in (kept["own"].vertices, vertices))
    powers = zip(power_by_band(shown, take.motion.fps), power_by_band(simulated, take.motion.fps), strict=True)
    keys = [frame.body.transforms[model.key] for frame in frames]
    carried = np.stack([model.rest @ key[:, :3].T + key[:, 3] for key in keys])
    errors = np.stack([each @ key[:, :3] for each, key in zip(kept["own"].vertices - vertices, keys, strict=True)])
    own, bare = found["own"], found["bare"]
    return {
        "clip": row.clip,
        "frames": len(frames),
        "error_mm": own["vertex_error_mm"]["mean"],
        "constant_mm": 1e3 * float(np.linalg.norm(errors.mean(axis=0), axis=1).mean()),
        "driven_mm": found["driven"]["vertex_error_mm"]["mean"],
        "rigid_mm": 1e3 * float(np.linalg.norm(carried - vertices, axis=2).mean()),
        **{f"{name}_mm": figures["vertex_error_mm"]["mean"] for name, figures in others.items()},
        "jerk": own["jerk_m_s3"]["ratio"],
        "ripple_deg": own["ripple_deg"]["mean"],
        "ripple_truth_deg": own["ripple_deg"]["truth"],
        "skin_percent": own["skin_through_percent"]["mean"],
        "inside_after_percent": own["inside_percent"]["after"],
        **{f"power {name}": ours / max(theirs, 1e-12) for name, (ours, theirs) in zip(BAND_NAMES, powers, strict=True)},
        **_cloth("own", own),
        **_cloth("bare", bare),
    }


def _cloth(way: str, figures: dict) -> Row:
    """Returns what the whole-cloth step changes."""
    return {
        f"stretch_{way}": figures["stretch_percent"]["p99_mean"],
        f"worst_{way}": figures["stretch_percent"]["p99_worst"],
        f"long_{way}": figures["stretch_percent"]["long"],
        f"inside_{way}": figures["inside_percent"]["before"],
        f"projected_{way}": figures["resolved_percent"],
    }


def _longest(model, frame) -> float:
    strains = hemline.metrics.edge_strains(frame.vertices, model.garment.faces, model.garment.rest_edges)
    return float(np.percentile(strains, 99))


def _draw_worst(model, clip: str, bare: list, frames: list, truth: FramesOfVertices) -> None:
    """Draws the frame that is stretched most without the whole-cloth step: without the step, with it, simulated."""
    worst = int(np.argmax([_longest(model, frame) for frame in bare]))
    body, faces = frames[worst].body, model.garment.faces
    meshes = [(bare[worst].vertices, "cloth"), (frames[worst].vertices, "cloth"), (truth[worst], "truth")]
    views = [
        pictures.picture_of(
            [(body.vertices, body.faces, "body"), (vertices, faces, colour)], "back_three_quarter", size=LOOK_CLOSER
        )
        for vertices, colour in meshes
    ]
    pictures.write_png(PAGES / f"{model.garment.name}-{clip}.png", pictures.side_by_side(views))


def standing_figures(model, body) -> Row:
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


def build_page(model_name: str, name: str, rows: list[Row], still: Row) -> Page:
    """Returns the page of a model."""

    def tabulate(columns: dict[str, str], keys: list[str]) -> None:
        means = [[mean_of(rows, key) for key in keys]]
        cells = [[row["clip"], *(row[key] for key in keys)] for row in rows]
        page.table({"clip": "", **columns}, [*cells, ["**mean**", *means[0]]])

    page = Page(f"The {name} in playing")
    page.text(
        origin_of(rows[0], f"python -m papers.rope_chains.play_clips {model_name} TRUTH"),
        "TRUTH holds clips of people who were not part of the fit, played as they were recorded.",
    )
    page.section("Distance from the simulation")
    page.text(
        "*Error* is the mean distance of the vertices, *constant* the part that stays the same over the clip, in the",
        "frame of the key joint. *By simulated bones*: the error if the bones are those of the simulation. *Rigid*:",
        "that of the garment at rest, moved with the key joint. `skinned` and `live` need no fit: the garment moved",
        "with the body's skin, and a coarse simulation while it plays. Jerk is relative to that of the simulation.",
        "Times are in the [figures](../../../docs/figures.md#time-of-a-frame).",
    )
    columns = {
        "error [mm]": "error_mm",
        "constant [mm]": "constant_mm",
        "by simulated bones [mm]": "driven_mm",
        "rigid [mm]": "rigid_mm",
        "`skinned` [mm]": "skinned_mm",
        "`live` [mm]": "live_mm",
    }
    formats = dict.fromkeys(columns, ".0f") | {"by simulated bones [mm]": ".1f"}
    tabulate(formats | {"jerk": ".2f"}, [*columns.values(), "jerk"])
    page.section("Swing of the hem")
    page.text("Power of the hem's motion relative to the simulation's, by frequency.")
    tabulate(dict.fromkeys(BAND_NAMES, ".2f"), [f"power {each}" for each in BAND_NAMES])
    page.text(
        f"Standing still for {STANDING_S:.0f} s in the rest pose, the ropes drift {still['ropes_drift_mm']:.1f} mm",
        f"from the settled drape (in the last second they move at {still['ropes_speed_mm_s']:.1f} mm/s), and what is",
        f"played {still['played_drift_mm']:.1f} mm.",
    )
    page.text("A run that stops dead:")
    page.table(
        {"": "", "hem from where it comes to hang [mm]": ".0f", "farthest after [s]": ".2f", "decays in [s]": ".2f"},
        [
            [way, *(still[f"{name}_{key}"] for key in ("swing_mm", "lag_s", "decay_s"))]
            for way, name in (("played", "frozen"), ("simulated", "frozen_truth"))
        ],
    )
    page.section("Cloth, without and with the whole-cloth step")
    page.text(
        "The [whole-cloth step](../../../src/hemline/collide/whole/README.md) comes before the projection out of the",
        "body. Stretch is the 99th percentile of the edges of a frame.",
    )
    names = {
        "stretch": ("stretch [%]", ".1f"),
        "worst": ("worst frame [%]", ".0f"),
        "long": ("edges > 30 % long [%]", ".3f"),
        "inside": ("inside before projection [%]", ".2f"),
        "projected": ("moved by projection [%]", ".2f"),
    }
    columns = {f"{name}, {way}": spec for name, spec in names.values() for way in ("without", "with")}
    tabulate(columns, [f"{key}_{way}" for key in names for way in ("bare", "own")])
    columns = ["ripples [deg]", "simulated ripples [deg]", "inside after projection [%]", "skin seen [%]"]
    keys = ["ripple_deg", "ripple_truth_deg", "inside_after_percent", "skin_percent"]
    tabulate(dict(zip(columns, (".1f", ".1f", ".2f", ".3f"), strict=True)), keys)
    page.section("The worst frame of each clip")
    page.text("By stretch of what the projection alone makes: without the step, with it, the simulation.")
    for row in rows:
        page.picture(row["clip"], f"{name}-{row['clip']}.png")
    return page


def main() -> None:
    options = parse_options(__doc__, "model", "truth")
    use_threads(1)
    model, truth = hemline.load(options.model), hemline.datasets.open_dataset(options.truth)
    body = hemline.bodies.load(model.body_name).shaped(model.garment.body_betas)
    unfitted = {name: hemline.load(name).animator_for(truth.garment, body) for name in UNFITTED}
    rows = []
    for row in truth.clips():
        rows.append(evaluate_clip(model, unfitted, body, truth, row))
        print(row.clip, f"{rows[-1]['error_mm']:.0f} mm", flush=True)
    still = standing_figures(model, body) | frozen_figures(model, body)
    *rows, still = record("rope_chains_played", *({"model": model.garment.name} | each for each in (*rows, still)))
    print(build_page(options.model, model.garment.name, rows, still).write(PAGES / f"{model.garment.name}.md"))


if __name__ == "__main__":
    main()

"""Figs. 9 to 12: both networks on frames of the training and on held-out ones, overtrained, without collisions."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies, pictures
from hemline.animators.ropes.fit.gather import TakeFrames, gather
from hemline.animators.ropes.fit.learn import learn
from papers.rope_chains.drawing.figure import FigureEntry

TRAINED, HELD_OUT = 10, 5
"""Numbers of takes for training and for evaluation of the networks of these figures."""
EPOCHS, OVERTRAINED = 40, 400
RATE = 1e-3
"""Learning rate of overtraining."""
SIZE = (330, 400)
VARIANTS = {
    "as fitted here": {},
    "overtrained": {"epochs": OVERTRAINED, "skinning_rate": RATE, "shape_rate": RATE, "collision_weight": 0.0},
    "without collision term": {"collision_weight": 0.0},
    "with its weight at 10": {"collision_weight": 10.0},
}


def sample_takes(takes) -> TakeFrames:
    """Returns a few takes of each side, spread evenly."""
    whole = TakeFrames.of(takes)
    chosen = []
    for wanted, count in ((True, TRAINED), (False, HELD_OUT)):
        rows = [k for k, side in enumerate(whole.sides) if (side == 0) is wanted]
        chosen += [rows[k] for k in np.unique(np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int))]
    return TakeFrames(takes, tuple(whole.rows[k] for k in chosen), tuple(2 * (whole.sides[k] > 0) for k in chosen))


def displacements_of(learned, frames, chosen: np.ndarray, networks: int) -> np.ndarray:
    """Returns displacements (frames, verts, 3) by one network or both, for simulated bones [m]."""
    parts = [(learned.skinning, learned.skinning_basis), (learned.shape, learned.shape_basis)][:networks]
    rows = sum(network.many(frames.bones[chosen]) @ basis.unpack() for network, basis in parts)
    return np.asarray(rows).reshape(len(chosen), -1, 3)


def errors_of(learned, frames, clear, side: int) -> dict[str, float]:
    """Returns the mean errors of one network and of both [mm], and the vertices inside the body [percent]."""
    chosen = np.flatnonzero(frames.side == side)[::4]
    truth = np.asarray(frames.displacements[chosen]).reshape(len(chosen), -1, 3)
    one, both = (displacements_of(learned, frames, chosen, count) for count in (1, 2))
    off = both - truth
    heights = clear.heights[chosen] + (clear.normals[chosen] * off).sum(2)
    return {
        "skinning": 1e3 * float(np.linalg.norm(one - truth, axis=2).mean()),
        "both": 1e3 * float(np.linalg.norm(off, axis=2).mean()),
        "inside": 100 * float((heights < 0).mean()),
    }


def train_variants(model, takes) -> dict:
    """Returns figures of each variant on training and held-out frames, and its displacements in one frame of each."""
    source, found = sample_takes(takes), {}
    with tempfile.TemporaryDirectory() as folder:
        frames, clear = gather(source, model.ropes, Path(folder), mirror=False)
        sides = [np.flatnonzero(frames.side == side) for side in (0, 2)]
        shown = [of[[len(of) // 2]] for of in sides]
        for name, changes in VARIANTS.items():
            options = {"epochs": EPOCHS, "threads": 1, "mirror": False}
            learned = learn(frames, clear, replace(model.config, **(options | changes)), seed=0)
            found[name] = {
                "train": errors_of(learned, frames, clear, 0),
                "held out": errors_of(learned, frames, clear, 2),
                "shown": [[displacements_of(learned, frames, at, count)[0] for count in (1, 2)] for at in shown],
            }
        found["truth"] = [np.array(frames.displacements[at[0]]).reshape(-1, 3) for at in shown]
    return found


def draw(folder: Path, model, takes) -> list[FigureEntry]:
    """Draws the figures."""
    found = train_variants(model, takes)
    body = bodies.load(model.body_name).shaped(model.garment.body_betas)
    faces = model.garment.faces

    def sheet(name: str, columns: list[tuple[np.ndarray, str]]) -> str:
        under = (body.vertices, body.body.faces, "body")
        views = [
            pictures.picture_of([under, (model.rest + moved, faces, colour)], "back_three_quarter", size=SIZE)
            for moved, colour in columns
        ]
        pictures.write_png(folder / name, pictures.side_by_side(views))
        return name

    usual, over = found["as fitted here"], found["overtrained"]
    none, ten = found["without collision term"], found["with its weight at 10"]
    (first, both), (first_out, both_out) = usual["shown"]
    truth, truth_out = found["truth"]
    budget = (
        f"{TRAINED} takes of the fit, {EPOCHS} passes, {HELD_OUT} held-out takes; the cloth in the body's rest pose. "
    )

    def said(part, *sides):
        return "; ".join(f"{side}: {part[side]['skinning']:.1f} and {part[side]['both']:.1f} mm" for side in sides)

    return [
        FigureEntry(
            "9 and 10", "Networks on frames that they were trained on",
            "Networks do not reproduce the training data exactly; overtrained they match it, and do not generalize.",
            budget + f"From the left: skinning, with shape, simulation, overtrained ({OVERTRAINED} passes). Skinning "
            f"and both: {said(usual, 'train', 'held out')}. Overtrained: {said(over, 'train', 'held out')}.",
            "Holds." if over["train"]["both"] < usual["train"]["both"]
            and over["held out"]["both"] > usual["held out"]["both"] else "Holds only in part: see the numbers.",
            sheet("fig09.png", [(first, "cloth"), (both, "cloth"), (truth, "truth"), (over["shown"][0][1], "cloth")]),
        ),
        FigureEntry(
            "11", "Networks on held-out frames",
            "Holdout frames give some indication of how the network will perform on unseen data.",
            budget + "From the left: skinning, with shape, simulation. " + said(usual, "held out") + ".",
            "The error on held-out frames is "
            f"{usual['held out']['both'] / usual['train']['both']:.1f} times that on training frames.",
            sheet("fig11.png", [(first_out, "cloth"), (both_out, "cloth"), (truth_out, "truth")]),
        ),
        FigureEntry(
            "12", "The collision term",
            "The collision loss increases the penalty on interpenetrations without forcing overfitting.",
            budget + "Held-out frames, without the term, with a weight of 0.1 (ours), of 10: inside "
            + ", ".join(f"{part['held out']['inside']:.2f} %" for part in (none, usual, ten)) + "; error "
            + ", ".join(f"{part['held out']['both']:.1f} mm" for part in (none, usual, ten)) + ".",
            "Holds, at the price of millimetres." if ten["held out"]["inside"] < none["held out"]["inside"]
            else "Does not hold here.",
            sheet("fig12.png", [(none["shown"][1][1], "cloth"), (ten["shown"][1][1], "cloth"), (truth_out, "truth")]),
        ),
    ]  # fmt: skip

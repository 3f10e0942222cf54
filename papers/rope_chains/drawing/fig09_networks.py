"""Figs. 9 to 12: both networks on frames of the training and on held-out ones, overtrained, without collisions."""

import tempfile
from pathlib import Path

import numpy as np

from hemline import bodies, pictures
from hemline.animators.ropes.fit.gather import TakeFrames, gather
from papers.rope_chains.drawing.figure import FigureEntry
from papers.rope_chains.printed_networks import Frames, Training, error_mm, inside_percent, train_both

TRAINED, HELD_OUT = 10, 5
"""Numbers of takes for training and for evaluation of the networks of these figures."""
OVERTRAINED = 2000
"""Number of passes of the overtrained networks."""
SIZE = (330, 400)
VARIANTS = {
    "printed": Training(collision=True),
    "without collision term": Training(),
    "overtrained": Training(epochs=OVERTRAINED, rates=(1e-3, 1e-3), overtrained=True),
}


def sample_takes(takes) -> TakeFrames:
    """Returns a few takes of each side, spread evenly."""
    whole = TakeFrames.of(takes)
    chosen = []
    for wanted, count in ((True, TRAINED), (False, HELD_OUT)):
        rows = [k for k, side in enumerate(whole.sides) if (side == 0) is wanted]
        chosen += [rows[k] for k in np.unique(np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int))]
    return TakeFrames(takes, tuple(whole.rows[k] for k in chosen), tuple(2 * (whole.sides[k] > 0) for k in chosen))


def figures_of(frames: Frames, first: np.ndarray, both: np.ndarray, side: int) -> dict[str, float]:
    """Returns the mean errors of one network and of both [mm], and the vertices inside the body [percent]."""
    some = frames.of(side)
    inside = inside_percent(frames, both[some], some)
    return {"skinning": error_mm(first[some]), "both": error_mm(both[some]), "inside": inside}


def train_variants(model, takes) -> dict:
    """Returns figures of each variant on training and held-out frames, and its displacements in one frame of each."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        gathered, clear = gather(sample_takes(takes), model.ropes, Path(folder), mirror=False)
        frames = Frames(gathered.bones, np.array(gathered.displacements), gathered.side, clear)
        shown = [of[len(of) // 2] for of in (frames.of(0), frames.of(2))]
        for name, training in VARIANTS.items():
            first, both = train_both(frames, training)
            found[name] = {
                "train": figures_of(frames, first, both, 0),
                "held out": figures_of(frames, first, both, 2),
                "shown": [[(frames.vertices[at] - left[at]).reshape(-1, 3) for left in (first, both)] for at in shown],
            }
        found["truth"] = [frames.vertices[at].reshape(-1, 3) for at in shown]
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

    usual, over, none = found["printed"], found["overtrained"], found["without collision term"]
    (first, both), (first_out, both_out) = usual["shown"]
    truth, truth_out = found["truth"]
    budget = (
        f"The paper's training (random start, components of the frames, no noise, its rates and weights) on {TRAINED} "
        f"takes of the fit, {Training.epochs} passes; {HELD_OUT} held-out takes; the cloth in the body's rest pose. "
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
            budget + f"Held-out frames, without and with the term: inside {none['held out']['inside']:.2f} and "
            f"{usual['held out']['inside']:.2f} %, error {none['held out']['both']:.1f} and "
            f"{usual['held out']['both']:.1f} mm; frames of the training: inside {none['train']['inside']:.2f} and "
            f"{usual['train']['inside']:.2f} %, error {none['train']['both']:.1f} and "
            f"{usual['train']['both']:.1f} mm. From the left: without, with, simulation.",
            "Holds." if usual["held out"]["inside"] < none["held out"]["inside"] else "Does not hold here.",
            sheet("fig12.png", [(none["shown"][1][1], "cloth"), (both_out, "cloth"), (truth_out, "truth")]),
        ),
    ]  # fmt: skip

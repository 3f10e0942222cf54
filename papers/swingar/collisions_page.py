"""Writes the page and the picture of `collisions.py`."""

import json
from pathlib import Path

import numpy as np

from hemline import pictures

FOLDER = Path(__file__).parents[2] / "papers" / "swingar" / "pages"
PROJECTION = Path(__file__).parents[2] / "benchmarks" / "results" / "projection-shirt.jsonl"
"""Records of the benchmark of the projection."""
SIZE = 360, 420
PAGE, PICTURES = FOLDER / "collisions.md", FOLDER / "collisions"
PAPER = {  # inside before, SSCH, after; TailorNet, ReFU, Eq. 10
    "tshirt-light": ("T-shirt", 0.97, 0.10, 0.12, 0.56, 0.47, 0.34),
    "dress-light": ("dress", 0.61, 0.07, 0.07, 0.30, 0.28, 0.21),
    "skirt-light": None,
    "trousers-light": ("jumpsuit", 1.18, 0.14, 0.15, 0.63, 0.55, 0.42),
}
TEXT = """\
# Neural distance and collision handling

`python -m papers.swingar.collisions{trials}` wrote this page at commit {commit}, on {machine}, one thread. The paper is
Li et al., "SwinGar", 2023: Section III-D, Tables II and III. The shipped network has the inputs `{inputs}` and a width
of {width}. It was trained on {bodies} posed bodies with {points} points each, in {updates} steps of the optimiser. Its
layers need {value} floating point operations for a point, {both} with the gradient.

## The distance

Mean error in mm around {count} posed bodies, in poses of test subjects, with betas within ±{known} as in the training.
Wrong signs are counted within 1 cm of the skin, and of those points once more for points farther than 2 mm from it.

{known_table}

Within 1 cm the mean angle of the gradient to the true one is {turned:.1f} degrees.

## Bodies beyond the training

With betas up to ±{beyond}, the mean angle of the gradient is {turned_beyond:.1f} degrees, and errors are:

{beyond_table}

## Time

Time of a frame of 1,000 points in ms, the least of several runs beside other work. It includes everything that depends
on the pose but the skinning of the body.

{times}

## In play

After each animator the projection moves vertices out of the body and tests each by the posed mesh itself. Beside the
neural distance, as measured above and for `hemline bench projection-shirt`:

{in_play}

The projection has to come after Eq. 10 as well, so `swingar` plays without it. The network is used in training, where
the collision term needs a distance with gradients (`learning.fit.body_distance`).

## Table II: vertices inside, percent

Light garments on random bodies (betas within ±2) are carried by plain skinning in six clips of test subjects, {frames}
frames each. Each frame stands for itself, with limbs lifted out of each other. A vertex is inside if the winding number
of the posed mesh exceeds 0.5, whatever distance moved it. The paper's rows are those of its own network's predictions:
T-shirt, dress, jumpsuit.

{inside}

The projection comes after Eq. 10 with the neural distance. Pinched vertices, which have no place outside nearby, are
counted separately.

## Table III: local consistency

Mean of |diag(L) - diag(L^C)| over the moved vertices, with half-cotangent weights; smaller is better. TailorNet moves
all of them by a millimetre more than the deepest one is inside. ReFU moves them by a multiple of their depth, chosen in
each frame so that the mean displacement is that of Eq. 10. In their paper a network estimates it.

{deviation}

![the frames with most inside](collisions/worst.png)

The frame of each garment with most vertices inside: carried by skinning, after Eq. 10 with the neural distance, and
after the projection.
"""


def table(head: list[str], rows: list[list[str]]) -> str:
    """Returns a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _errors(found: dict[str, dict[str, float]], trials: dict[str, dict]) -> str:
    columns = list(next(iter(found.values())))
    rows = []
    for name, errors in found.items():
        made = trials.get(name)
        label = f"{name}: `{made['inputs']}`, {made['width']} wide, {made['updates']} steps" if made else name
        rows.append([label, *(f"{errors[c]:.1f}" + (" %" if "sign" in c else "") for c in columns)])
    return table(["", *columns], rows)


def _in_play(result: dict) -> str:
    """Returns the table of what either costs and leaves inside."""
    last = json.loads(PROJECTION.read_text().splitlines()[-1])["figures"]
    after = {key: max(shares[key] for shares in result["inside"].values()) for key in ("Eq. 10, neural", "projected")}
    return table(
        ["", "points", "frame [ms]", "inside after it, worst garment [%]"],
        [
            ["Eq. 10", "1000", f"{result['ms']['neural, value and gradient']:.1f}", f"{after['Eq. 10, neural']:.2f}"],
            ["projection", f"{last['vertices']}", f"{last['frame_ms']['median']:.1f}", f"{after['projected']:.2f}"],
        ],
    )


def page(result: dict) -> str:
    """Returns the page in Markdown."""
    inside, deviation = [], []
    for name, shares in result["inside"].items():
        stated, found = PAPER[name], result["deviation"][name]
        theirs = [f"{stated[0]}: {stated[1]:.2f}", f"{stated[3]:.2f}"] if stated else ["", ""]
        keys = (
            "before",
            "Eq. 10, neural",
            "Eq. 10, exact",
            "TailorNet, neural",
            "ReFU, neural",
            "projected",
            "pinched",
        )
        inside.append([name, *(f"{shares[key]:.2f}" for key in keys), *theirs])
        ways = [f"{way}, {kind}" for kind in ("neural", "exact") for way in ("TailorNet", "ReFU", "Eq. 10")]
        theirs = [f"{stated[0]}: {stated[4]:.2f}, {stated[5]:.2f}, {stated[6]:.2f}"] if stated else [""]
        deviation.append([name, *(f"{found[way]:.2f}" for way in ways), *theirs])
    model = result["model"]
    return TEXT.format(
        trials=" TRIALS" if result["trials"] else "",
        commit=result["commit"],
        machine=result["machine"],
        inputs=model["inputs"],
        width=model["width"],
        bodies=model["bodies"],
        points=model["points_a_body"],
        updates=model["updates"],
        value=f"{model['flops'][0]:,}",
        both=f"{model['flops'][1]:,}",
        count=result["bodies"],
        frames=result["frames"],
        known=result["largest_beta"]["known"],
        beyond=result["largest_beta"]["beyond"],
        turned=result["turned_deg"]["known"],
        turned_beyond=result["turned_deg"]["beyond"],
        known_table=_errors(result["known"], result["trials"]),
        beyond_table=_errors(result["beyond"], {}),
        times=table(["", "ms"], [[name, f"{ms:.1f}"] for name, ms in result["ms"].items()]),
        in_play=_in_play(result),
        inside=table(
            ["", "before", "Eq. 10", "Eq. 10, exact distance", "TailorNet", "ReFU", "projected", "pinched"]
            + ["paper: before", "paper: after"],
            inside,
        ),
        deviation=table(
            ["", "TailorNet", "ReFU", "Eq. 10", "TailorNet, exact distance", "ReFU, exact", "Eq. 10, exact"]
            + ["paper: TailorNet, ReFU, Eq. 10"],
            deviation,
        ),
    )


def picture(frames: list[tuple], path: Path) -> None:
    """Draws each garment before correction, after Eq. 10 and after the projection, one row for each."""
    rows = []
    for name, posed, faces, *states in frames:
        shown = [
            pictures.picture_of([(vertices, faces, "cloth"), (posed.vertices, posed.faces, "body")], size=SIZE)
            for vertices in states
        ]
        words = [f"{name}: {state}" for state in ("skinned", "Eq. 10", "projected")]
        rows.append(pictures.side_by_side(shown, words))
    pictures.write_png(path, np.concatenate(rows, axis=0))

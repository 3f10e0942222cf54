"""The page and the picture of `collisions.py`."""

from pathlib import Path

import numpy as np

from hemline import pictures

FOLDER = Path(__file__).parents[2] / "papers" / "swingar" / "pages"
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

Written by `python -m papers.swingar.collisions{trials}` at commit {commit}, on {machine}, one thread.
The paper is Li et al., "SwinGar", 2023: Section III-D, Tables II and III. What is shipped: inputs `{inputs}`, {width}
wide, trained on {bodies} posed bodies with {points} points each, {updates} steps of the optimiser; {value} floating
point operations a point in the layers, {both} with the gradient.

## The distance

Mean error in mm around {count} posed bodies, in poses of subjects that are in no training; betas within ±{known}, as
in the training.
Signs within 1 cm of the skin, and of those farther than 2 mm from it.

{known_table}

The gradient is turned by {turned:.1f} degrees on the mean within 1 cm.

## Bodies beyond the training

The same with betas up to ±{beyond}; the gradient is turned by {turned_beyond:.1f} degrees.

{beyond_table}

## Time

Milliseconds a frame of 1,000 points, least of several turns beside other work; all that depends on the pose is in it
but the skinning of the body.

{times}

## Table II: vertices inside, percent

Light garments on random bodies (betas within ±2), carried by plain skinning in six clips of subjects that are in no
training, {frames} frames each; each frame by itself,
limbs lifted out of each other.
Inside is where the winding number of the posed mesh exceeds 0.5, whatever distance moved the vertices. The paper's
rows are of its own network's predictions: T-shirt, dress, jumpsuit.

{inside}

The projection comes after Eq. 10 with the neural distance; pinched vertices, which have no place outside nearby, are
counted apart.

## Table III: local consistency

Mean of |diag(L) - diag(L^C)| over the vertices moved, half-cotangent weights; smaller is better. TailorNet: all are
moved by a millimetre more than the deepest is inside. ReFU: by one multiple
of their depth, chosen in each frame so that the mean move is that of Eq. 10 (in their paper a network estimates it).

{deviation}

![the frames with most inside](collisions/worst.png)

The frame of each garment with most vertices inside: carried by skinning, after Eq. 10 with the neural distance, after
the projection.
"""


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
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


def page(result: dict) -> str:
    """The page, in Markdown."""
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
    """Garments before, after Eq. 10, after the projection; one row a garment."""
    rows = []
    for name, posed, faces, *states in frames:
        shown = [
            pictures.picture_of([(vertices, faces, "cloth"), (posed.vertices, posed.faces, "body")], size=SIZE)
            for vertices in states
        ]
        words = [f"{name}: {state}" for state in ("skinned", "Eq. 10", "projected")]
        rows.append(pictures.side_by_side(shown, words))
    pictures.write_png(path, np.concatenate(rows, axis=0))

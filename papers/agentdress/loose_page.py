"""The page and the picture of `loose_shapes.py`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hemline import bodies, pictures
from hemline.arrays import Faces, Vertices
from papers.agentdress.loose_takes import Trial

PAGES, SIZE = Path(__file__).parents[2] / "papers" / "agentdress" / "pages", (300, 420)
PAGE = """\
# A loose garment on other shapes

Written by `python -m papers.agentdress.loose_shapes ANCHORS TEST` at commit {commit}, on {machine}. The rope
chains of the shipped skirt, shown at the vertices of `{garment}`, {clips}, {seconds:g} s each, on {count} random bodies
of four betas; beside the light skirt simulated there. AgentDress was fitted to {anchors} anchors of it on {shapes}
shapes. All went through the player: the cloth is held in one piece, and none of it is inside the body.

Ropes of a fit on the mean body can be put on another shape in two ways. *Dressed* (`Garment.dressed`): they swing
there, and the garment at rest is moved as the undraped one would be. *Redressed* (`AnimatorRedressed`): they swing on
the mean body, and AgentDress adds what the shape changes. The simulation on the mean body, in the place of the ropes,
shows the shape's part alone; *as it is*, carried by the pelvis, how large that part is.

| way | error, mm | before the player's own steps | stretch of edges, p99, % | inside before, % |
|---|---|---|---|---|
{ways}

Errors are mean distances of vertices to the simulation on that body. On the mean body ropes miss {nominal}.

## Errors by body, mm
| way | {heads} |
|---|{rule}|
{by_body}

![the worst frame of each way](loose_shapes.png)

The frame of each way that is missed most: simulated (blue), and as played.

## Seen
On bodies near the mean one folds that fall otherwise are most of the error, and all ways are alike. On the large one
(the last) the ropes' garment, dressed, hangs like a tube and is stretched at the hips; redressed it flares as the
simulated one does. Dressing is no better than leaving the garment as it is, but for what is inside the body. What
six anchors add is a little uneven: on the skirt of 18,546 vertices the side over a bent knee crumples. A model of the
light skirt serves for that one, too (`hemline animate skirt --shapes MODEL --betas ...`).
"""

NAMES = ("error_mm", "animated_mm", "stretch_percent", "inside_percent")


def page(row: Mapping[str, Any]) -> str:
    """The text of the page.

    Args:
        row: What `loose_shapes.py` measured.
    """
    rows, bodies_ = row["rows"], row["bodies"]
    names = list(dict.fromkeys(each["way"] for each in rows))
    by_way = {name: [each for each in rows if each["way"] == name] for name in names}
    lines = [
        f"| {name} | " + " | ".join(f"{_mean(each, key):.1f}" for key in NAMES) + " |" for name, each in by_way.items()
    ]
    numbers = range(1, len(bodies_) + 1)
    by_body = [
        f"| {name} | "
        + " | ".join(f"{_mean([e for e in each if e['body'] == number], 'error_mm'):.1f}" for number in numbers)
        + " |"
        for name, each in by_way.items()
    ]
    return PAGE.format(
        **{key: row[key] for key in ("commit", "machine", "garment", "seconds", "anchors", "shapes")},
        clips=" and ".join(f"`{clip}`" for clip in row["clips"]),
        count=len(bodies_),
        ways="\n".join(lines),
        nominal=" and ".join(f"{value:.1f} mm in `{clip}`" for clip, value in row["nominal_mm"].items()),
        heads=" | ".join(", ".join(f"{beta:g}" for beta in betas) for betas in bodies_),
        rule="|".join("---" for _ in bodies_),
        by_body="\n".join(by_body),
    )


def _mean(rows: list[dict[str, Any]], name: str) -> float:
    return float(np.mean([each[name] for each in rows]))


def draw_worst(faces: Faces, shown: Mapping[str, tuple[float, int, Vertices, Trial]]) -> None:
    """The worst frame of each way beside the simulation in it, a row each, into the picture of the page.

    Args:
        faces: Of the garment.
        shown: By way: error [mm], number and vertices [m] of the frame, and which trial it is of.
    """
    rows = []
    for name, (error, index, vertices, trial) in shown.items():
        body = bodies.load("anny24").shaped(trial.truth.betas).posed(trial.truth.motion[index])
        views = [
            pictures.picture_of(
                [(body.vertices, body.faces, "body"), (np.asarray(worn), faces, colour)], view, size=SIZE
            )
            for view in ("three_quarter", "back_three_quarter")
            for worn, colour in ((trial.truth.vertices[index], "truth"), (vertices, "cloth"))
        ]
        caption = f"{name}: {trial.clip}, body {trial.body}, frame {index}, {error:.0f} mm"
        rows.append(pictures.add_caption(pictures.side_by_side(views), caption))
    pictures.write_png(PAGES / "loose_shapes.png", np.concatenate(rows, axis=0))

"""The page and the pictures of `limits.py`."""

from pathlib import Path

import numpy as np

from hemline import pictures
from hemline.arrays import Faces, Vertices
from hemline.bodies import PosedBody
from papers.rope_chains.drawing.figure import axes, keep  # pyright: ignore[reportMissingImports]

PAGES, SIZE = Path(__file__).parents[2] / "papers" / "agentdress" / "pages", (360, 480)
PAGE = """\
# Too loose, too tight

Written by `python -m papers.agentdress.limits {garment} ANCHORS TEST` at commit {commit}, on {machine}, one
thread. Poses of clips of subjects that are in no fit; errors are mean distances of vertices to the simulation. The gap
is the mean distance of the simulated garment's vertices to the closest vertex of the body, the stretch the mean
over its edges of what they are too long.

The paper (section 4.9, Fig. 13): the method may fail where the garment is too loose, as skinning does not carry what
the shape does from pose to pose; where it is too tight, not all penetrations are resolved.

## {garment} on small and large bodies

| body | betas | gap, mm | stretch, % | error, mm | the same, simulation as pose model | inside, % |
|---|---|---|---|---|---|---|
{bodies}

Inside: vertices in the body before the player's projection, which takes them out.

![error against gap](limits/fig13-curve.png)

![the body of Fig. 13](limits/fig13.png)

The body of Fig. 13 in the pose that is missed most, before the player's cover and projection, and the mean body in
the same pose.

## Other garments

What the shape does, carried by skinning from the nearest anchor's pose to another one; all terms of Eq. 3 simulated. On
a body half way to that of Fig. 13. Beside it the rest drape of that body, skinned.

| garment | poses | gap, mm | error, mm | rest drape, skinned, mm |
|---|---|---|---|---|
{garments}
"""


def page(row: dict) -> str:
    """The text of the page.

    Args:
        row: What `limits.py` measured.
    """
    on_bodies = [
        f"| {name} | {', '.join(f'{beta:g}' for beta in each['betas'])} | {each['gap_mm']:.1f} | "
        f"{each['stretch_percent']:.1f} | {each['error_mm']:.1f} | {each['driven_mm']:.1f} | "
        f"{each['inside_percent']:.1f} |"
        for name, each in sorted(row["by_body"].items(), key=lambda item: -item[1]["gap_mm"])
    ]
    of_garments = [
        f"| {name} | {each['poses']} | {each['gap_mm']:.1f} | {each['error_mm']:.1f} | {each['skinned_mm']:.1f} |"
        if each
        else f"| {name} | 0 | | never came to rest | |"
        for name, each in row["by_garment"].items()
    ]
    return PAGE.format(**(row | {"bodies": "\n".join(on_bodies), "garments": "\n".join(of_garments)}))


def draw_curves(row: dict) -> str:
    """Error against gap: bodies, and garments."""
    sheet, ((axis,),) = axes(1, 1, width=5.6, height=3.4)
    for name, each in row["by_body"].items():
        axis.plot(each["gap_mm"], each["error_mm"], "o", color="tab:blue")
        axis.plot(each["gap_mm"], each["driven_mm"], "s", mfc="none", color="tab:blue")
        axis.annotate(name, (each["gap_mm"], each["error_mm"]), fontsize=6, xytext=(4, 3), textcoords="offset points")
    for name, each in row["by_garment"].items():
        if each:
            axis.plot(each["gap_mm"], each["error_mm"], "^", color="tab:orange")
            place = (each["gap_mm"], each["error_mm"])
            axis.annotate(name, place, fontsize=6, xytext=(4, 3), textcoords="offset points")
    shown = {"o": "as played", "s": "simulation as pose model", "^": "other garments, Eq. 3 simulated"}
    for mark, label in shown.items():
        colour = "tab:orange" if mark == "^" else "tab:blue"
        axis.plot([], [], mark, color=colour, mfc="none" if mark == "s" else colour, label=label)
    axis.set(xlabel="gap between garment and body, mm", ylabel="mean vertex error, mm", xlim=(0, None), ylim=(0, None))
    axis.legend(fontsize=7)
    return keep(sheet, PAGES / "limits", "fig13-curve.png")


def draw_worst(
    faces: Faces, plain: PosedBody, mean: Vertices, posed: PosedBody, truth: Vertices, ours: Vertices
) -> str:
    """Fig. 13: the garment on the mean body, on the other one as simulated and as played [m]."""
    views = []
    for body, worn, colour in ((plain, mean, "truth"), (posed, truth, "truth"), (posed, ours, "cloth")):
        views.append(
            pictures.picture_of(
                [(body.vertices, body.faces, "body"), (np.asarray(worn), faces, colour)], "three_quarter", size=SIZE
            )
        )
    captions = ["simulated, mean body", "simulated, betas -2, 2", "as played"]
    (PAGES / "limits").mkdir(parents=True, exist_ok=True)
    pictures.write_png(PAGES / "limits" / "fig13.png", pictures.side_by_side(views, captions))
    return "fig13.png"

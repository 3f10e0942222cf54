"""The page and the picture of `separability.py`."""

from pathlib import Path

ROOT = Path(__file__).parents[2]

from papers.rope_chains.drawing.figure import axes, keep  # noqa: E402

PAGES = ROOT / "papers" / "agentdress" / "pages"
ASKED = 1.5
PAGE = """\
# Pose and shape told apart near an anchor

Written by `python -m papers.agentdress.separability MODEL ANCHORS TEST` at commit {commit}, on {machine},
one thread; {garment}, {anchors} anchors. The appendix of Wu et al. 2021, section 2 and Fig. 1.

![error against distance](separability.png)

From anchor {anchor} on the mean shape random directions are gone in 72 joint angles and four betas at once, so far that
the 76 numbers [rad; standard deviations] have the length r. Errors are mean distances of vertices to the simulation,
mean over directions [mm]. "Theoretical": Eq. 3 with three simulated garments. "Practical": what plays, with all anchors
(Eq. 4, its pose model a kernel regression). "Practical, rigging": sensitivity-optimised rigging as pose model. "The
anchor, skinned": neither pose nor shape added. The last column, r = {near:g}, is the floor of the settling: nothing
changes there but where the cloth happens to come to rest. The slope is the exponent of r over r = 0.5, 0.25, 0.125; in
brackets with the floor's square taken off, "none" where an error is not above the floor.

{tables}

The paper: both errors converge to zero with r, the theoretical one is the smaller (100 directions, a randomly chosen
anchor, curves without numbers). Asked here of the theoretical one: a slope of at least {asked}.

Here: {verdict}{slippery}

Differs: anchor {anchor} is the {tried} in random order, the first whose walked garment finds a balance where it lies.
What an anchor adds to skinning is kept in turned frames of the vertices, one binding for all shapes.
"""


def _table(row: dict, distances: tuple[float, ...]) -> str:
    head = " | ".join(f"r = {r:g}" for r in distances)
    counts = ", ".join(str(row["settled"][r]) for r in distances)
    lines = [
        f"**{row['start'].capitalize()}**; of {row['directions']} directions came to rest, by r: {counts}.",
        "",
        f"| error, mm | {head} | slope |",
        "|---|" + "---|" * (len(distances) + 1),
    ]
    for name, errors in row["error_mm"].items():
        slope = row["slope"][name]
        without = slope["floor_removed"]
        told = "none" if without != without else f"{without:.2f}"
        cells = " | ".join(f"{errors[r]:.3f}" if r in errors else "none settled" for r in distances)
        lines.append(f"| {name} | {cells} | {slope['plain']:.2f} ({told}) |")
    return "\n".join(lines)


def _verdict(row: dict, near: float) -> str:
    error, slope = row["error_mm"]["theoretical"], row["slope"]["theoretical"]
    best = max(slope["plain"], slope["floor_removed"] if slope["floor_removed"] == slope["floor_removed"] else -9.0)
    reached = "reached" if best >= ASKED else "not reached"
    return (
        f"{row['start']}, the theoretical error falls with a slope of {slope['plain']:.2f} to a floor of "
        f"{error[near]:.3f} mm ({ASKED} {reached})"
    )


def write(rows: list[dict], distances: tuple[float, ...], garment: str) -> None:
    """Write page and picture anew; the last distance is the floor's."""
    sheet, (plots,) = axes(1, len(rows), width=4.2, height=3.4)
    for plot, row in zip(plots, rows, strict=True):
        error = row["error_mm"]["theoretical"]
        there = [r for r in distances[:-1] if r in error]
        for name, errors in row["error_mm"].items():
            plot.loglog(there, [errors[r] for r in there], "o-", label=name, ms=3)
        plot.axhline(error[distances[-1]], color="grey", ls=":", label="floor of the settling")
        plot.loglog(there, [error[there[0]] * (r / there[0]) ** 2 for r in there], "k--", lw=0.6, label="r^2")
        plot.set(title=row["start"], xlabel="distance r", ylabel="error, mm")
    plots[0].legend(fontsize=6)
    keep(sheet, PAGES, "separability.png")
    first = rows[0]
    page = PAGE.format(
        tables="\n\n".join(_table(row, distances) for row in rows),
        verdict="; ".join(_verdict(row, distances[-1]) for row in rows) + ".",
        slippery=""
        if len(rows) > 2
        else "\nWithout friction, which holds cloth where it was led, the anchor's garment has no balance.",
        garment=garment,
        near=distances[-1],
        asked=ASKED,
        tried=_ordinal(first["anchors_tried"]),
        **{key: first[key] for key in ("commit", "machine", "anchor", "anchors")},
    )
    (PAGES / "separability.md").write_text(page)


def _ordinal(number: int) -> str:
    return {1: "first", 2: "second", 3: "third"}.get(number, f"{number}th")

"""The page of the errors: tables beside the paper's statements, and Fig. 9 redrawn."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

PAGE = """\
# AgentDress against the simulation: {garment}

Written by `python -m papers.agentdress.errors ANCHORS TEST` at commit {commit}, on {machine},
one thread: {anchors} anchors on 17 shapes, {poses} poses on the mean one, theirs among them, {random_bodies} random
bodies in one of these poses each. Judged on {pairs} poses of clips of people who are in no fit, each on one of 16
random bodies, all 16 betas drawn ({without_rest} more came not to rest). Errors are mean distances of the vertices to
the settled garment, before the projection: mean over the pairs, what nine in ten stay below, and the worst.

## Random bodies
The paper has 150 anchors, 16 bodies with 400 poses each, and says: 10.6 mm with rigging as pose model, the
simulation as pose model below it, and without the first-order module above both (section 4.5 and 4.6, Fig. 9).

| what adds the pose, and the shape | mean | nine in ten | worst |
|---|---|---|---|
{random}

On the {loose_pairs} pairs whose first beta is {loosest:g} or less, where the garment hangs loose:

| | mean | nine in ten | worst |
|---|---|---|---|
{loose}

![Three pairs](errors-{garment}-pairs.png)

The pair that is missed as the median is, one that nine in ten are better than, and the worst. From left to right:
{drawn}.
Vertices farther than 10 mm from the simulation are green (the paper's Figs. 8 and 10). It is what the animator makes:
the player's cover and projection, which take skin out of the cloth, come after it.

## The mean body: pose models alone
| | mean | nine in ten | worst |
|---|---|---|---|
{mean}

{rigging}The truth itself moves by {steadiness_mm} mm, skinning apart, when every joint is turned by one degree: no pose
model can be much nearer.

## Fig. 9: over the number of anchors
![Error over the number of anchors]({picture})

| anchors | {sizes} |
|---|{rule}|
{curves}
"""

RIGGING = """\
Rigging: {rigged} of the anchors have derivatives; its stiffness, {rigging_stiffness:g}, is the one that misses least
({rigging_validation_mm} mm) on every fourth pose that was settled on the mean shape alone, of which it knows nothing.
As `hemline fit --pose-model sor` packs and plays it, it misses {rigging_played_mm} mm on the random bodies.

"""


def write_page(row: dict[str, Any], folder: Path) -> str:
    """Write the page and its picture; returns the text."""
    folder.mkdir(parents=True, exist_ok=True)
    name = f"errors-{row['garment']}"
    by_size = row["by_anchors_mm"]
    lines = {each: [by_size[size].get(each) for size in by_size] for each in by_size[max(by_size)]}
    _draw(list(by_size), lines, folder / f"{name}.png")
    text = PAGE.format(
        **row | {"drawn": "; ".join(row["drawn"])},
        random=_rows(row["random_bodies_mm"]),
        loose=_rows(row["loose_bodies_mm"]),
        mean=_rows(row["mean_body_mm"]),
        rigging=RIGGING.format(**row) if row["rigged"] else "",
        picture=f"{name}.png",
        sizes=" | ".join(str(size) for size in by_size),
        rule="|".join("---" for _ in by_size),
        curves="\n".join(
            f"| {each} | " + " | ".join(f"{value:.1f}" for value in line) + " |" for each, line in lines.items()
        ),
    )
    (folder / f"{name}.md").write_text(text)
    return text


def _rows(summed: dict[str, list[float]]) -> str:
    ordered = sorted(summed.items(), key=lambda each: each[1][0])
    return "\n".join(f"| {name} | " + " | ".join(f"{value:.1f}" for value in each) + " |" for name, each in ordered)


def _draw(sizes: list[int], lines: dict[str, list[float]], path: Path) -> None:
    sheet = Figure(figsize=(6.4, 3.8), layout="constrained")
    plot = sheet.subplots()
    for name, line in lines.items():
        plot.plot(sizes, line, marker="o", label=name)
    plot.set(xlabel="anchors", ylabel="mean error [mm]", ylim=(0, None))
    plot.legend(fontsize=7)
    sheet.savefig(path, dpi=110)

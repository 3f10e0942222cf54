"""The page of `beyond.py`."""

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
MATERIALS = ROOT / "benchmarks" / "results" / "agentdress_materials.jsonl"
PAGE = """\
# Beyond the paper

Written by `python -m papers.agentdress.beyond ANCHORS TEST` at commit {commit}, on {machine}, one thread:
`{garment}`, {anchors} anchors, judged on {pairs} pairs of a random body and a pose of people who are in no fit. Mean
distance of vertices to the simulation. Random bodies, the kernel over pose and shape, bodies compared by the skin under
the garment, and material ship. Sensitivities by shape are not kept, where they are no better.

## On random bodies
| what | error, mm |
|---|---|
{random}

"As it ships" compares two bodies by how far the skin under the garment lies apart (`shape_distance.shape_scale`);
"betas alike" by their sixteen betas, of which some hardly move that skin.

The paper's future work asks for sensitivities as a function of the shape: here a ridge regression of the norms of Eq. 7
on the betas and their squares, and a fit with what that says of each body.

## Pose and shape together
What is missed of the change from the mean shape to the sixteen others at anchors that are left out; width and ridge of
the kernel over both are chosen at every other anchor, and judged at those between.

| what adds the shape | error, mm |
|---|---|
{shapes}

## Material as a third dimension
`python -m papers.agentdress.materials ANCHORS OTHER... --test FOLDER`: the garment of another material, on
the mean body, in poses of other people. A model was fitted to the anchors and to drapes of other materials in some of
their poses; it is asked for materials that it knows, for those with their own drapes left out, and for one of which
nobody made any. In the first columns the garment of the fit, simulated, stands for the pose model, so that what is
missed is the material alone; *as played* has the pose model, too. *Mean change* is the plain baseline: what the
material adds in the mean over its drapes, in every pose.

{materials}
"""


def write_page(row: dict[str, Any]) -> str:
    """Write the page; returns the text."""
    text = PAGE.format(
        **{name: row[name] for name in ("commit", "machine", "garment", "anchors", "pairs")},
        random=_rows(row["random_bodies_mm"]),
        shapes=_rows(row["shape_left_out_mm"]),
        materials=_materials(),
    )
    (ROOT / "papers" / "agentdress" / "pages" / "beyond.md").write_text(text)
    return text


def _rows(errors: dict[str, float]) -> str:
    return "\n".join(f"| {name} | {value:.2f} |" for name, value in errors.items())


def _materials() -> str:
    if not MATERIALS.exists():
        return "Not measured."
    last = {row["to"]: row for row in map(json.loads, MATERIALS.read_text().splitlines())}
    ways = list(dict.fromkeys(way for row in last.values() for way in row["error_mm"]))
    lines = [
        f"| from, to | drapes of it | poses judged | {' | '.join(f'{way}, mm' for way in ways)} | commit |",
        "|---|---|---|" + "---|" * len(ways) + "---|",
    ]
    for row in last.values():
        errors = " | ".join(f"{row['error_mm'][way]:.2f}" if way in row["error_mm"] else "" for way in ways)
        lines.append(f"| {row['from']}, {row['to']} | {row['known']} | {row['judged']} | {errors} | {row['commit']} |")
    return "\n".join(lines)

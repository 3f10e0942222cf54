"""Write docs/swingar/ablations.md: `python benchmarks/claims/swingar/ablations_page.py`, after `ablations.py`."""

import json
from pathlib import Path
from typing import Any

from ablations import HIDDEN, LEARNED
from ablations_graph import FRAMES, GRAPH, PLAIN, TERMS

ROOT = Path(__file__).parents[3]
ROWS = ROOT / "benchmarks" / "results" / "swingar_ablations.jsonl"
PAGE = ROOT / "docs" / "swingar" / "ablations.md"
TABLE_I = {
    "no descriptor": (2.37, 9.02),
    "graph pooling": (2.15, 8.67),
    "Euclidean affinity": (2.24, 8.95),
    PLAIN: (1.90, 7.53),
}
"""The paper's errors: cm, degrees."""
FIG_12 = {"z = 128": "more", PLAIN: "19.0 mm, the least (z = 256)", "z = 512": "more"}
FIG_9 = {
    "alpha = 1": "not said",
    PLAIN: "the least, by little (alpha = 2)",
    "alpha = 3": "like 2",
    "no Lipschitz normalisation": "the most, unstable",
}
"""What the paper says of its plots, which have no numbers in the text."""
GROUP = 100 * FRAMES
"""Frames of an epoch of the graph network."""


def page(rows: list[dict[str, Any]]) -> str:
    """All of it."""
    budget, machine = rows[-1]["budget"], rows[-1]["machine"]
    commits = ", ".join(dict.fromkeys(row["commit"] for row in rows))
    lag, graph = ({row["variant"]: row for row in rows if row["network"] == name} for name in ("lag", "graph"))
    return f"""# What each part of swingar is worth

Written by `python benchmarks/claims/swingar/ablations_page.py`, from what `ablations.py` measured on {machine}, commit
{commits}; the paper is Li et al., "SwinGar", 2023. All rows, of both networks, are of one set of takes: each variant
is trained alike, from nothing, with one seed, on {budget["takes"]} takes of {budget["garments"]} garments, and judged
on {budget["held_out"]} takes of {budget["new"]} other garments, on other random bodies and the mean one, in clips of
other subjects: distance of the proxy's vertices. The budget is small: these are not the errors of what ships, and
differences below a millimetre say nothing. [The takes](../../src/hemline/models/README.md#swingar).
{_lag(lag, budget["lag"]) if lag else ""}{_graph(graph, budget["graph"]) if graph else ""}
Tables II and III of the paper as a whole, with the projection: [collisions](collisions.md). Table V, frames a second:
[figures of the network](../../src/hemline/animators/swingar/README.md#figures), `throughput.py`; the paper's frame
takes 26 ms on a GPU (38.1 a second, 307.8 in batches), of 10,000 vertices.
"""


def _lag(rows: dict[str, dict[str, Any]], epochs: int) -> str:
    shown = [rows[name] for name in (*HIDDEN, *LEARNED) if name in rows]
    lines = "".join(f"| {row['variant']} | {row['error_mm']:.1f} | {row['trained_mm']:.1f} |\n" for row in shown)
    return f"""
## The lag network, {epochs} epochs of {shown[0]["frames"]:,} frames
Skinning softly: {shown[0]["skinned_mm"]:.1f} mm; mean over frames. What the paper has no counterpart for.

| what it is told, and how it learns | held out, mm | learned, mm |
|---|---|---|
{lines}"""


def _graph(rows: dict[str, dict[str, Any]], epochs: int) -> str:
    head = "| variant | mean, mm | normals, degrees | paper, cm | paper, degrees |\n|---|---|---|---|---|\n"
    first = "".join(
        f"| {_name(name)} | {rows[name]['error_mm']:.1f} | {rows[name]['normals_deg']:.1f} | {cm:.2f} | {deg:.2f} |\n"
        for name, (cm, deg) in TABLE_I.items()
        if name in rows
    )
    return f"""
## The graph network, {epochs} epochs of {GROUP} frames
Its coarse predictor with lean sizes, which begins as skinning: {next(iter(rows.values()))["skinned_mm"]:.1f} mm, mean
over garments and bodies. The paper trains for five days on two GPUs, on a set of its own.

### Table I: the descriptor
{head}{first}
### Fig. 12: its size
{_errors(rows, FIG_12)}
### Figs. 8 and 9: Lipschitz normalisation
{_errors(rows, FIG_9)}
### Lag features, which the paper does not have
{_errors(rows, {PLAIN: "", "no lag features": ""})}{_terms(rows, epochs)}
After each epoch, held out, mm: {"; ".join(_curve(rows[name]) for name in GRAPH if name in rows)}.
"""


def _name(name: str) -> str:
    return "the spectral descriptor, alpha 2, z 256, with lag features" if name == PLAIN else name


def _errors(rows: dict[str, dict[str, Any]], said: dict[str, str]) -> str:
    lines = [
        f"| {_name(name)} | {row['error_mm']:.1f} | {row['rmse_mm']:.1f} | {row['p95_mm']:.1f} "
        f"| {row['normals_deg']:.1f} | {words} |\n"
        for name, words in said.items()
        if (row := rows.get(name))
    ]
    head = "| variant | mean, mm | RMSE, mm | p95, mm | normals, degrees | paper's error |\n|---|---|---|---|---|---|\n"
    return head + "".join(lines)


def _terms(rows: dict[str, dict[str, Any]], epochs: int) -> str:
    shown = {name: rows[name] for name in TERMS if name in rows}
    if not shown:
        return ""
    lines = "".join(
        f"| {name} | {row['error_mm']:.1f} | {row['normals_deg']:.1f} | {row['inside_percent']:.2f} "
        f"| {row['handled_percent']:.2f} |\n"
        for name, row in shown.items()
    )
    return f"""
### Table II: the collision loss only
The plain one goes on for {max(1, epochs // 3)} epoch with other terms of the loss. Inside: vertices inside the body, as
the network says and after Eq. 10, without the projection. The paper: collision loss only 0.97 % (T-shirt), 0.61 %
(dress), 1.18 % (jumpsuit); with Eq. 10 0.12, 0.07, 0.15 %.

| loss | mean, mm | normals, degrees | inside, % | inside after Eq. 10, % |
|---|---|---|---|---|
{lines}"""


def _curve(row: dict[str, Any]) -> str:
    return f"{row['variant']} {', '.join(f'{each:.1f}' for each in row['curve_mm'][1:])}"


def main() -> None:
    """Read, write."""
    rows = [json.loads(line) for line in ROWS.read_text().splitlines()]
    newest = [row for row in rows if row["mark"] == rows[-1]["mark"]]
    PAGE.write_text(page(newest))


if __name__ == "__main__":
    main()

"""Write papers/swingar/pages/ablations.md: `python -m papers.swingar.ablations_page`, after `ablations.py`."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

from papers.swingar.ablations import HIDDEN, LEARNED
from papers.swingar.ablations_graph import FRAMES, GRAPH, PLAIN, TERMS

ROOT = Path(__file__).parents[2]
ROWS = ROOT / "benchmarks" / "results" / "swingar_ablations.jsonl"
PAGE = ROOT / "papers" / "swingar" / "pages" / "ablations.md"
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
    """All of it: of each network the rows of the takes that most of them are of."""
    lag, graph = (_most(rows, network) for network in ("lag", "graph"))
    same = lag and graph and lag[0]["mark"] == graph[0]["mark"]
    sets = "Both networks were given one set of takes." if same else "Each network was given a set of its own."
    return f"""# What each part of swingar is worth

Written by `python -m papers.swingar.ablations_page`, from what `ablations.py` measured; the paper is Li et
al., "SwinGar", 2023. Each variant is trained alike, from nothing, with one seed, and judged on takes that it has not
seen: distance of the proxy's vertices. {sets} Budgets are small: these are
not the errors of what ships, and differences below a millimetre say nothing.
[The takes](../../src/hemline/models/README.md#lag).
{_lag(lag) if lag else ""}{_graph(graph, "" if same else _beside(rows, graph[0]["mark"])) if graph else ""}
Tables II and III of the paper as a whole, with the projection: [collisions](collisions.md). Table V, frames a second:
[figures of the network](../../src/hemline/animators/swingar/README.md#figures), `throughput.py`; the paper's frame
takes 26 ms on a GPU (38.1 a second, 307.8 in batches), of 10,000 vertices.
"""


def _most(rows: list[dict[str, Any]], network: str) -> list[dict[str, Any]]:
    own = [row for row in rows if row["network"] == network]
    marks = [row["mark"] for row in own]
    return [row for row in own if row["mark"] == max(reversed(marks), key=marks.count)] if own else []


def _beside(rows: list[dict[str, Any]], mark: str) -> str:
    """The lag network on the takes of the graph network."""
    return "".join(
        f" The lag network on the same takes, {row['budget']['lag']} epochs of {row['frames']:,} frames, "
        f"{row['variant']}: {row['error_mm']:.1f} mm of {row['skinned_mm']:.1f}, mean over frames."
        for row in rows
        if (row["network"], row["mark"]) == ("lag", mark)
    )


def _made(rows: list[dict[str, Any]]) -> str:
    """What they are of."""
    budget, commits = rows[0]["budget"], ", ".join(dict.fromkeys(row["commit"] for row in rows))
    new = f" of {budget['new']} other garments" if "new" in budget else " of other subjects, or other garments"
    of = f" of {budget['garments']} garments" if "garments" in budget else ""
    return (
        f"Learned: {budget['takes']} takes{of}; held out: {budget['held_out']} takes{new}. "
        f"{rows[0]['machine']}, commit {commits}."
    )


def _lag(rows: list[dict[str, Any]]) -> str:
    by_name, epochs = {row["variant"]: row for row in rows}, rows[0]["budget"]["lag"]
    shown = [by_name[name] for name in (*HIDDEN, *LEARNED) if name in by_name]
    lines = "".join(f"| {row['variant']} | {row['error_mm']:.1f} | {row['trained_mm']:.1f} |\n" for row in shown)
    return f"""
## The lag network, {epochs} epochs of {shown[0]["frames"]:,} frames
{_made(rows)} Skinning softly: {shown[0]["skinned_mm"]:.1f} mm, mean over frames. The paper has no counterpart.

| what it is told, and how it learns | held out, mm | learned, mm |
|---|---|---|
{lines}"""


def _graph(found: list[dict[str, Any]], beside: str) -> str:
    rows, epochs = {row["variant"]: row for row in found}, found[0]["budget"]["graph"]
    missing = [name for name in (*GRAPH, *TERMS) if name not in rows]
    left = f"Not measured yet: {', '.join(missing)}." if missing else ""
    head = "| variant | mean, mm | normals, degrees | paper, cm | paper, degrees |\n|---|---|---|---|---|\n"
    first = "".join(
        f"| {_name(name)} | {rows[name]['error_mm']:.1f} | {rows[name]['normals_deg']:.1f} | {cm:.2f} | {deg:.2f} |\n"
        for name, (cm, deg) in TABLE_I.items()
        if name in rows
    )
    return f"""
## The graph network, {epochs} epochs of {GROUP} frames
{_made(found)} Its coarse predictor with lean sizes, which begins as skinning: {found[0]["skinned_mm"]:.1f} mm, mean
over garments and bodies. The paper trains for five days on two GPUs, on a set of its own. {left}{beside}

### Table I: the descriptor
{head}{first}
### Fig. 12: its size
{_errors(rows, FIG_12)}
### Figs. 8 and 9: Lipschitz normalisation
{_errors(rows, FIG_9)}
### Lag features, which the paper does not have
{_errors(rows, {PLAIN: "", "no lag features": ""})}{_terms(rows, epochs)}
One seed: a variant gets worse by up to {_rise(found):.1f} mm from one epoch to the next, so that differences
smaller than that say little. After each epoch, held out, mm:
{"; ".join(_curve(rows[name]) for name in GRAPH if name in rows)}.
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


def _rise(rows: list[dict[str, Any]]) -> float:
    """The largest by which a curve rises from one epoch to the next [mm]."""
    return max(now - before for row in rows for before, now in pairwise(row["curve_mm"]))


def _curve(row: dict[str, Any]) -> str:
    return f"{row['variant']} {', '.join(f'{each:.1f}' for each in row['curve_mm'][1:])}"


def main() -> None:
    """Read, write."""
    PAGE.write_text(page([json.loads(line) for line in ROWS.read_text().splitlines()]))


if __name__ == "__main__":
    main()

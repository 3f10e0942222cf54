"""Write docs/swingar/ablations.md: `python benchmarks/claims/swingar/ablations_page.py`, after `ablations.py`."""

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
ROWS = ROOT / "benchmarks" / "results" / "swingar_ablations.jsonl"
PAGE = ROOT / "docs" / "swingar" / "ablations.md"


def page(rows: list[dict[str, Any]]) -> str:
    """All of it."""
    budget, machine, commit = rows[-1]["budget"], rows[-1]["machine"], rows[-1]["commit"]
    lag, graph = ([row for row in rows if row["network"] == name] for name in ("lag", "graph"))
    return f"""# What each part of swingar is worth

Written by `python benchmarks/claims/swingar/ablations_page.py`, from what `ablations.py` measured on {machine}, commit
{commit}. Each variant is trained alike, from nothing, with one seed, on {budget["takes"]} takes, and judged on
{budget["held_out"]} takes of subjects and garments that are held out: mean distance of the proxy's vertices. The
budget is small: these are not the errors of what ships, and differences below about half a millimetre say nothing.
{_lag(lag, budget["lag"]) if lag else ""}{_graph(graph, budget["graph"]) if graph else ""}"""


def _lag(rows: list[dict[str, Any]], epochs: int) -> str:
    lines = "".join(f"| {row['variant']} | {row['error_mm']:.1f} | {row['trained_mm']:.1f} |\n" for row in rows)
    return f"""
## The lag network, {epochs} epochs
Skinning: {rows[0]["skinned_mm"]:.1f} mm.

| what it is told, and how it learns | held out, mm | learned, mm |
|---|---|---|
{lines}"""


def _graph(rows: list[dict[str, Any]], epochs: int) -> str:
    return f"""
## The graph network, {epochs} epochs of 800 frames
Its coarse predictor with lean sizes, which begins as skinning: {rows[0]["skinned_mm"]:.1f} mm. The paper trains 200
epochs of its whole training set and reports (Table I) that its descriptor is better than pooling, than Euclidean
distances and than none; that z = 256 is best (Fig. 12); that alpha = 2 and 3 are alike and better than 1, and that
without Lipschitz normalisation errors are largest (Fig. 9).

| variant | held out, mm | after each epoch |
|---|---|---|
{"".join(_graph_row(row) for row in rows)}"""


def _graph_row(row: dict[str, Any]) -> str:
    curve = ", ".join(f"{each:.1f}" for each in row["curve_mm"][1:])
    return f"| {row['variant']} | {row['error_mm']:.1f} | {curve} |\n"


def main() -> None:
    """Read, write."""
    rows = [json.loads(line) for line in ROWS.read_text().splitlines()]
    newest = [row for row in rows if row["mark"] == rows[-1]["mark"]]
    PAGE.write_text(page(newest))


if __name__ == "__main__":
    main()

"""Writes papers/swingar/pages/ablations.md: `python -m papers.swingar.ablations_page`, after `ablations.py`."""

import json
from pathlib import Path
from typing import Any

from papers.swingar.ablations import HIDDEN, LEARNED
from papers.swingar.ablations_graph import GRAPH, PLAIN, TERMS

ROOT = Path(__file__).parents[2]
ROWS = ROOT / "benchmarks" / "results" / "swingar_ablations.jsonl"
PAGE = ROOT / "papers" / "swingar" / "pages" / "ablations.md"
TABLE_I = {
    "no descriptor": (2.37, 9.02),
    "graph pooling": (2.15, 8.67),
    "Euclidean affinity": (2.24, 8.95),
    PLAIN: (1.90, 7.53),
}
"""Errors of the paper: distances [cm] and angles of normals [degrees]."""
FIG_12 = {"z = 128": "more", PLAIN: "19.0 mm, the least (z = 256)", "z = 512": "more"}
FIG_9 = {
    "alpha = 1": "not said",
    PLAIN: "the least, by little (alpha = 2)",
    "alpha = 3": "like 2",
    "no Lipschitz normalisation": "the most, unstable",
}
"""Statements of the paper on its plots, which have no numbers in the text."""


def page(rows: list[dict[str, Any]]) -> str:
    """Returns the page, with one section for each set of takes and budget; the largest budget comes first."""
    by_mark: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        if row["network"] == "graph":
            by_mark.setdefault(row["mark"], []).append(row)
    sets = sorted(by_mark.values(), key=lambda each: _shown(each[0]["budget"]), reverse=True)
    return f"""# Ablations of SwinGar and lag

`python -m papers.swingar.ablations_page` writes this page from the results of `ablations.py`. The paper is Li et al.,
"SwinGar", 2023. All variants of a section are trained alike from scratch. Errors are mean distances of the vertices of
proxies on takes that they have not seen ([the takes](notes.md#test-sets)).
{"".join(_graph(each, _beside(rows, each[0]["mark"])) for each in sets if len(each) > 2)}{_lag(_most(rows, "lag"))}
[Collisions](collisions.md) has Tables II and III of the paper, with our projection. [Experiments](experiments.md) has
the speed of a frame on a GPU, of Table V.
"""


def _shown(budget: dict[str, Any]) -> int:
    """Returns the number of frames that each variant was shown, at most."""
    return budget["graph"] * _epoch(budget)


def _epoch(budget: dict[str, Any]) -> int:
    """Returns the number of frames in an epoch of the graph network; early results do not say it."""
    return budget.get("graph_frames", 400)


def _most(rows: list[dict[str, Any]], network: str) -> list[dict[str, Any]]:
    own = [row for row in rows if row["network"] == network]
    marks = [row["mark"] for row in own]
    return [row for row in own if row["mark"] == max(reversed(marks), key=marks.count)] if own else []


def _beside(rows: list[dict[str, Any]], mark: str) -> str:
    """Returns a sentence on the lag network, trained on the takes of the graph network."""
    return "".join(
        f" The lag network on the same takes, {row['budget']['lag']} epochs of {row['frames']:,} frames, "
        f"{row['variant']}: {row['error_mm']:.1f} mm of {row['skinned_mm']:.1f}, mean over frames."
        for row in rows
        if (row["network"], row["mark"]) == ("lag", mark)
    )


def _made(rows: list[dict[str, Any]]) -> str:
    """Returns a sentence on the budget of some rows."""
    budget, commits = rows[0]["budget"], ", ".join(dict.fromkeys(row["commit"] for row in rows))
    new = f" of {budget['new']} other garments" if "new" in budget else " of other subjects, or other garments"
    of = f" of {budget['garments']} garments" if "garments" in budget else ""
    return (
        f"Training: {budget['takes']} takes{of}. Held out: {budget['held_out']} takes{new}. "
        f"{rows[0]['machine']}, commit {commits}."
    )


def _lag(rows: list[dict[str, Any]]) -> str:
    by_name, epochs = {row["variant"]: row for row in rows}, rows[0]["budget"]["lag"]
    shown = [by_name[name] for name in (*HIDDEN, *LEARNED) if name in by_name]
    lines = "".join(f"| {row['variant']} | {row['error_mm']:.1f} | {row['trained_mm']:.1f} |\n" for row in shown)
    return f"""
## The lag network, {epochs} epochs of {shown[0]["frames"]:,} frames
{_made(rows)} Soft skinning has {shown[0]["skinned_mm"]:.1f} mm, averaged over frames. The paper has no counterpart.

| variant | held out, mm | training, mm |
|---|---|---|
{lines}"""


def _graph(found: list[dict[str, Any]], beside: str) -> str:
    budget, rows = found[0]["budget"], {name: _mean(found, name) for name in {row["variant"] for row in found}}
    seeds = len({row.get("seed", 0) for row in found})
    missing = [name for name in (*GRAPH, *TERMS) if name not in rows]
    left = f"Not measured: {', '.join(missing)}." if missing else ""
    head = "| variant | mean, mm | normals, degrees | paper, cm | paper, degrees |\n|---|---|---|---|---|\n"
    first = "".join(
        f"| {_name(name)} | {rows[name]['error_mm']:.1f} | {rows[name]['normals_deg']:.1f} | {cm:.2f} | {deg:.2f} |\n"
        for name, (cm, deg) in TABLE_I.items()
        if name in rows
    )
    chosen = (
        "The best epoch was chosen by other subjects on garments of the training, apart from the takes of the errors."
        if "chosen_mm" in found[0]
        else "The best epoch was chosen by the same takes that the errors are of."
    )
    parts = [
        ("### Table I: the descriptor", head + first),
        ("### Fig. 12: its size", _errors(rows, FIG_12)),
        ("### Figs. 8 and 9: Lipschitz normalisation", _errors(rows, FIG_9)),
        (
            "### Lag features, which the paper does not have",
            _errors(rows, dict.fromkeys((PLAIN, "no features, as printed", "no lag features"), "")),
        ),
        (
            "### Table II: vertices inside the body, % of the network's own output",
            _inside(rows),
        ),
    ]
    body = "\n".join(f"{title}\n{text}" for title, text in parts if text.count("\n") > 3)
    return f"""
## The graph network, {budget["graph"]} epochs of up to {_epoch(budget):,} frames
{_made(found)} These are errors of the coarse predictor with lean sizes, {_seeds(seeds)}. Skinning has
{_mean(found, PLAIN)["skinned_mm"]:.1f} mm, averaged over garments and bodies. {chosen} The paper trains for five days
on two GPUs, on a set of its own. {left}{beside}

{body}{_terms(rows, budget["graph"])}
{_spread(found)}
{_training(rows)}"""


def _seeds(count: int) -> str:
    return "of one seed" if count == 1 else f"means of {count} seeds"


def _inside(rows: dict[str, dict[str, Any]]) -> str:
    """Returns a table of the vertices inside the body, before and after Eq. 10."""
    lines = [
        f"| {_name(name)} | {row['inside_percent']:.2f} | {row['handled_percent']:.2f} |\n"
        for name in GRAPH
        if (row := rows.get(name)) and "chosen_mm" in row
    ]
    return "| variant | before | after Eq. 10, without our projection |\n|---|---|---|\n" + "".join(lines)


def _training(rows: dict[str, dict[str, Any]]) -> str:
    """Returns a table of what training did, for results that say it."""
    lines = "".join(_learned(rows[name]) for name in (*GRAPH, *TERMS) if "chosen_mm" in rows.get(name, {}))
    if not lines:
        return ""
    return f"""
### What training did
How far the vectors of the attention scores moved, relative to their length at the start, and the error on the takes
that the best epoch is chosen by.

| variant | attention moved, % | start, mm | best epoch, mm |
|---|---|---|---|
{lines}"""


def _mean(found: list[dict[str, Any]], name: str) -> dict[str, Any]:
    """Returns the row of a variant, averaged over its seeds."""
    own = [row for row in found if row["variant"] == name]
    numbers = [key for key, value in own[0].items() if isinstance(value, int | float) and key != "seed"]
    mean = {key: sum(row[key] for row in own) / len(own) for key in numbers}
    return (
        own[0]
        | mean
        | {"curve_mm": [sum(each) / len(own) for each in zip(*(row["curve_mm"] for row in own), strict=True)]}
    )


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
The plain network continues for {max(1, epochs // 3)} epoch with other terms of the loss. Vertices inside the body are
counted for the network alone and after Eq. 10, without our projection. In the paper, the collision loss alone leaves
0.97 % of a T-shirt, 0.61 % of a dress and 1.18 % of a jumpsuit inside; with Eq. 10 these are 0.12, 0.07 and 0.15 %.

| loss | mean, mm | normals, degrees | inside, % | inside after Eq. 10, % |
|---|---|---|---|---|
{lines}"""


def _spread(rows: list[dict[str, Any]]) -> str:
    """Returns a sentence on how far seeds are apart."""
    by_name: dict[str, list[float]] = {}
    for row in rows:
        by_name.setdefault(row["variant"], []).append(row["error_mm"])
    apart = [max(each) - min(each) for each in by_name.values() if len(each) > 1]
    if not apart:
        return "With one seed, differences below a millimetre mean nothing."
    return (
        f"Two seeds of a variant differ by {sum(apart) / len(apart):.1f} mm on average and by {max(apart):.1f} mm at "
        "most, so that smaller differences of their means say little."
    )


def _learned(row: dict[str, Any]) -> str:
    """Returns a line of the table of what training did."""
    curve = row["curve_mm"]
    return f"| {row['variant']} | {row['attention_moved_percent']:.0f} | {curve[0]:.1f} | {min(curve):.1f} |\n"


def main() -> None:
    """Reads the rows and writes the page."""
    PAGE.write_text(page([json.loads(line) for line in ROWS.read_text().splitlines()]))


if __name__ == "__main__":
    main()

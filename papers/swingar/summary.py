"""The summary of all experiments on SwinGar: the paper's figures, the goals of this project, and our results."""

import json
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from papers.swingar.unseen_page import mean_of, of_class

ROOT = Path(__file__).parents[2]
PAGE = """\
# Experiments on SwinGar

`python -m papers.swingar.experiments FOLDER --clips CLIPS MESH...` makes the data, runs every experiment and writes
this page; `--page` writes it from earlier results. Each row names the commit of its results, all of them on
{machines}.

Goals are those of this project, not of the paper. The paper's figures are those of its own test set of 15 garments,
with networks that were trained for five days on two GPUs. `swingar` is the paper's network;
[`lag`](../../../src/hemline/animators/lag/README.md) is a smaller one of ours, and
[`live`](../../../src/hemline/animators/live/README.md) a simulation.

| experiment | of | the paper | goal | result | page | commit |
|---|---|---|---|---|---|---|
{rows}
"""
UNSEEN, COLLISIONS, ABLATIONS = "[unseen](unseen.md)", "[collisions](collisions.md)", "[ablations](ablations.md)"
NOTES, FITTED = "[notes](notes.md#the-fits-of-lag)", "[notes](notes.md#the-fit-of-swingar)"
KINDS = {"close-fitting": "20 mm, below skinning", "loose": "45 mm, 40 % below skinning"}
"""Goals for the errors of both classes of garments."""
MODELS = ("swingar", "lag", "live")
"""Shipped models that are evaluated on unseen garments."""
Row = dict[str, Any]


class Line(NamedTuple):
    """A line of the table."""

    row: Row
    """Results, with machine and commit."""
    experiment: str
    of: str
    """Garments or variant."""
    paper: str
    goal: str
    result: str
    page: str


def write_page(results: Path) -> str:
    """Writes papers/swingar/pages/experiments.md.

    Args:
        results: The folder of results.

    Returns:
        The page in Markdown.
    """
    lines, machines = [], set()
    for line in _lines(results):
        machines.add(line.row["machine"])
        lines.append(f"| {' | '.join(line[1:])} | {line.row['commit']} |")
    text = PAGE.format(machines=" or ".join(sorted(machines)), rows="\n".join(lines))
    (ROOT / "papers" / "swingar" / "pages" / "experiments.md").write_text(text)
    return text


def newest(file: Path) -> Row:
    """Returns the last results of an experiment, from a JSON file or from the last line of a file of lines."""
    text = file.read_text()
    return json.loads(text if file.suffix == ".json" else text.splitlines()[-1])


def _lines(results: Path) -> Iterator[Line]:
    ablations = (results / "swingar_ablations.jsonl").read_text().splitlines()
    yield from _unseen_lines(newest(results / "unseen.json"))
    yield from _body_lines(newest(results / "unseen_bodies.json"))
    yield from _spread_lines(newest(results / "swingar_spread.json"))
    laws = [json.loads(line) for line in (results / "swingar_laws.jsonl").read_text().splitlines()]
    for model in MODELS:
        if own := [row for row in laws if row.get("model") == model]:
            yield from _law_lines(own[-1])
    yield from _collision_lines(newest(results / "swingar_collisions.jsonl"))
    yield from _ablation_lines([json.loads(line) for line in ablations])
    yield from _time_lines(newest(results / "lag.jsonl"))
    frames = (results / "swingar_gpu_frames.jsonl").read_text().splitlines()
    yield from _gpu_lines([json.loads(line) for line in frames])


def _unseen_lines(row: Row) -> Iterator[Line]:
    for kind, model in product(KINDS, MODELS):
        rows, goal = of_class(row["rows"], kind), KINDS[kind]
        of = f"{len(rows)} {kind} garments, {sum(each['frames'] for each in rows):,} frames"

        def mean(*keys: str, rows: list[Row] = rows, model: str = model) -> float:
            return mean_of(rows, ("models", model, *keys))

        error, skinned = mean("error_mm"), mean_of(rows, ("carried_mm", "skinned"))
        stretch, name = mean("stretch_p99_percent") / mean("truth_stretch_p99_percent"), f"`{model}`"
        yield Line(row, f"{name}, unseen garments, subjects, bodies: error", of, "19.0 mm", goal, _mm(error), UNSEEN)
        less = f"{100 * (1 - error / skinned):.0f} %"
        yield Line(row, f"{name}: error below that of skinning, {skinned:.1f} mm", of, "", "", less, UNSEEN)
        normals = f"{mean('normal_deg'):.1f} degrees"
        yield Line(row, f"{name}: error of normals", of, "7.53 degrees", "", normals, UNSEEN)
        yield Line(row, f"{name}: jerk of the simulation's", of, "", "1.15", f"{mean('jerk_ratio'):.2f}", UNSEEN)
        yield Line(row, f"{name}: stretch (p99) of the simulation's", of, "", "1.15", f"{stretch:.2f}", UNSEEN)
    for model in MODELS:
        inside = max(each["models"][model]["inside_percent"] for each in row["rows"])
        what = f"`{model}`, vertices inside after projection"
        yield Line(row, what, "worst garment", "", "0 %", f"{inside:.2f} %", UNSEEN)


def _mm(error: float) -> str:
    return f"{error:.1f} mm"


def _body_lines(row: Row) -> Iterator[Line]:
    for each in row["rows"]:
        of, what = each["garment"], "bodies beyond the training"
        for model in MODELS:
            yield Line(row, f"{what}, `{model}`: error", of, "", "", _mm(each["models"][model]["error_mm"]), UNSEEN)
        yield Line(row, f"{what}, skinning: error", of, "", "", _mm(each["carried_mm"]["skinned"]), UNSEEN)


def _spread_lines(row: Row) -> Iterator[Line]:
    for kind in KINDS:
        rows = of_class(row["rows"], kind)
        for change in rows[0]["changed"] if rows else ():
            own, of = [each["changed"][change] for each in rows], f"{kind} garments"
            what = f"distance of the simulation from itself, {change}"
            yield Line(row, what, of, "", "", _mm(np.mean([each["mean_mm"] for each in own])), UNSEEN)
            if "normals_deg" in own[0]:
                angle = f"{np.mean([each['normals_deg'] for each in own]):.1f} degrees"
                yield Line(row, f"{what}: normals", of, "", "", angle, UNSEEN)


def _law_lines(row: Row) -> Iterator[Line]:
    law = f"`{row['model']}`, one pose after opposite histories (Fig. 6)"
    for name, each in row["histories"].items():
        correlation = f"{each['correlation']:.2f}"
        yield Line(row, f"{law}: correlation with the simulation's difference", name, "", "0.5", correlation, NOTES)
        yield Line(row, f"{law}: difference", name, "", "", f"{each['ours_at_once_mm']:.0f} mm", NOTES)
        held = f"{each['ours_held_mm']:.1f} mm"
        yield Line(row, f"{law}: difference after 65 frames at rest", name, "gone", "gone", held, NOTES)
    apart = f"{row['resolutions']['mean_mm']:.1f} mm"
    what = f"`{row['model']}`, distance of two resolutions"
    yield Line(row, what, "T-shirt of 3,150 and 12,414 vertices", "", "5 mm", apart, NOTES)


def _collision_lines(row: Row) -> Iterator[Line]:
    paper = {"tshirt-light": ("0.97 %", "0.12 %"), "dress-light": ("0.61 %", "0.07 %")}
    for name, each in row["inside"].items():
        before, after = paper.get(name, ("", ""))
        what = "skinned garments, vertices inside"
        yield Line(row, f"{what} before correction", name, before, "", f"{each['before']:.1f} %", COLLISIONS)
        handled = f"{each['Eq. 10, neural']:.1f} %"
        yield Line(row, f"{what} after Eq. 10 (Table II)", name, after, "0.05 %", handled, COLLISIONS)
        yield Line(row, f"{what} after projection", name, "", "0 %", f"{each['projected']:.1f} %", COLLISIONS)
    near = f"{row['known']['shipped']['within 1 cm']:.1f} mm"
    yield Line(row, "error of the neural distance", "points within 1 cm of the skin", "", "", near, COLLISIONS)


def _ablation_lines(rows: list[Row]) -> Iterator[Line]:
    paper = {
        "as the paper, with lag features": "19.0 mm",
        "no descriptor": "23.7 mm",
        "graph pooling": "21.5 mm",
        "Euclidean affinity": "22.4 mm",
    }
    for row in rows:
        name, budget = row["variant"], row["budget"]
        if row["network"] == "graph":
            shown = budget["graph"] * budget.get("graph_frames", 400)
            what = f"ablations, {shown:,} frames, seed {row.get('seed', 0)}: error"
            yield Line(row, what, name, paper.get(name, ""), "", _mm(row["error_mm"]), ABLATIONS)


def _time_lines(row: Row) -> Iterator[Line]:
    for name, each in row["figures"].items():
        median, worst = each["animator_ms_median"], each["animator_ms_p95"]
        what = "time of a frame before projection"
        yield Line(row, f"{what}, median", name, "26 ms, GPU", "33 ms", f"{median:.1f} ms", NOTES)
        yield Line(row, f"{what}, p95 with the simulated start", name, "", "", f"{worst:.1f} ms", NOTES)


def _gpu_lines(rows: list[Row]) -> Iterator[Line]:
    paper = {1: "26 ms", 32: "3.2 ms"}
    for row in rows:
        of, batch = f"{row['network']}, {row['vertices']:,} vertices", row["batch"]
        what = "time of a frame on a GPU" if batch == 1 else f"time of a frame on a GPU, {batch} at once"
        published = paper[batch] if row["vertices"] == 10_000 else ""
        yield Line(row, f"{what} (Table V)", of, published, "", f"{row['frame_ms']:.2f} ms", FITTED)

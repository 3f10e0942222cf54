"""The page of all claims about SwinGar: what the paper says, what was asked, what was measured."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from papers.swingar.unseen_page import mean_of, of_class

PAGE = """\
# All claims about SwinGar

Written by `python -m papers.swingar.claims FOLDER --clips CLIPS MESH...`, which makes the data, too, and
runs every command of this page; `--page` writes it from what was measured before. Each row names the commit that it
was measured at; all of them on {machines}. "Asked" is the goal of this project, not of the paper. The paper's figures
are of its own test set of 15 garments, with networks that were trained for five days on two GPUs. Rows that do not
name the graph network, which is the paper's, are of [`lag`](../../src/hemline/animators/lag/README.md), a smaller
network of ours; it was called `swingar` until the graph network had weights of its own.

| what | the paper | asked | measured | page | commit |
|---|---|---|---|---|---|
{rows}

Not measured: a frame on a GPU (asked: 3 ms, 1,500 frames a second in batches; the paper: 26 ms, 307.8); there was none.
"""
UNSEEN, COLLISIONS, ABLATIONS = "[unseen](unseen.md)", "[collisions](collisions.md)", "[ablations](ablations.md)"
NETWORK = "[figures](../../src/hemline/animators/lag/README.md#what-it-reaches)"
Row = dict[str, Any]
Claim = tuple[Row, str, str, str, str, str]


def write_page(results: Path) -> str:
    """Write papers/swingar/pages/claims.md.

    Args:
        results: The folder of what was measured.

    Returns:
        The page.
    """
    lines, machines = [], set()
    for found, what, paper, asked, measured, page in _claims(results):
        machines.add(found["machine"])
        lines.append(f"| {what} | {paper} | {asked} | {measured} | {page} | {found['commit']} |")
    text = PAGE.format(machines=" or ".join(sorted(machines)), rows="\n".join(lines))
    (results.parents[1] / "papers" / "swingar" / "pages" / "claims.md").write_text(text)
    return text


def _claims(results: Path) -> list[Claim]:
    """Row, what, the paper's figure, the goal, ours, the page."""
    ablations = (results / "swingar_ablations.jsonl").read_text().splitlines()
    return [
        *_of_unseen(newest(results / "unseen.json")),
        _of_bodies(newest(results / "unseen_bodies.json")),
        _of_spread(newest(results / "swingar_spread.json")),
        *_of_laws(newest(results / "swingar_laws.jsonl")),
        *_of_collisions(newest(results / "swingar_collisions.jsonl")),
        *_of_ablations([json.loads(line) for line in ablations]),
        *_of_times(newest(results / "lag.jsonl")),
    ]


def newest(file: Path) -> Row:
    """What a command measured last: a file of its own, or the last line of one that grows."""
    text = file.read_text()
    return json.loads(text if file.suffix == ".json" else text.splitlines()[-1])


def _of_unseen(made: Row) -> list[Claim]:
    goals = {"close-fitting": "<= 20 mm and below skinning", "loose": "<= 45 mm and 40 % below skinning"}
    claims: list[Claim] = []
    for kind, goal in goals.items():
        rows = of_class(made["rows"], kind)
        ours, live = (mean_of(rows, ("models", model, "error_mm")) for model in ("lag", "live"))
        skinned = mean_of(rows, ("carried_mm", "skinned"))
        what = (
            f"garments, subjects and bodies apart: {len(rows)} {kind} ones, {sum(row['frames'] for row in rows)} frames"
        )
        below = 100 * (1 - ours / skinned)
        measured = f"{ours:.1f} mm, {below:.0f} % below skinning ({skinned:.1f}); `live` {live:.1f}"
        claims.append((made, what, "19.0 mm, all kinds", goal, measured, UNSEEN))
    rows = made["rows"]

    def seen(key: str, of: list[Row] = rows) -> float:
        return mean_of(of, ("models", "lag", key))

    by_kind = [of_class(rows, kind) for kind in goals]
    angles = "; ".join(f"{seen('normal_deg', each):.1f}" for each in by_kind)
    jerks = "; ".join(f"{seen('jerk_ratio', each):.2f}" for each in by_kind)
    edges = "; ".join(
        f"{seen('stretch_p99_percent', each) / seen('truth_stretch_p99_percent', each):.2f}" for each in by_kind
    )
    inside = max(row["models"]["lag"]["inside_percent"] for row in rows)
    claims += [
        (made, "normals, close-fitting; loose", "7.53 degrees, all kinds", "stated", f"{angles} degrees", UNSEEN),
        (made, "jerk, of the simulation's, close-fitting; loose", "", "<= 1.5", jerks, UNSEEN),
        (made, "p99 of stretch, of the simulation's, close-fitting; loose", "", "<= 1.5", edges, UNSEEN),
        (made, "inside after the projection, not pinched, worst garment", "", "0", f"{inside:.2f} %", UNSEEN),
    ]
    return claims


def _of_bodies(made: Row) -> Claim:
    errors = ", ".join(f"{row['garment']} {row['models']['lag']['error_mm']:.1f}" for row in made["rows"])
    skinned = ", ".join(f"{row['carried_mm']['skinned']:.1f}" for row in made["rows"])
    return (made, "bodies beyond the training", "not shown", "stated", f"{errors} mm; skinned {skinned}", UNSEEN)


def _of_spread(made: Row) -> Claim:
    told = []
    for kind in ("close-fitting", "loose"):
        rows = of_class(made["rows"], kind)
        means = [np.mean([row["changed"][name]["mean_mm"] for row in rows]) for name in rows[0]["changed"]]
        told.append(f"{min(means):.1f} to {max(means):.1f}")
    what = "the simulation from itself, simulated once more, close-fitting; loose"
    return (made, what, "", "stated", "; ".join(told) + " mm", UNSEEN)


def _of_laws(row: Row) -> list[Claim]:
    found = row["histories"]
    names = "; ".join(name.removesuffix("-light") for name in found)
    alike = "; ".join(f"{each['correlation']:.2f}" for each in found.values())
    held = "; ".join(f"{each['ours_held_mm']:.1f}" for each in found.values())
    at_once = "; ".join(f"{each['ours_at_once_mm']:.0f}" for each in found.values())
    known = ", garments of its fit" if any(name.endswith("-light") for name in found) else ""
    what = f"one pose after opposite histories (Fig. 6), {names}{known}"
    return [
        (row, f"{what}: correlation with the simulation's difference", "shown", ">= 0.5", alike, NETWORK),
        (row, f"{what}: difference at once; after 65 frames held", "gone", "gone", f"{at_once}; {held} mm", NETWORK),
        (
            row,
            "the same T-shirt of 3,150 and of 12,414 vertices",
            "shown",
            "<= 5 mm",
            f"{row['resolutions']['mean_mm']:.1f} mm",
            NETWORK,
        ),
    ]


def _of_collisions(row: Row) -> list[Claim]:
    inside = row["inside"]
    names = ", ".join(name.removesuffix("-light") for name in inside)
    stages = ("before", "Eq. 10, neural", "projected")
    before, handled, projected = ("; ".join(f"{each[key]:.1f}" for each in inside.values()) for key in stages)
    near = row["known"]["shipped"]["within 1 cm"]
    what, paper = f"vertices inside, {names}, skinned", "T-shirt, dress, jumpsuit by its network"
    return [
        (row, f"{what}: before", f"0.97; 0.61; 1.18 % ({paper})", "stated", f"{before} %", COLLISIONS),
        (row, f"{what}: after Eq. 10 (Table II)", "0.12; 0.07; 0.15 %", "<= 0.05 %", f"{handled} %", COLLISIONS),
        (row, f"{what}: after the projection, not pinched", "has none", "0", f"{projected} %", COLLISIONS),
        (row, "error of the neural distance within 1 cm of the skin", "", "stated", f"{near:.1f} mm", COLLISIONS),
    ]


def _of_ablations(rows: list[Row]) -> list[Claim]:
    by_name = {row["variant"]: row for row in rows if row["network"] == "graph"}
    full = by_name["as the paper, with lag features"]
    told = ", ".join(f"{name} {row['error_mm']:.1f}" for name, row in by_name.items() if row is not full)
    what = f"parts of the graph network, a small equal budget (skinned {full['skinned_mm']:.1f} mm)"
    paper = "19.0 mm; no descriptor 23.7, pooled 21.5, Euclidean 22.4"
    return [(full, what, paper, "the whole is best", f"{full['error_mm']:.1f} mm; {told}", ABLATIONS)]


def _of_times(row: Row) -> list[Claim]:
    each = row["figures"]
    told = "; ".join(f"{name} {found['animator_ms_median']:.1f}" for name, found in each.items())
    worst = max(found["animator_ms_p95"] for found in each.values())
    what = "a frame before the projection, on a CPU: median; worst p95, the simulated first second in it"
    return [(row, what, "26 ms on a GPU", "<= 33 ms", f"{told}; {worst:.1f} ms", NETWORK)]

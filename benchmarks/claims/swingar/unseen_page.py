"""Write docs/swingar/unseen.md from what `unseen.py` measured: `python benchmarks/claims/swingar/unseen_page.py`."""

import json
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[3]
ROWS = ROOT / "benchmarks" / "results" / "unseen.json"
PAGE = ROOT / "docs" / "swingar" / "unseen.md"
WAYS = ("carried rigidly", "skinned", "skinned softly")
FIGURES = {
    "normal_deg": ("error of normals, degrees (paper: 7.53)", 1),
    "jerk_ratio": ("jerk, of the truth's", 2),
    "stretch_p99_percent": ("stretch p99, %", 1),
    "truth_stretch_p99_percent": ("the truth's, %", 1),
    "inside_before_percent": ("inside before the projection, %", 2),
    "inside_percent": ("inside, not pinched, %", 2),
}
HEAD = """# Garments never seen

Garments, subjects and bodies that no fit has seen: meshes of other people's (GarmentCode, Style3D, MakeHuman), tried
on, and random designs of seeds apart, on random bodies, in clips of other subjects; simulated by
`python -m hemline.models.make.swingar_takes`, judged by `python benchmarks/claims/swingar/unseen.py`, as the player
shows them.
Mean distance of vertices from the simulation in mm. Beside each model the settled garment *carried rigidly* with the
key joint, *skinned* with the weights of the nearest skin, and *skinned softly* as swingar does before it learns. A
garment counts as loose where it lies more than 25 mm from the skin in the mean.

What is asked of this: close-fitting 20 mm and better than skinning; loose 45 mm, 40 % below skinning. The paper reports
19.0 mm and 7.53 degrees on its own test set of 15 garments, with networks trained for five days on two GPUs. The truth
is not unique: loose cloth simulated twice, on meshes of other sizes, differs by 25 to 43 mm.

"""


def main() -> None:
    """Write the page."""
    made = json.loads(ROWS.read_text())
    rows = made["rows"]
    models = list(rows[0]["models"])
    lines = ["| garment | class | from the skin, mm | frames | " + " | ".join((*WAYS, *models)) + " | most like |"]
    lines.append("|---" * (5 + len(WAYS) + len(models)) + "|")
    for row in sorted(rows, key=lambda each: (each["class"], each["garment"])):
        lines.append(_row(row["garment"], row["class"], [row], models, _like(row)))
    for kind in ("close-fitting", "loose"):
        of_kind = [row for row in rows if row["class"] == kind]
        if of_kind:
            lines.append(_row(f"**all {len(of_kind)}**", f"**{kind}**", of_kind, models, ""))
    columns = [(kind, model) for kind in _kinds(rows) for model in models]
    lines += ["", "## What is seen", "", "| | " + " | ".join(f"{kind}, {model}" for kind, model in columns) + " |"]
    lines.append("|---" * (1 + len(columns)) + "|")
    for key, (said, digits) in FIGURES.items():
        cells = [_mean(_of(rows, kind), ("models", model, key)) for kind, model in columns]
        lines.append(f"| {said} | " + " | ".join(f"{each:.{digits}f}" for each in cells) + " |")
    foot = f"\nMeasured on {made['machine']}, {made['threads']} threads, commit {made['commit']}.\n"
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(HEAD + "\n".join(lines) + "\n" + foot)


def _kinds(rows: list[dict]) -> list[str]:
    return [kind for kind in ("close-fitting", "loose") if _of(rows, kind)]


def _of(rows: list[dict], kind: str) -> list[dict]:
    return [row for row in rows if row["class"] == kind]


def _mean(rows: list[dict], keys: tuple[str, ...]) -> float:
    """Of what lies at some keys, each garment weighing as much as it has frames."""
    values = []
    for row in rows:
        value = row
        for key in keys:
            value = value[key]
        values.append(value)
    return float(np.average(values, weights=[row["frames"] for row in rows]))


def _row(name: str, kind: str, rows: list[dict], models: list[str], like: str) -> str:
    errors = [_mean(rows, ("carried_mm", way)) for way in WAYS]
    errors += [_mean(rows, ("models", model, "error_mm")) for model in models]
    cells = [name, kind, f"{_mean(rows, ('gap_mm',)):.0f}", str(sum(row["frames"] for row in rows))]
    return "| " + " | ".join([*cells, *(f"{each:.1f}" for each in errors), like]) + " |"


def _like(row: dict) -> str:
    told = next(iter(row["relatives"].values()), [])
    return ", ".join(f"{name} {far:.1f}" for name, far in told[:2])


if __name__ == "__main__":
    main()

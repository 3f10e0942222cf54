"""Our simulator beside two judges, Blender's cloth and Newton: `python -m benchmarks.judges [SECTION ...]`.

Sections: `laws` (closed forms), `ball` (a square on a ball), `drape` and `run` (the light cape; `--skirt`: the circle
skirt), `sweeps` (Newton with more and more work a frame on the start of that run), `speed` (our simulator and Blender's
cloth by turns). Without a name: all but `speed`, which wants a machine of its own.
Prints tables, writes one JSON line a row to benchmarks/results/judges.jsonl (the lines of the sections that ran are
replaced) and, with `--pictures`, the pictures of docs/ground_truth.md, which says how to make the judges' environments.
"""

import argparse
import json
import time
from pathlib import Path

from benchmarks.judging import drapes, laws, speed
from benchmarks.judging.engines import present
from hemline.bench.machine import commit, machine
from hemline.compiled import threads

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "judges.jsonl"
SECTIONS = {
    "laws": laws.rows,
    "ball": drapes.ball,
    "drape": drapes.drape,
    "run": drapes.run,
    "sweeps": drapes.sweeps,
    "speed": speed.rows,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(SECTIONS))
    parser.add_argument("--skirt", action="store_true", help="the circle skirt in the place of the cape")
    parser.add_argument("--self-contact", type=float, default=0.0, metavar="METRES", help="thickness of cloth on cloth")
    parser.add_argument("--pictures", action="store_true", help="write the pictures of docs/ground_truth.md")
    asked = parser.parse_args()
    if unknown := set(asked.sections) - set(SECTIONS):
        parser.error(f"no section {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    engines = [name for name in ("hemline", "blender", "newton") if present(name)]
    for name in {"blender", "newton"} - set(engines):
        print(f"{name} is left out: its environment is not named, see docs/ground_truth.md")
    folder = ROOT / "docs" / "ground_truth" if asked.pictures else None
    for section in asked.sections or [name for name in SECTIONS if name != "speed"]:
        print(f"\n{section}")
        rows = SECTIONS[section](engines, skirt=asked.skirt, self_thickness=asked.self_contact, pictures=folder)
        record(section, rows, asked.self_contact)


def record(section: str, rows: list[dict], self_thickness: float = 0.0) -> None:
    """Replace a section's lines in the results, those of the same scenes with the same self-contact."""
    stamp = {"machine": machine(), "threads": threads(), "commit": commit(), "date": time.strftime("%Y-%m-%d")}
    replaced = {(section, row["scene"], self_thickness) for row in rows}
    old = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.exists() else []
    kept = [row for row in old if (row["section"], row["scene"], row["self_thickness"]) not in replaced]
    new = [{"section": section} | row | {"self_thickness": self_thickness} | stamp for row in rows]
    RESULTS.write_text("".join(json.dumps(row) + "\n" for row in kept + new))


if __name__ == "__main__":
    main()

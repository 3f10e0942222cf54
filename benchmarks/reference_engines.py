"""Compares the simulator with Blender's cloth and Newton: `python -m benchmarks.reference_engines [SECTION ...]`.

Sections: `laws` (closed forms), `ball` (a square on a ball), `drape` and `run` (the light cape, or with `--skirt` the
circle skirt), `sweeps` (Newton with increasing work per frame on the start of that run), `speed` (hemline and
Blender's cloth in alternation). Without a section all but `speed` are run, which needs an idle machine. Prints tables,
and writes one JSON line per row to benchmarks/results/judges.jsonl, where it replaces the lines of the sections that
ran. `--pictures` writes the pictures of docs/ground_truth.md, which explains how to install the engines.
"""

import argparse
import json
import time
from pathlib import Path

from benchmarks.engines import drapes, laws, speed
from benchmarks.engines.play import is_available
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
    parser.add_argument(
        "sections",
        nargs="*",
        metavar="SECTION",
        help=f"Sections to run: {', '.join(SECTIONS)}. Defaults to all but speed.",
    )
    parser.add_argument("--skirt", action="store_true", help="Use the circle skirt instead of the cape.")
    parser.add_argument("--self-contact", type=float, default=0.0, metavar="METRES", help="Thickness [m]; 0 is off.")
    parser.add_argument("--pictures", action="store_true", help="Write the pictures of docs/ground_truth.md.")
    options = parser.parse_args()
    if unknown := set(options.sections) - set(SECTIONS):
        parser.error(f"no section {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    engines = [name for name in ("hemline", "blender", "newton") if is_available(name)]
    for name in {"blender", "newton"} - set(engines):
        print(f"{name} is skipped: its environment is not set, see docs/ground_truth.md")
    folder = ROOT / "docs" / "ground_truth" if options.pictures else None
    for section in options.sections or [name for name in SECTIONS if name != "speed"]:
        print(f"\n{section}")
        rows = SECTIONS[section](engines, skirt=options.skirt, self_thickness=options.self_contact, pictures=folder)
        record(section, rows, options.self_contact)


def record(section: str, rows: list[dict], self_thickness: float = 0.0) -> None:
    """Replaces the lines of a section in the results, for the same scenes with the same self-contact."""
    stamp = {"machine": machine(), "threads": threads(), "commit": commit(), "date": time.strftime("%Y-%m-%d")}
    replaced = {(section, row["scene"], self_thickness) for row in rows}
    old = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.exists() else []
    others = [row for row in old if (row["section"], row["scene"], row["self_thickness"]) not in replaced]
    new = [{"section": section} | row | {"self_thickness": self_thickness} | stamp for row in rows]
    RESULTS.write_text("".join(json.dumps(row) + "\n" for row in others + new))


if __name__ == "__main__":
    main()

"""Makes a model of each garment of a wardrobe by `hemline make`: `python -m benchmarks.making [NAME ...]`.

The garments are third-party meshes of ../shared/data and garments of the generator, of at least twelve kinds. Each goes
through `hemline.make.make_model` with the same time. One JSON line for each garment is written to
benchmarks/results/making.jsonl, models and reports to out/making. A stopped run continues, and garments with a line of
the same time are not made again. `python -m benchmarks.making_page` writes the page.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from hemline.bench.machine import commit, machine
from hemline.errors import HemlineError
from hemline.make import MakeSettings, Outcome, make_model

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data" / "garments"
RESULTS = ROOT / "benchmarks" / "results" / "making.jsonl"
FOLDER = ROOT / "out" / "making"
LIMIT_MS = 28.0
"""Longest time of a frame [ms]: the default of `make` is 16 ms, and with two garments at once on two cores, one thread
each, frames take about 1.75 times as long as alone."""
WARDROBE = {
    "jacket": ("jacket", "style3d_bsd3/h1_jacket_12k.obj"),
    "sweatshirt": ("sweatshirt", "style3d_bsd3/sweatshirt_12k.obj"),
    "wide-shirt": ("wide shirt", "style3d_bsd3/tshirt_12k.obj"),
    "pleated-skirt": ("skirt", "style3d_bsd3/skirt_12k.obj"),
    "circle-skirt": ("circle skirt", "garmentcode_mit/skirt_circle_mean_all.obj"),
    "straight-skirt": ("skirt", "garmentcode_mit/skirt_2panel_mean_all.obj"),
    "shirt-dress": ("shirt dress", "garmentcode_mit/dress_shirt_mean_all.obj"),
    "dress": ("dress", "garmentcode_mit/dress_mean_all.obj"),
    "long-pants": ("trousers", "garmentcode_mit/pants_long_mean_all.obj"),
    "pants": ("trousers", "garmentcode_mit/pants_mean_female.obj"),
    "longsleeve": ("long-sleeved shirt", "garmentcode_mit/longsleeve_mean_all.obj"),
    "t-shirt": ("T-shirt", "garmentcode_mit/tshirt_mean_all.obj"),
    "fitted-shirt": ("T-shirt", "makehuman_cc0/tshirt06.obj"),
    "crop-top": ("crop top", "makehuman_cc0/f_croptop_sub1.obj"),
    "jeans": ("jeans", "makehuman_cc0/jeans_sub1.obj"),
    "shorts": ("shorts", "makehuman_cc0/f_shorts.obj"),
    "mini-skirt": ("mini skirt", "makehuman_cc0/f_miniskirt_sub1.obj"),
    "long-skirt": ("long skirt", "makehuman_cc0/long_skirt_sub1.obj"),
    "overalls": ("hooded overalls", "makehuman_cc0/hoodie_jeans_onepiece.obj"),
    "cape": ("cape", "cape-light"),
    "gown": ("gown", "dress:100@35"),
    "jumpsuit": ("jumpsuit", "jumpsuit:101@35"),
    "leggings": ("leggings", "close-trousers:102@30"),
    "swimsuit": ("close jumpsuit", "close-jumpsuit:100@30"),
}
"""Kind and garment by name; garments that contain a slash are files of `DATA`."""


def garment_of(name: str) -> str:
    """Returns the garment of a name, as `make_model` takes it."""
    garment = WARDROBE[name][1]
    return str(DATA / garment) if "/" in garment else garment


def row_of(name: str, minutes: float, outcome: Outcome | None, reason: str) -> dict[str, Any]:
    """Returns the line of a garment."""
    row: dict[str, Any] = {"name": name, "kind": WARDROBE[name][0], "minutes": minutes, "reason": reason}
    row |= {"machine": machine(), "commit": commit()}
    if outcome is None:
        return row
    return row | {
        "seconds": round(outcome.seconds, 1),
        "chosen": outcome.chosen.method,
        "faults": list(outcome.faults),
        "trials": [trial.entries() for trial in outcome.trials],
        "truth": outcome.truth.entries(),
    }


def rows(minutes: float) -> dict[str, dict[str, Any]]:
    """Returns the recorded lines of runs of this time by name, in the order of the wardrobe."""
    if not RESULTS.exists():
        return {}
    recorded = [json.loads(line) for line in RESULTS.read_text().splitlines()]
    by_name = {row["name"]: row for row in recorded if row["minutes"] == minutes}
    return {name: by_name[name] for name in WARDROBE if name in by_name}


def model_file(name: str, minutes: float) -> Path:
    """Returns the file of the model of a garment."""
    return FOLDER / f"{name}-{minutes:g}.safetensors"


def main() -> None:
    """Makes the missing models."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="Names of the wardrobe. Defaults to all.")
    parser.add_argument("--minutes", type=float, default=10.0, help="Time for each garment [min].")
    parser.add_argument("--jobs", type=int, default=2, help="Number of processes.")
    options = parser.parse_args()
    settings = MakeSettings(minutes=options.minutes, ms=LIMIT_MS)
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in options.names or WARDROBE:
        if name in rows(options.minutes):
            continue
        outcome, reason = None, ""
        try:
            say = lambda line: print(line, file=sys.stderr)  # noqa: E731
            outcome = make_model(
                garment_of(name), model_file(name, options.minutes), settings, jobs=options.jobs, say=say
            )
        except HemlineError as error:
            reason = str(error)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row_of(name, options.minutes, outcome, reason)) + "\n")


if __name__ == "__main__":
    main()

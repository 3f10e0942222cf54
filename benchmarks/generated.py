"""Settles 65 generated garments, 13 of each kind, on the mean body: `python -m benchmarks.generated`.

Each random design (seeds 0 to 12) is made with edges of 35 mm, settled by the simulator and checked as in `hemline
tryon`. Writes one JSON line per garment to benchmarks/results/generated.jsonl and the settled cloth to out/generated.
Existing lines of equal designs are kept, so a stopped run continues.
"""

import argparse
import json
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.bench.machine import commit, machine
from hemline.errors import HemlineError
from hemline.garments.generate import generate_garment, random_design
from hemline.garments.generate.design import KINDS
from hemline.meshes import crossing_edges, edges
from hemline.pictures.draw import picture_of
from hemline.tryon import fitness

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "generated.jsonl"
CLOTH_FOLDER = ROOT / "out" / "generated"
PAGE = ROOT / "docs" / "generated.webp"
SEEDS, EDGE = range(13), 0.035
TILE, COLUMNS = (150, 230), 13


def rows() -> dict[str, dict]:
    """Returns the last line of each garment."""
    if not RESULTS.exists():
        return {}
    return {row["name"]: row for row in map(json.loads, RESULTS.read_text().splitlines())}


def measure(kinds: list[str]) -> None:
    """Measures the missing designs of some kinds."""
    shaped = bodies.load("anny24").shaped()
    CLOTH_FOLDER.mkdir(parents=True, exist_ok=True)
    for seed in SEEDS:
        for kind in kinds:
            design, name = random_design(kind, seed), f"{kind}-{seed}"
            file = CLOTH_FOLDER / f"{name}.npz"
            if rows().get(name, {}).get("design") == asdict(design) and file.exists():
                continue
            began = time.perf_counter()
            try:
                garment = generate_garment(design, shaped, edge=EDGE, name=name)
                made = time.perf_counter()
                result = fitness(garment, shaped)
            except HemlineError as error:
                row = {"reason": str(error)}
            else:
                ends = garment.vertices[edges(garment.faces)]
                lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) / EDGE
                row = {
                    "vertices": len(garment.vertices),
                    "make_s": round(made - began, 2),
                    "settle_s": round(time.perf_counter() - made, 2),
                    "edge_p1_p50_p99": np.percentile(lengths, [1, 50, 99]).round(2).tolist(),
                    "crossing": len(crossing_edges(garment.vertices, garment.faces)),
                    "reason": result.reason or "",
                    **{key: round(value, 4) for key, value in result.figures.items()},
                }
                settled = result.rest.vertices[0] if result.rest else garment.vertices
                np.savez_compressed(file, vertices=settled, faces=garment.faces)
            line = {"name": name, "design": asdict(design), **row, "machine": machine(), "commit": commit()}
            RESULTS.parent.mkdir(parents=True, exist_ok=True)
            with RESULTS.open("a") as stream:
                stream.write(json.dumps(line) + "\n")
            print(name, row, flush=True)


def table() -> None:
    """Prints one row per kind."""
    print("| kind | settle | vertices | made, median | settled, median; worst | sinks, median; most | why not |")
    print("|---|---|---|---|---|---|---|")
    for kind in KINDS:
        every = [row for name, row in rows().items() if name.startswith(kind)]
        good = [row for row in every if not row["reason"]]
        if not good:
            continue
        count, made, settled, fall = (
            np.array([row[key] for row in good]) for key in ("vertices", "make_s", "settle_s", "fall_mm")
        )
        why = "; ".join(f"{row['name']}: {row['reason']}" for row in every if row["reason"])
        print(
            f"| {kind} | {len(good)} of {len(every)} | {count.min()} to {count.max()} | {np.median(made):.1f} s | "
            f"{np.median(settled):.0f}; {settled.max():.0f} s | {np.median(fall):.0f}; {fall.max():.0f} mm | {why} |"
        )


def sheet() -> None:
    """Draws all garments, one row per kind."""
    from PIL import Image

    shaped = bodies.load("anny24").shaped()
    body = (shaped.vertices, shaped.body.faces, "body")
    tiles = []
    for number, kind in enumerate(KINDS):
        for seed in SEEDS:
            with np.load(CLOTH_FOLDER / f"{kind}-{seed}.npz") as cloth:
                colour = np.array(
                    [[0.75, 0.2, 0.17], [0.2, 0.4, 0.7], [0.2, 0.55, 0.35], [0.85, 0.6, 0.2], [0.5, 0.3, 0.6]]
                )
                mesh = (cloth["vertices"], cloth["faces"], tuple(colour[number].tolist()))
                tiles.append(picture_of([body, mesh], "front" if seed % 3 else "three_quarter", size=TILE))
    lines = [np.concatenate(tiles[start : start + COLUMNS], axis=1) for start in range(0, len(tiles), COLUMNS)]
    Image.fromarray(np.concatenate(lines)).save(PAGE, quality=82)


def main() -> None:
    """Measures the missing garments, or prints or draws the existing ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), choices=KINDS, help="Kinds to make.")
    parser.add_argument("--table", action="store_true", help="Print the results and make nothing.")
    parser.add_argument("--sheet", action="store_true", help="Draw docs/generated.webp and make nothing.")
    options = parser.parse_args()
    if options.table:
        table()
    elif options.sheet:
        sheet()
    else:
        measure(options.kinds)


if __name__ == "__main__":
    main()

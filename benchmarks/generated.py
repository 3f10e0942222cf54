"""65 generated garments, 13 of each kind, settled on the mean body: `python -m benchmarks.generated`.

Each random design (seeds 0 to 12) is made with edges of 35 mm, settled by the simulator and judged as `hemline tryon`
judges. One JSON line a garment goes to benchmarks/results/generated.jsonl, the settled cloth to out/generated. Lines
of the same design are not made again, so a run that was stopped goes on. `--kinds` limits the kinds, `--table` prints
what is there, `--sheet` draws docs/generated.webp from it.
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
KEPT = ROOT / "out" / "generated"
PAGE = ROOT / "docs" / "generated.webp"
SEEDS, EDGE = range(13), 0.035
TILE, COLUMNS = (150, 230), 13


def rows() -> dict[str, dict]:
    """The last line of each garment."""
    if not RESULTS.exists():
        return {}
    return {row["name"]: row for row in map(json.loads, RESULTS.read_text().splitlines())}


def work(kinds: list[str]) -> None:
    """Seed by seed, kind by kind."""
    shaped = bodies.load("anny24").shaped()
    KEPT.mkdir(parents=True, exist_ok=True)
    for seed in SEEDS:
        for kind in kinds:
            design, name = random_design(kind, seed), f"{kind}-{seed}"
            kept = KEPT / f"{name}.npz"
            if rows().get(name, {}).get("design") == asdict(design) and kept.exists():
                continue
            began = time.perf_counter()
            try:
                garment = generate_garment(design, shaped, edge=EDGE, name=name)
                made = time.perf_counter()
                found = fitness(garment, shaped)
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
                    "reason": found.reason or "",
                    **{key: round(value, 4) for key, value in found.figures.items()},
                }
                settled = found.rest.vertices[0] if found.rest else garment.vertices
                np.savez_compressed(kept, vertices=settled, faces=garment.faces)
            line = {"name": name, "design": asdict(design), **row, "machine": machine(), "commit": commit()}
            RESULTS.parent.mkdir(parents=True, exist_ok=True)
            with RESULTS.open("a") as stream:
                stream.write(json.dumps(line) + "\n")
            print(name, row, flush=True)


def table() -> None:
    """One row a kind."""
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
    """All of them in rows, a kind each."""
    from PIL import Image

    shaped = bodies.load("anny24").shaped()
    body = (shaped.vertices, shaped.body.faces, "body")
    tiles = []
    for number, kind in enumerate(KINDS):
        for seed in SEEDS:
            with np.load(KEPT / f"{kind}-{seed}.npz") as cloth:
                colour = np.array(
                    [[0.75, 0.2, 0.17], [0.2, 0.4, 0.7], [0.2, 0.55, 0.35], [0.85, 0.6, 0.2], [0.5, 0.3, 0.6]]
                )
                mesh = (cloth["vertices"], cloth["faces"], tuple(colour[number].tolist()))
                tiles.append(picture_of([body, mesh], "front" if seed % 3 else "three_quarter", size=TILE))
    lines = [np.concatenate(tiles[start : start + COLUMNS], axis=1) for start in range(0, len(tiles), COLUMNS)]
    Image.fromarray(np.concatenate(lines)).save(PAGE, quality=82)


def main() -> None:
    """Make what is missing, or show what is there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), choices=KINDS)
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--sheet", action="store_true")
    arguments = parser.parse_args()
    if arguments.table:
        table()
    elif arguments.sheet:
        sheet()
    else:
        work(arguments.kinds)


if __name__ == "__main__":
    main()

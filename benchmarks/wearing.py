"""Tries on every garment mesh of ../shared/data on the mean body and on random shapes: `python -m benchmarks.wearing`.

Meshes are tried on (`hemline.tryon`), `.mhclo` clothes are read by their bindings; then each is dressed on eight
random shapes (betas of one standard deviation). Writes one JSON line per mesh and shape to
benchmarks/results/wearing.jsonl and pictures to docs/wardrobe/. Existing lines are kept, so a stopped run continues; a
garment on the mean body is made again if it is missing in out/wearing.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from hemline import bodies, garments, pictures
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.errors import HemlineError
from hemline.garments import Garment
from hemline.tryon import Fitness, fitness, try_on

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data" / "garments"
RESULTS = ROOT / "benchmarks" / "results" / "wearing.jsonl"
GARMENTS_FOLDER = ROOT / "out" / "wearing"
SHAPES, SEED = 8, 5
TILE = (240, 320)


def meshes() -> list[Path]:
    """Returns all garment files, small ones first, without the base mesh and meshes that belong to a `.mhclo` file."""
    bound = sorted(DATA.glob("*/mhclo/*.mhclo"))
    loose = sorted(path for path in DATA.glob("*/*.obj"))
    return sorted([*loose, *bound], key=lambda path: path.with_suffix(".obj").stat().st_size)


def shapes(body) -> list[ShapedBody]:
    """Returns the mean shape and random ones."""
    generator = np.random.default_rng(SEED)
    return [body.shaped(), *(body.shaped(generator.normal(size=16).astype(np.float32)) for _ in range(SHAPES))]


def try_on_mean(path: Path, shaped: ShapedBody) -> tuple[Garment, Fitness, dict]:
    """Tries a garment on; returns it with its fitness and details of the alignment."""
    tried = try_on(path, shaped)
    more = {}
    if tried.alignment and tried.growth:
        more = {
            "scale": round(tried.alignment.scale, 3),
            "girth": tried.growth.girth,
            "crossed": [tried.growth.crossed_before, tried.growth.crossed_after],
        }
    return tried.garment, tried.fitness, more


def recorded_rows() -> dict[tuple[str, int], dict]:
    """Returns the recorded lines by mesh and shape."""
    if not RESULTS.exists():
        return {}
    rows = [json.loads(line) for line in RESULTS.read_text().splitlines()]
    return {(row["mesh"], row["shape"]): row for row in rows}


def measure(paths: list[Path], count: int) -> None:
    """Measures the missing pairs of mesh and shape."""
    every = shapes(bodies.load("anny24"))
    GARMENTS_FOLDER.mkdir(parents=True, exist_ok=True)
    for number, shaped in enumerate(every[: count + 1]):
        for path in paths:
            name, kept = (
                path.relative_to(DATA).as_posix(),
                GARMENTS_FOLDER / f"{path.parent.name}-{path.name}.safetensors",
            )
            known = recorded_rows()
            done = (name, number) in known and (number or kept.exists())
            if done or (number and known.get((name, 0), {}).get("reason", "")):
                continue
            began, more = time.perf_counter(), {}
            try:
                if number == 0:
                    garment, found, more = try_on_mean(path, shaped)
                    garment.save(kept)
                else:
                    garment = garments.read(path, shaped) if path.suffix == ".mhclo" else Garment.load(kept)
                    found = fitness(garment, shaped)
            except HemlineError as error:
                garment, found = None, Fitness(str(error), {}, None)
            row = {
                "mesh": name,
                "shape": number,
                "vertices": len(garment.vertices) if garment else None,
                "reason": found.reason,
                "figures": {key: round(value, 4) for key, value in found.figures.items()},
                **more,
                "seconds": round(time.perf_counter() - began, 1),
                "machine": machine(),
                "commit": commit(),
            }
            with RESULTS.open("a") as stream:
                stream.write(json.dumps(row) + "\n")
            print(f"{name:<50} shape {number}  {row['seconds']:>6} s  {found.reason or 'worn'}", flush=True)
            if garment is not None and found.rest is not None:
                drawn = [(shaped.vertices, shaped.body.faces, "body"), (found.rest.vertices[0], garment.faces, "cloth")]
                pictures.write_png(GARMENTS_FOLDER / f"{kept.stem}-{number}.png", pictures.picture_of(drawn, size=TILE))


def table(paths: list[Path]) -> None:
    """Prints one line per mesh: whether it can be worn, on the mean and on the other shapes."""
    known = recorded_rows()
    print("| mesh | vertices | mean body | strain p50, p99 % | other shapes |\n|---|---|---|---|---|")
    for path in sorted(paths):
        name = path.relative_to(DATA).as_posix()
        if (name, 0) not in known:
            continue
        row = known[name, 0]
        others = [known[name, number] for number in range(1, SHAPES + 1) if (name, number) in known]
        good = sum(other["reason"] is None for other in others)
        strain = [100 * row["figures"].get(f"edge_strain_{which}", float("nan")) for which in ("p50", "p99")]
        count = f"{good} of {len(others)}" if others else "-"
        print(
            f"| {name} | {row['vertices']} | {row['reason'] or 'worn'} | {strain[0]:.1f}, {strain[1]:.0f} | {count} |"
        )
    mean = [row for (_, number), row in known.items() if number == 0]
    others = [row for (_, number), row in known.items() if number]
    for title, rows in (("the mean body", mean), ("other shapes", others)):
        good = sum(row["reason"] is None for row in rows)
        print(f"\nworn on {title}: {good} of {len(rows)} ({100 * good / max(len(rows), 1):.0f} %)")


def sheet(paths: list[Path]) -> None:
    """Draws all pictures of the mean body on one sheet."""
    from PIL import Image

    tiles, captions = [], []
    for path in sorted(paths):
        file = GARMENTS_FOLDER / f"{path.parent.name}-{path.name}-0.png"
        if file.exists():
            tiles.append(np.asarray(Image.open(file)))
            captions.append(path.name)
    rows = [pictures.side_by_side(tiles[at : at + 8], captions[at : at + 8]) for at in range(0, len(tiles), 8)]
    wide = max(row.shape[1] for row in rows)
    rows = [np.pad(row, ((0, 0), (0, wide - row.shape[1]), (0, 0)), constant_values=255) for row in rows]
    (ROOT / "docs" / "wardrobe").mkdir(exist_ok=True)
    pictures.write_png(ROOT / "docs" / "wardrobe" / "worn.png", np.concatenate(rows))


def main() -> None:
    """Parse, work, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="Names of mesh files. Defaults to all.")
    parser.add_argument("--shapes", type=int, default=SHAPES, help="Number of random shapes.")
    parser.add_argument("--largest", type=float, default=np.inf, help="Maximum size of a mesh file [MB].")
    parser.add_argument("--table", action="store_true", help="Print the results and measure nothing.")
    options = parser.parse_args()
    paths = [path for path in meshes() if not options.names or path.name in options.names]
    paths = [path for path in paths if path.with_suffix(".obj").stat().st_size < 1e6 * options.largest]
    if not options.table:
        measure(paths, options.shapes)
        sheet(paths)
    table(paths)


if __name__ == "__main__":
    main()

"""Compares two checkouts bit for bit, or their speed: `python -m benchmarks.same BEFORE [AFTER]`.

BEFORE and AFTER are checkouts of this repository (`git worktree add ../before REVISION`). Each case is a few commands
of the command line or a script of `SCRIPTS`, run by both. A case is equal if both write equal arrays, under any names.
Scripts must run in checkouts of before and after a renaming: they use the public API, and `first_of` where it changed.
`--speed N` instead times benchmarks in alternation, N times each, and prints medians and the median of the ratios
AFTER / BEFORE.
"""

import argparse
import hashlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

HERE = Path(__file__).parents[1]

CASES: dict[str, list[list[str]]] = {
    "take, cape in gusts": [
        [
            "simulate",
            "cape-light",
            "-m",
            "run",
            "-o",
            "cape",
            "--seconds",
            "0.6",
            "--wind",
            "2",
            "0",
            "0",
            "--gusts",
            "1",
        ]
    ],
    "take, skirt in a kick": [["simulate", "skirt-light", "-m", "kick", "-o", "skirt", "--seconds", "0.6"]],
    "take, trousers in a dance": [["simulate", "trousers-light", "-m", "dance", "-o", "trousers", "--seconds", "0.4"]],
    "take, T-shirt under a cape": [
        ["simulate", "tshirt-light", "--over", "cape-light", "-m", "walk", "-o", "two", "--seconds", "0.2"]
    ],
    "settled on two shapes": [["drape", "tshirt-light", "-o", "rests", "--random", "2"]],
    "settled on a shape, derivatives": [["-c", "settle"], ["-c", "motion"]],
    "tried on": [["-c", "mesh"], ["tryon", "shirt.obj", "-o", "worn.safetensors"]],
    "fit": [
        [
            "simulate",
            "cape-light",
            "-m",
            "run",
            "walk",
            "jump",
            "turn",
            "-o",
            "data",
            "--seconds",
            "0.7",
            "--jobs",
            "2",
        ],
        [
            "fit",
            "data",
            "-o",
            "model.safetensors",
            "--components",
            "20",
            "--shape-components",
            "10",
            "--hidden",
            "32",
            "--epochs",
            "4",
        ],
    ],
    "played": [
        ["animate", "cape", "-m", "kick", "-o", "kick.npz"],
        ["animate", "cape", "-m", "run", "-o", "run.npz", "--fps", "60", "--betas", "1", "-1"],
    ],
    "evaluated": [["evaluate", "cape", "-m", "turn", "--json"]],
}

PRELUDE = '''
def first_of(thing, *names):
    """Returns the first attribute that exists, as a name may differ between the checkouts."""
    return next(getattr(thing, name) for name in names if hasattr(thing, name))
'''
"""Code before each script."""

SCRIPTS = {
    "settle": """
import numpy as np
from hemline import bodies, garments, sim
garment = garments.load("cape-light")
body = bodies.load(garment.body_name).shaped([0.0, 0.3])
rest = sim.settle(garment, body)
derivatives = sim.Sensitivities(rest)
turn = derivatives.turn("left_elbow", [0, 0, 1.0])
np.savez("settled.npz", x=rest.vertices, turn=turn, beta=derivatives.beta(0))
""",
    "motion": """
import numpy as np
from hemline import bodies, motions
body = bodies.load("anny24").shaped([0.5])
untangle = first_of(body, "untangle_motion", "untangled_motion")
walk = untangle(body.placed(motions.load("walk")))
np.savez("motion.npz", rotations=walk.rotations, vertices=body.posed(walk[10]).vertices)
""",
    "mesh": """
import numpy as np
from hemline import garments
garment = garments.load("tshirt-light")
points = 100 * garment.vertices[:, [0, 2, 1]] * [1, -1, 1] + [300, 20, 10]
with open("shirt.obj", "w") as out:
    out.writelines("v %.6f %.6f %.6f\\n" % tuple(p) for p in points)
    out.writelines("f %d %d %d\\n" % tuple(f + 1) for f in garment.faces)
""",
}

SPEED = ("sim-4k", "sim-12k-self", "settle", "cape")


def run(checkout: Path, words: list[str], folder: Path) -> str:
    """Runs a command with the code of a checkout in a folder, and returns what it printed."""
    command = [sys.executable, "-m", "hemline", *words]
    if words[0] == "-c":
        command = [sys.executable, "-c", PRELUDE + SCRIPTS[words[1]]]
    environment = os.environ | {"PYTHONPATH": str(checkout / "src")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    # a command ends with 1 where a figure falls short, a script only with an exception
    if done.returncode not in ((0,) if words[0] == "-c" else (0, 1)):
        raise SystemExit(f"{checkout}: {' '.join(words)}\n{done.stderr[-2000:]}")
    return done.stdout


def hashes(checkout: Path, commands: list[list[str]]) -> dict[str, str]:
    """Returns the hash of each array that commands wrote, and of the figures that they printed, without times."""
    with tempfile.TemporaryDirectory() as name:
        folder, arrays = Path(name), {}
        for words in commands:
            printed = run(checkout, words, folder)
            if "--json" in words:
                figures = json.loads(printed)
                arrays["figures"] = np.frombuffer(json.dumps(_timeless(figures), sort_keys=True).encode(), np.uint8)
        for file in sorted([*folder.rglob("*.safetensors"), *folder.rglob("*.npz")]):
            content = load_file(file) if file.suffix == ".safetensors" else dict(np.load(file))
            label = file.name if len(file.stem) < 20 else file.stem[:8]
            arrays |= {f"{label}:{key}": value for key, value in content.items()}
    if not arrays:
        raise SystemExit(f"{checkout}: {commands} wrote no arrays to compare")
    return {key: hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest() for key, value in arrays.items()}


def _timeless(figures: dict) -> dict:
    return {
        key: value for key, value in figures.items() if key in ("inside_percent", "deepest_mm", "edge_strain", "frames")
    }


def compare(before: Path, after: Path, wanted: list[str], keep: Path | None) -> list[dict]:
    rows = []
    cache = json.loads(keep.read_text()) if keep is not None and keep.exists() else {}
    for name, commands in CASES.items():
        if wanted and name not in wanted:
            continue
        key = f"{revision(before)} {json.dumps(commands)}"
        old = cache.get(key) or hashes(before, commands)
        cache[key] = old
        if keep is not None:
            keep.write_text(json.dumps(cache))
        new = hashes(after, commands)
        other = [label for label, value in old.items() if value not in new.values()]
        same = sorted(new.values()) == sorted(old.values())
        rows.append({"case": name, "arrays": len(old), "other": other, "same": same})
        print(f"{name:<32} {len(old):>4} arrays  {'the same bits' if same else 'OTHER: ' + ' '.join(other[:6])}")
        sys.stdout.flush()
    return rows


def race(before: Path, after: Path, rounds: int, names: list[str]) -> list[dict]:
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for bench in names or SPEED:
            times: dict[Path, list[float]] = {before: [], after: []}
            for each in (before, after):
                run(each, ["bench", bench, "--json"], Path(name))  # compiles
            for turn in range(rounds):
                for each in (before, after) if turn % 2 == 0 else (after, before):
                    times[each].append(_median_ms(json.loads(run(each, ["bench", bench, "--json"], Path(name)))))
            ratios = [new / old for old, new in zip(times[before], times[after], strict=True)]
            row = {
                "bench": bench,
                "before_ms": statistics.median(times[before]),
                "after_ms": statistics.median(times[after]),
                "ratio": statistics.median(ratios),
                "ratios": [round(ratio, 3) for ratio in ratios],
            }
            rows.append(row)
            print(
                f"{bench:<14} {row['before_ms']:8.2f} -> {row['after_ms']:8.2f} ms  ratio {row['ratio']:.3f}  "
                f"({min(ratios):.3f} to {max(ratios):.3f}, {rounds} rounds)"
            )
            sys.stdout.flush()
    return rows


def _median_ms(row: dict) -> float:
    figures = row["figures"]
    times = figures.get("frame_ms", figures)
    return float(times.get("median") or next(value for key, value in times.items() if key.endswith(("_ms", "seconds"))))


def revision(checkout: Path) -> str:
    command = ["git", "-C", str(checkout), "rev-parse", "--short", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("before", type=Path, help="Checkout to compare with.")
    parser.add_argument("after", type=Path, nargs="?", default=HERE, help="Checkout to check. Defaults to this one.")
    parser.add_argument("--case", action="append", default=[], help="Case to run; may be repeated. Defaults to all.")
    parser.add_argument("--keep", type=Path, help="File that caches the hashes of BEFORE.")
    parser.add_argument("--speed", type=int, default=0, metavar="N", help="Time benchmarks in N rounds.")
    parser.add_argument("--bench", action="append", default=[], help="Benchmark to time; may be repeated.")
    parser.add_argument("--record", action="store_true", help="Add a line to benchmarks/results/same.jsonl.")
    options = parser.parse_args()
    before, after = options.before.resolve(), options.after.resolve()
    print(f"{revision(before)} against {revision(after)}")
    rows = (
        race(before, after, options.speed, options.bench)
        if options.speed
        else compare(before, after, options.case, options.keep)
    )
    if options.record:
        from hemline.bench.machine import machine

        row = {
            "before": revision(before),
            "after": revision(after),
            "machine": machine(),
            "rows": rows,
            "date": time.strftime("%Y-%m-%d"),
        }
        with (HERE / "benchmarks/results/same.jsonl").open("a") as out:
            out.write(json.dumps(row) + "\n")
    return 0 if all(row.get("same", True) for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())

"""Whether two checkouts make the same bits, and how fast: `python -m benchmarks.same BEFORE [AFTER]`.

BEFORE and AFTER are checkouts of this repository (`git worktree add ../before REVISION`); AFTER is this one unless
given. Each case is a command of the command line or a few lines of the public API, run by both. A case is the same if
both write the same arrays, under whatever names. `--keep FILE` keeps what BEFORE made, so that it is made once.
`--speed N` times benchmarks instead, by turns, N times each, and prints medians and the median of the ratios
AFTER / BEFORE. One JSON line goes to benchmarks/results/same.jsonl with `--record`.
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
    "settled in a pose, derivatives": [["-c", "settle"]],
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

CODE = {
    "settle": """
import numpy as np
from hemline import bodies, garments, motions, sim
garment = garments.load("tshirt-light")
body = bodies.load(garment.body_name).shaped([0.5])
walk = body.untangled_motion(body.placed(motions.load("walk")))
rest = sim.settle(garment, body, walk[10])
made = sim.Sensitivities(rest)
np.savez("settled.npz", x=rest.vertices, turn=made.turn("left_elbow", [0, 0, 1.0]), beta=made.beta(0))
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
    """One command of a checkout in a folder; what it printed."""
    command = [sys.executable, "-m", "hemline", *words]
    if words[0] == "-c":
        command = [sys.executable, "-c", CODE[words[1]]]
    environment = os.environ | {"PYTHONPATH": str(checkout / "src")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{checkout}: {' '.join(words)}\n{done.stderr[-2000:]}")
    return done.stdout


def made_by(checkout: Path, commands: list[list[str]]) -> dict[str, str]:
    """Hash of each array that the commands wrote, and of the figures that they printed, times left out."""
    with tempfile.TemporaryDirectory() as name:
        folder, arrays = Path(name), {}
        for words in commands:
            printed = run(checkout, words, folder)
            if "--json" in words:
                figures = json.loads(printed)
                arrays["figures"] = np.frombuffer(json.dumps(_timeless(figures), sort_keys=True).encode(), np.uint8)
        for file in sorted([*folder.rglob("*.safetensors"), *folder.rglob("*.npz")]):
            held = load_file(file) if file.suffix == ".safetensors" else dict(np.load(file))
            label = file.name if len(file.stem) < 20 else file.stem[:8]
            arrays |= {f"{label}:{key}": value for key, value in held.items()}
    return {key: hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest() for key, value in arrays.items()}


def _timeless(figures: dict) -> dict:
    return {
        key: value for key, value in figures.items() if key in ("inside_percent", "deepest_mm", "edge_strain", "frames")
    }


def compare(before: Path, after: Path, wanted: list[str], keep: Path | None) -> list[dict]:
    rows = []
    known = json.loads(keep.read_text()) if keep is not None and keep.exists() else {}
    for name, commands in CASES.items():
        if wanted and name not in wanted:
            continue
        key = f"{revision(before)} {json.dumps(commands)}"
        old = known.get(key) or made_by(before, commands)
        known[key] = old
        if keep is not None:
            keep.write_text(json.dumps(known))
        new = made_by(after, commands)
        made, left = sorted(new.values()), sorted(old.values())
        other = [label for label, value in old.items() if value not in made]
        same = made == left
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
    found = figures.get("frame_ms", figures)
    return float(found.get("median") or next(value for key, value in found.items() if key.endswith(("_ms", "seconds"))))


def revision(checkout: Path) -> str:
    asked = ["git", "-C", str(checkout), "rev-parse", "--short", "HEAD"]
    return subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path, nargs="?", default=HERE)
    parser.add_argument("--case", action="append", default=[])
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--speed", type=int, default=0, metavar="N")
    parser.add_argument("--bench", action="append", default=[])
    parser.add_argument("--record", action="store_true")
    asked = parser.parse_args()
    before, after = asked.before.resolve(), asked.after.resolve()
    print(f"{revision(before)} against {revision(after)}")
    rows = (
        race(before, after, asked.speed, asked.bench) if asked.speed else compare(before, after, asked.case, asked.keep)
    )
    if asked.record:
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

"""Times the first frame of shipped models in new processes with an empty cache: `python -m benchmarks.first_frame`.

Each model is loaded and plays one frame, with the packs of `hemline-kernels` and without them, in a process of its own.
The time is that of the whole process, start of Python included. Writes one JSON line to
benchmarks/results/first_frame.jsonl.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from hemline.bench.machine import commit, machine

RESULTS = Path(__file__).parent / "results" / "first_frame.jsonl"
MODELS = ("cape", "skirt", "tshirt-light")
PLAY = (
    "import sys, hemline; body = hemline.bodies.load('anny24').shaped(); "
    "next(iter(hemline.play(hemline.load(sys.argv[1]), body, hemline.motions.load('run'), fps=60)))"
)
PACKS = {"first, with packs": "", "first, compiled here": "none"}


def seconds(model: str, cache: str, pack: str) -> float:
    """Returns the time of a process that plays one frame [s]."""
    variables = os.environ | {"HEMLINE_CACHE_DIR": cache, "HEMLINE_KERNEL_PACK": pack}
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", PLAY, model], env=variables, check=True)
    return time.perf_counter() - began


def main() -> None:
    """Times all models, prints and records."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    row = {"machine": machine(), "commit": commit(), "load": os.getloadavg()[0], "seconds": {}}
    for model in MODELS:
        for case, pack in PACKS.items():
            with tempfile.TemporaryDirectory() as cache:
                row["seconds"][f"{model}, {case}"] = round(seconds(model, cache, pack), 2)
                if not pack:
                    row["seconds"][f"{model}, second"] = round(seconds(model, cache, pack), 2)
    for case, time_s in row["seconds"].items():
        print(f"{case}: {time_s} s")
    with RESULTS.open("a") as file:
        file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()

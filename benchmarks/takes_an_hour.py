"""Takes an hour of a light garment, five seconds each: `python -m benchmarks.takes_an_hour [GARMENT]`.

Ten recordings, the most violent five seconds of each, a process a core, from an empty folder: starting the processes,
the rest state and the figures of trust are counted. One JSON line goes to benchmarks/results/takes_an_hour.jsonl.
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.clips import every_clip, fastest, spread
from hemline import garments, motions
from hemline.bench.machine import commit, machine
from hemline.sim import Clip, produce

RESULTS = Path(__file__).parent / "results" / "takes_an_hour.jsonl"
TAKES, SECONDS = 10, 5.0


def main() -> None:
    """Make the takes, print, record."""
    name = sys.argv[1] if len(sys.argv) > 1 else "skirt-light"
    garment, jobs = garments.load(name), os.cpu_count() or 1
    long = [(file, motion) for file in every_clip() if len(motion := fastest(file, SECONDS)) == round(30 * SECONDS)]
    clips = [Clip(dict(long)[file], motions.subject_of(file)) for file in spread([file for file, _ in long], TAKES)]
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        rows = produce(folder, garment, clips, jobs=jobs)
        seconds = time.perf_counter() - began
    row = {
        "garment": name,
        "vertices": len(garment.vertices),
        "takes": len(rows),
        "seconds": round(seconds, 1),
        "failed": sum(row.failed is not None for row in rows),
        "an_hour": round(3600 * len(rows) / seconds),
        "jobs": jobs,
        "machine": machine(),
        "commit": commit(),
    }
    print(json.dumps(row))
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()

"""Measures the takes of five seconds per hour of a garment: `python -m benchmarks.takes_an_hour [GARMENT]`.

Simulates the most violent five seconds of ten recordings with one process per core into an empty folder. The start of
the processes, the rest state and the figures of each take are included. Writes one JSON line to
benchmarks/results/takes_an_hour.jsonl.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path

from benchmarks.clips import all_clips, fastest_section, select_evenly
from hemline import garments, motions
from hemline.bench.machine import commit, machine
from hemline.sim import ClipRequest, produce

RESULTS = Path(__file__).parent / "results" / "takes_an_hour.jsonl"
TAKES, SECONDS = 10, 5.0


def main() -> None:
    """Makes the takes, prints and records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("garment", nargs="?", default="skirt-light", help="Garment (default: skirt-light).")
    name = parser.parse_args().garment
    garment, jobs = garments.load(name), os.cpu_count() or 1
    long = [
        (file, motion) for file in all_clips() if len(motion := fastest_section(file, SECONDS)) == round(30 * SECONDS)
    ]
    clips = [
        ClipRequest(dict(long)[file], motions.subject_of(file))
        for file in select_evenly([file for file, _ in long], TAKES)
    ]
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

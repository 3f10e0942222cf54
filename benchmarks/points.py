"""Measures the cost of contact with the body's vertices: `python -m benchmarks.points`.

Simulates both capes on the shipped run without self-contact, with and without that contact in alternation, and
compares the median frame times. Writes one JSON line per garment to benchmarks/results/points.jsonl.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from hemline import bodies, garments, motions, sim
from hemline.bench.machine import commit, machine
from hemline.compiled import threads
from hemline.sim.contact.pairs.body_points import BodyPointSearch

RESULTS = Path(__file__).parent / "results" / "points.jsonl"
FRAMES, TURNS = 30, 3


def row(name: str) -> dict:
    """Times one garment."""
    garment = garments.load(name)
    shaped = bodies.load(garment.body_name).shaped()
    run = shaped.untangle_motion(shaped.placed(motions.load("run").resample(30)))[:FRAMES]
    settings = sim.SimSettings(self_contact=False)
    rest = sim.rest_drape(garment, shaped, settings)
    find, spent, points = BodyPointSearch.find, {True: [], False: []}, []

    def count_points(self, *arguments):
        contacts = find(self, *arguments)
        points.append(0 if contacts is None else len(contacts))
        return contacts

    for turn in range(2 * TURNS):
        on = turn % 2 == 0
        BodyPointSearch.find = count_points if on else lambda *_: None
        began = time.perf_counter()
        take = sim.simulate(garment, shaped, run, settings, start=rest)
        spent[on].append(1000 * (time.perf_counter() - began) / len(take.vertices))
    BodyPointSearch.find = find
    with_them, without = (float(np.median(spent[on])) for on in (True, False))
    return {
        "garment": name,
        "frame_ms": round(with_them, 1),
        "frame_ms_without": round(without, 1),
        "ratio": round(with_them / without, 3),
        "points_a_step": round(float(np.mean(points)), 1),
        "threads": threads(),
        "machine": machine(),
        "commit": commit(),
    }


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    with RESULTS.open("w") as stream:
        for name in ("cape-light", "cape"):
            line = row(name)
            print(json.dumps(line), flush=True)
            stream.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()

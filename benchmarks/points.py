"""What contact of the body's vertices costs: `python -m benchmarks.points`.

Both capes on the shipped run without self-contact, with and without that contact by turns; medians of the frames of all
turns, and their ratio. One JSON line a garment goes to benchmarks/results/points.jsonl.
"""

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
    """Time one garment."""
    garment = garments.load(name)
    shaped = bodies.load(garment.body_name).shaped()
    run = shaped.untangled_motion(shaped.placed(motions.load("run").resampled(30)))[:FRAMES]
    settings = sim.SimSettings(self_contact=False)
    rest = sim.rest_drape(garment, shaped, settings)
    find, spent, points = BodyPointSearch.find, {True: [], False: []}, []

    def counted(self, *arguments):
        found = find(self, *arguments)
        points.append(0 if found is None else len(found))
        return found

    for turn in range(2 * TURNS):
        on = turn % 2 == 0
        BodyPointSearch.find = counted if on else lambda *_: None
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
    with RESULTS.open("w") as stream:
        for name in ("cape-light", "cape"):
            line = row(name)
            print(json.dumps(line), flush=True)
            stream.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()

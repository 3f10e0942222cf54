"""Measures strain and cost of cloth by its stiffness: `python -m benchmarks.strain`.

Simulates the light cape on the shipped run with several stiffnesses of cloth and pins, without self-contact on one
thread. Writes one JSON line per case to benchmarks/results/strain.jsonl.
"""

import argparse
import json
import os
import time
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

from hemline import bodies, garments, motions, sim
from hemline.bench.machine import commit, machine

RESULTS = Path(__file__).parent / "results" / "strain.jsonl"
FRAMES = 45
CASES = [(120, None), (300, None), (600, None), (1000, None), (600, 20), (1000, 20)]
"""Young's modulus of cotton [N/m] and stiffness of each pin [N/m], None for rigid pins."""


def row(young: float, pin: float | None) -> dict:
    cape = garments.load("cape-light")
    body = bodies.load(cape.body_name).shaped()
    pins = cape.pins if pin is None else cape.pins.with_stiffness(pin)
    cape = replace(cape, material=replace(garments.MATERIALS["cotton"], young=young), pins=pins)
    run = body.untangle_motion(body.placed(motions.load("run").resample(30)))[:FRAMES]
    settings = sim.SimSettings(self_contact=False)
    rest, work = sim.rest_drape(cape, body, settings), []
    step = sim.Stepper.step

    def count_steps(*arguments):
        state, report = step(*arguments)
        work.append((report.newton_steps, report.solver_steps))
        return state, report

    sim.Stepper.step, began = count_steps, time.process_time()
    try:
        take = sim.simulate(cape, body, run, settings, start=rest)
    finally:
        sim.Stepper.step = step
    frames = len(take.motion) - 1
    percent = {name: round(100 * v, 2) for name, v in take.figures.items() if name.startswith("edge_")}
    return {
        "young_N_m": young,
        "pin_N_m": pin,
        "percent": percent,
        "newton_steps_a_frame": round(sum(n for n, _ in work) / frames, 1),
        "solver_steps_a_frame": round(sum(s for _, s in work) / frames),
        "cpu_ms_a_frame": round(1000 * (time.process_time() - began) / frames),
        "residual_share": round(take.figures["residual_share"], 2),
    }


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    row(*CASES[0])  # compiles before the timed runs
    with RESULTS.open("w") as stream:
        for case in CASES:
            line = row(*case)
            print(json.dumps(line), flush=True)
            stream.write(json.dumps(line | {"machine": machine(), "commit": commit()}) + "\n")


if __name__ == "__main__":
    main()

"""Measures the speed-up of a second dask worker, and estimates a cluster: `python -m benchmarks.cluster [GARMENT]`.

Workers run on this machine with one thread each. One worker and two make the same takes in alternation, so that both
meet the same load, and the medians are compared. Time per frame, bytes per frame and time of writing give the cost of
10,000 takes of five seconds, and of 1,000 garments with eight takes of four seconds. Writes one JSON line to
benchmarks/results/cluster.jsonl.
"""

import argparse
import json
import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path

from distributed import Client, LocalCluster

from hemline import garments, motions
from hemline.bench.machine import commit, machine
from hemline.datasets import Dataset, open_dataset, read_take
from hemline.sim import ClipRequest, SimSettings, produce

RESULTS = Path(__file__).parent / "results" / "cluster.jsonl"
CLIPS = ("walk", "dance", "run", "kick", "jump", "turn")
STARTS, SECONDS, ROUNDS = (0.0, 1.0), 0.5, 2
"""Start times and length of the takes, two per clip [s], and number of rounds."""
SETTINGS = SimSettings(lead_in=0.3)


def main() -> None:
    """Measures, prints and records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("garment", nargs="?", default="cape-light", help="Garment to simulate (default: cape-light).")
    name = parser.parse_args().garment
    garment = garments.load(name)
    taken: dict[int, list[float]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as scratch:
        produce(Path(scratch) / "settled", garment, [], settings=SETTINGS)
        for round_ in range(ROUNDS + 1):  # the first round is not counted
            for workers in taken:
                folder = Path(scratch) / f"{round_}-{workers}"
                shutil.copytree(Path(scratch) / "settled", folder)
                seconds = time_workers(workers, folder, garment)
                if round_:
                    taken[workers].append(seconds)
                print(f"round {round_}, {workers} workers: {seconds:.1f} s, load {os.getloadavg()[0]:.1f}", flush=True)
        dataset = open_dataset(folder)
        lines = (folder / "timings.jsonl").read_text().splitlines()
        frames, seconds = (sum(json.loads(line)[key] for line in lines) for key in ("frames", "seconds"))
        size, writing = write_cost(dataset)
    frame, byte, write = seconds / frames, size / frames, writing / frames
    row = {
        "garment": name,
        "vertices": len(garment.vertices),
        "one_worker_seconds": [round(each, 1) for each in taken[1]],
        "two_workers_seconds": [round(each, 1) for each in taken[2]],
        "speed_up": round(statistics.median(taken[1]) / statistics.median(taken[2]), 2),
        "worker_ms_a_frame": round(1000 * frame, 1),
        "kb_a_frame": round(byte / 1000, 1),
        "write_ms_a_frame": round(1000 * write, 2),
        "10000_takes": cost(10_000, 5.0, frame, byte, write),
        "1000_garments": cost(8_000, 4.0, frame, byte, write),
        "load": [round(each, 1) for each in os.getloadavg()],
        "machine": machine(),
        "commit": commit(),
    }
    print(json.dumps(row))
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")


def time_workers(workers: int, folder: Path, garment: garments.Garment) -> float:
    """Returns the time that workers take for all clips, without the rest state and their start [s]."""
    clips = [ClipRequest(part(name, start), motions.subject_of(name)) for start in STARTS for name in CLIPS]
    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0", scheduler_port=0) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        client.wait_for_workers(workers)
        client.run(warm, folder)
        began = time.perf_counter()
        produce(folder, garment, clips, settings=SETTINGS, scheduler=cluster.scheduler_address)
        return time.perf_counter() - began


def part(name: str, start: float) -> motions.Motion:
    """Returns half a second of a clip."""
    motion = motions.load(name)
    first, count = round(start * motion.fps), round(SECONDS * motion.fps) + 1
    return motion[first : first + count]


def warm(folder: Path) -> None:
    """Makes a take of two frames, so that code and kernels are loaded."""
    walk = ClipRequest(motions.load("walk")[:2], motions.subject_of("walk"))
    with tempfile.TemporaryDirectory() as scratch:
        shutil.copytree(folder, Path(scratch) / "warm")
        produce(Path(scratch) / "warm", open_dataset(folder).garment, [walk], settings=SETTINGS)


def write_cost(dataset: Dataset) -> tuple[int, float]:
    """Returns the bytes of all takes of clips, and the time to write and index them [s]."""
    files = [dataset.path(row.name) for row in dataset.clips()]
    takes = [read_take(file) for file in files]
    began = time.perf_counter()
    for take in takes:
        dataset.add(take)
    dataset.rows()
    return sum(file.stat().st_size for file in files), time.perf_counter() - began


def cost(takes: int, seconds: float, frame: float, byte: float, write: float) -> dict[str, float]:
    """Estimates the cost of takes of some length, lead-in included."""
    settings = SimSettings()
    frames = takes * settings.fps * (seconds + settings.lead_in)
    return {
        "core_hours": round(frames * frame / 3600),
        "terabytes": round(frames * byte / 1e12, 2),
        "hours_to_write": round(frames * write / 3600, 1),
        "workers_that_one_writer_keeps_busy": round(frame / write),
    }


if __name__ == "__main__":
    main()

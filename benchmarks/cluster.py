"""What a second worker brings, and what a farm would cost: `python -m benchmarks.cluster [GARMENT]`.

Workers of dask on this machine, one thread each. The same takes are made by one worker and by two, in turn, so that
both meet the same load; the medians are compared. From the seconds a frame that the workers took, the bytes a frame and
the seconds that this process needs to write them follows what 10,000 takes of five seconds and 1,000 garments of eight
takes of four seconds cost. One JSON line goes to benchmarks/results/cluster.jsonl.
"""

import json
import os
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

from distributed import Client, LocalCluster

from hemline import garments, motions
from hemline.bench.machine import commit, machine
from hemline.datasets import Dataset, open_dataset, read_take
from hemline.sim import Clip, SimSettings, produce

RESULTS = Path(__file__).parent / "results" / "cluster.jsonl"
CLIPS = ("walk", "dance", "run", "kick", "jump", "turn")
STARTS, SECONDS, ROUNDS = (0.0, 1.0), 0.5, 2
"""Of the takes, two of each clip: with few of them the worker that gets the longest one last is waited for."""
SETTINGS = SimSettings(lead_in=0.3)


def main() -> None:
    """Measure, print, record."""
    name = sys.argv[1] if len(sys.argv) > 1 else "cape-light"
    garment = garments.load(name)
    taken: dict[int, list[float]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as scratch:
        produce(Path(scratch) / "settled", garment, [], settings=SETTINGS)
        for round_ in range(ROUNDS + 1):  # the first one is not counted
            for workers in taken:
                folder = Path(scratch) / f"{round_}-{workers}"
                shutil.copytree(Path(scratch) / "settled", folder)
                seconds = made_by(workers, folder, garment)
                if round_:
                    taken[workers].append(seconds)
                print(f"round {round_}, {workers} workers: {seconds:.1f} s, load {os.getloadavg()[0]:.1f}", flush=True)
        dataset = open_dataset(folder)
        lines = (folder / "timings.jsonl").read_text().splitlines()
        frames, seconds = (sum(json.loads(line)[key] for line in lines) for key in ("frames", "seconds"))
        size, writing = written(dataset)
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


def made_by(workers: int, folder: Path, garment: garments.Garment) -> float:
    """Seconds that so many workers take for all clips, the rest state and their start not counted."""
    clips = [Clip(part(name, start), motions.subject_of(name)) for start in STARTS for name in CLIPS]
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
    """Half a second of a clip."""
    motion = motions.load(name)
    first, count = round(start * motion.fps), round(SECONDS * motion.fps) + 1
    return motion[first : first + count]


def warm(folder: Path) -> None:
    """Make a take of two frames, so that code and kernels are loaded."""
    walk = Clip(motions.load("walk")[:2], motions.subject_of("walk"))
    with tempfile.TemporaryDirectory() as scratch:
        shutil.copytree(folder, Path(scratch) / "warm")
        produce(Path(scratch) / "warm", open_dataset(folder).garment, [walk], settings=SETTINGS)


def written(dataset: Dataset) -> tuple[int, float]:
    """Bytes of all takes of clips, and seconds that writing and indexing them takes."""
    files = [dataset.path(row.name) for row in dataset.clips()]
    takes = [read_take(file) for file in files]
    began = time.perf_counter()
    for take in takes:
        dataset.add(take)
    dataset.rows()
    return sum(file.stat().st_size for file in files), time.perf_counter() - began


def cost(takes: int, seconds: float, frame: float, byte: float, write: float) -> dict[str, float]:
    """Of so many takes of so many seconds, lead-in included."""
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

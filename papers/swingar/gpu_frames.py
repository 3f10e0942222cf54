"""Measures frames of SwinGar's network on a GPU, alone and in batches (Table V): `python -m papers.swingar.gpu_frames`.

Weights are random, and the garment is a sheet. A frame is the coarse mesh and its correction, without features of
vertices, projection and the transfer to the garment. Times are medians between synchronisations with the device.
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable

import torch

from hemline.animators.swingar.estimator_config import EstimatorConfig
from hemline.animators.swingar.fit.estimator import Estimator
from hemline.animators.swingar.fit.fit_graph import DISPLACEMENT_WIDTH
from hemline.animators.swingar.graph_inputs import STATE_FEATURES, VERTEX
from hemline.bench.machine import commit
from hemline.learning.fit.device import usable_device
from tests.animators.swingar.swingar_samples import graph_of, inputs

FEATURES = {"told": VERTEX.count, "state_told": STATE_FEATURES, "displacement": DISPLACEMENT_WIDTH, "context": True}
NETWORKS = {"lean, with features": EstimatorConfig.lean(**FEATURES), "the paper's": EstimatorConfig()}
SHEETS = {600: (20, 30), 10_000: (100, 100)}
"""Numbers of vertices, with rows and columns of the sheets."""


def measure(config: EstimatorConfig, size: tuple[int, int], frames: int, device: torch.device, runs: int) -> float:
    """Returns the time of a frame [ms].

    Args:
        config: Sizes of the network.
        size: Rows and columns of the sheet.
        frames: Number of frames in a batch.
        device: The device.
        runs: Number of batches that are measured.
    """
    estimator, graph = Estimator(config).to(device), graph_of(*size)
    given = inputs(config, size[0] * size[1], frames)
    t = {name: torch.from_numpy(each).to(device) for name, each in given.items()}

    def play() -> None:
        estimator.coarse(garment, t["motion"], t["transforms"], t.get("told"), t.get("turns"))
        estimator.corrective(garment, t["meshes"], t["joints"], t["body"])

    with torch.no_grad():
        garment = estimator.garment(graph, t["features"], t["descriptor"], t["skin_logits"])
        return median_ms(play, device, runs) / frames


def median_ms(step: Callable[[], None], device: torch.device, runs: int) -> float:
    """Returns the median time of a step after three runs to warm up [ms]."""
    times = []
    for _ in range(runs + 3):
        began = time.perf_counter()
        step()
        if device.type == "cuda":
            torch.cuda.synchronize(device)
        times.append(1e3 * (time.perf_counter() - began))
    return statistics.median(times[3:])


def main() -> None:
    """Prints a row of JSON for each network, sheet and batch."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--vertices", type=int, nargs="+", default=list(SHEETS), choices=list(SHEETS))
    parser.add_argument("--batches", type=int, nargs="+", default=[1, 32])
    parser.add_argument("--runs", type=int, default=10)
    options = parser.parse_args()
    device = usable_device(options.device)
    torch.set_float32_matmul_precision("high")
    machine = torch.cuda.get_device_name(device) if device.type == "cuda" else "processor"
    for name, config in NETWORKS.items():
        for count in options.vertices:
            for frames in options.batches:
                ms = measure(config, SHEETS[count], frames, device, options.runs)
                row = {"network": name, "vertices": count, "batch": frames, "frame_ms": ms, "frames_per_s": 1e3 / ms}
                print(json.dumps(row | {"machine": machine, "commit": commit()}), flush=True)


if __name__ == "__main__":
    main()

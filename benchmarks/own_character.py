"""Times the way from a foreign rigged character to a dancing GLB: `python -m benchmarks.own_character [FIT OPTIONS]`.

The character is made by a script: a tall, slim shape of the shipped body with Mixamo's names, in centimetres, z up,
with twist and hair bones, and the shipped dance as its own animation. A generated dress, made on the mean body,
represents a foreign mesh. The five commands of docs/character_in.md follow, with the elapsed and the processor time of
each. Files go to out/own_character, which is emptied first. Writes one JSON line to
benchmarks/results/own_character.jsonl.
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from hemline import bodies, motions
from hemline.bench.machine import commit, machine
from tests.bodies.character_samples import CUSTOMS, Sample, write_character

ROOT = Path(__file__).parents[1]

WORK = ROOT / "out" / "own_character"
RESULTS = ROOT / "benchmarks" / "results" / "own_character.jsonl"
BETAS = (0.8, -1.5, 1.0)
DRESS = "generate dress --length 0.95 --flare 0.25 --vertices 2500 -o my_dress.obj"
COMMANDS = {
    "body": "body me.glb -o me.safetensors --picture me.png",
    "tryon": "tryon my_dress.obj --body me.safetensors -o dress.safetensors --picture dress.png",
    "simulate": "simulate dress.safetensors --body me.safetensors -m walk run turn jump kick -o takes",
    "fit": "fit takes --animator ropes -o dress-model.safetensors",
    "animate": "animate dress-model.safetensors -m me.glb:dance --character me.glb -o dressed.glb",
}


def main() -> None:
    """Makes the character, runs the commands, prints and records."""
    _, fit_options = argparse.ArgumentParser(
        description=__doc__, epilog="Further options are passed to hemline fit."
    ).parse_known_args()
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    write_character(WORK / "me.glb", make_character())
    run(DRESS.split())
    seconds, processor = {}, {}
    for name, command in COMMANDS.items():
        words = command.split() + (fit_options if name == "fit" else [])
        seconds[name], processor[name] = run(words)
        load = os.getloadavg()[0]
        print(f"{name}: {seconds[name]:.0f} s, {processor[name]:.0f} s of processor, load {load:.1f}", flush=True)
    run(["animate", "dress-model.safetensors", "-m", "me.glb:dance", "-o", "dressed.png"])
    row = {
        "fit": fit_options,
        "seconds": {name: round(each, 1) for name, each in seconds.items()},
        "processor_seconds": {name: round(each, 1) for name, each in processor.items()},
        "minutes": round(sum(seconds.values()) / 60, 1),
        "processor_minutes": round(sum(processor.values()) / 60, 1),
        "load": [round(each, 1) for each in os.getloadavg()],
        "machine": machine(),
        "commit": commit(),
    }
    print(json.dumps(row))
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")


def make_character() -> Sample:
    """Makes the character with its dance: rotations against its rest pose, in the axes of its file."""
    full = bodies.load()
    shaped = full.shaped(BETAS)
    no_shapes = {"shapedirs": full.shapedirs[:0], "joint_shapedirs": full.joint_shapedirs[:0]}
    body = replace(full, template=shaped.vertices, joints=shaped.joints, **no_shapes)
    dance, z_up = motions.load("dance"), Rotation.from_euler("x", 90, degrees=True)
    to_t_pose = _rotations(full.rest_offsets)
    turns = np.empty((len(dance), len(motions.JOINT_NAMES), 4))
    for joint, parent in enumerate(motions.PARENTS):
        above = to_t_pose[parent].inv() if parent >= 0 else Rotation.identity()
        turned = above * _rotations(dance.rotations[:, joint]) * to_t_pose[joint]
        turns[:, joint] = (z_up * turned * z_up.inv()).as_quat()[:, [3, 0, 1, 2]]
    clips = {"dance": (np.arange(len(dance)) / dance.fps, turns)}
    return Sample(CUSTOMS["mixamo"], scale=100, z_up=True, extra=1, loose=20, clips=clips, body=body)


def _rotations(wxyz: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.asarray(wxyz, float)[:, [1, 2, 3, 0]])


def run(words: Sequence[str]) -> tuple[float, float]:
    """Runs `hemline`; returns elapsed and processor time [s]."""
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-m", "hemline", *words], cwd=WORK, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - began, used


if __name__ == "__main__":
    main()

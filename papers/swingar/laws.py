"""Tests laws that a network must obey: `python -m papers.swingar.laws --model swingar`, some minutes.

Two histories end in one pose (Fig. 6): a standing body sways forwards or backwards and passes one place at opposite
velocities. The difference of the garment between the two is compared with that of the simulation, then again after the
body has stood still for 65 frames. Two resolutions of one garment are compared: the T-shirt of 3,150 vertices and that
of 12,414. The network moves the garments from the first frame on, without a simulation at the beginning. The garments
of the histories are in no fit. Appends a JSON line to benchmarks/results/swingar_laws.jsonl.
"""

import argparse
import json
from pathlib import Path

import numpy as np

import hemline
from hemline import bodies, garments, motions
from hemline.animators import Animator
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody
from hemline.garments.proxy.proxy import ProxySize, proxy_of
from hemline.motions.motion import Motion
from hemline.sim import SimSettings, rest_drape, simulate

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "swingar_laws.jsonl"
SWAYS = 45
"""Number of frames up to the one that is compared."""
HELD = 65
"""Number of frames in which the pose is then held."""
AMPLITUDE, PERIOD = 0.25, 1.0
"""Amplitude [m] and period [s] of the swaying."""


def swaying(body: ShapedBody, sign: float) -> Motion:
    """Returns a motion of the body in its rest pose. At frame `SWAYS` it is where it began, then it stands still."""
    rest = body.rest_pose
    seconds = (np.arange(SWAYS + 1) - SWAYS) / 30
    way = sign * AMPLITUDE * np.sin(2 * np.pi * seconds / PERIOD) * np.clip((seconds + SWAYS / 30) / 0.3, 0, 1)
    way = np.concatenate([way, np.zeros(HELD)])
    translations = rest.translation + np.outer(way, [0, 0, 1])
    rotations = np.repeat(rest.rotations[None], len(way), axis=0)
    return Motion(rotations, translations.astype(np.float32), fps=30.0, leg_length=body.leg_length, name="sway")


def played(animator: Animator, body: ShapedBody, motion: Motion) -> np.ndarray:
    """Plays a motion; returns the vertices of all frames [m]."""
    state, found = animator.start(body.posed(motion[0])), []
    for frame in range(len(motion)):
        state, vertices = animator.step(state, body.posed(motion[frame]), 1 / motion.fps)
        found.append(vertices)
    return np.stack(found)


GARMENTS = ("skirt:100@35", "dress:100@35", "top:100@35")
"""Random designs of seeds that no fit has."""


def histories(model: str) -> dict[str, dict[str, float]]:
    """Returns the correlation of the difference fields, and their sizes at the pose and after it was held [mm]."""
    body = bodies.load("anny24").shaped()
    found = {}
    for name in GARMENTS:
        garment, _ = proxy_of(garments.load(name), ProxySize())
        worn = hemline.load(model).with_simulated_start(0.0).animator_for(garment, body)
        rest = rest_drape(garment, body, SimSettings())
        ours, theirs = [], []
        for sign in (1.0, -1.0):
            motion = swaying(body, sign)
            take = simulate(garment, body, motion, SimSettings(), start=rest)
            theirs.append(take.vertices[take.clip_frames])
            ours.append(played(worn, body, motion))
        one, other = (each[0] - each[1] for each in (np.stack(ours), np.stack(theirs)))
        row = {"correlation": float(np.corrcoef(one[SWAYS].ravel(), other[SWAYS].ravel())[0, 1])}
        for label, frame in (("at_once", SWAYS), ("held", SWAYS + HELD)):
            row |= {f"ours_{label}_mm": apart_mm(one[frame]), f"theirs_{label}_mm": apart_mm(other[frame])}
        found[name] = row
    return found


def resolutions(model: str) -> dict[str, float]:
    """Returns the distance of the T-shirt of 12,414 vertices from that of 3,150, whose vertices are its first [mm]."""
    body, ends = bodies.load("anny24").shaped(), []
    motion = body.placed(motions.load("walk"))[:90]
    for name in ("tshirt-light", "tshirt"):
        worn = hemline.load(model).with_simulated_start(0.0).animator_for(garments.load(name), body)
        ends.append(played(worn, body, motion))
    coarse, fine = ends
    apart = np.linalg.norm(coarse - fine[:, : coarse.shape[1]], axis=2)
    return {"mean_mm": 1e3 * float(apart.mean()), "p95_mm": 1e3 * float(np.percentile(apart, 95))}


def apart_mm(field: np.ndarray) -> float:
    """Returns the mean length of vectors [mm]."""
    return 1e3 * float(np.linalg.norm(field, axis=1).mean())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--model", default="swingar", help="a model file of lag or swingar, or the name of a shipped one"
    )
    asked = parser.parse_args().model
    row = {"model": asked, "histories": histories(asked), "resolutions": resolutions(asked)}
    row |= {"machine": machine(), "commit": commit()}
    print(json.dumps(row, indent=1))
    with RESULTS.open("a") as file:
        file.write(json.dumps(row) + "\n")

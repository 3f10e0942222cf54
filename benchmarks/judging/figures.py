"""Figures of a played scene: strain, vertices inside, forces left over, distances between surfaces, swings."""

import itertools
from dataclasses import replace

import numpy as np

from benchmarks.judging.engines import played
from benchmarks.judging.scene import JudgedScene
from hemline.collide import inside
from hemline.meshes import ClosestTree, strains
from hemline.sim import SimSettings, Stepper

GRAVITY = 9.81


def strain(scene: JudgedScene, frames: np.ndarray) -> dict[str, float]:
    """Median and 99th percentile of |length / rest length - 1| over frames and edges that are not pinned [%]."""
    sheet = scene.sheet
    loose = ~np.isin(sheet.edges, scene.pins).all(axis=1)
    found = 100 * np.abs(strains(frames, sheet.edges, sheet.edge_length.astype(np.float32))[:, loose])
    return {"strain_p50": float(np.percentile(found, 50)), "strain_p99": float(np.percentile(found, 99))}


def vertices_inside(scene: JudgedScene, frames: np.ndarray, first: int = 0) -> int:
    """Vertices with a winding number above one half, in all frames together."""
    if not len(scene.body_faces):
        return 0
    return sum(
        int(inside(scene.body[first + i].astype(np.float32), scene.body_faces, frame.astype(np.float32)).sum())
        for i, frame in enumerate(frames)
    )


def left_over(scene: JudgedScene, positions: np.ndarray) -> dict[str, float]:
    """How far a shape is from rest in our energy.

    Returns:
        `residual`: mean force on the vertices that touch nothing, over the mean weight of a vertex; `energy_mJ`:
        elastic energy and weight of all.
    """
    sheet = scene.sheet
    stepper = Stepper(sheet, pinned=scene.pins, settings=SimSettings(self_contact=False))
    positions = positions.astype(np.float64)
    force = -stepper.gradient(positions)
    force[:, 1] -= GRAVITY * sheet.mass
    free = untouched(scene, positions)
    weight = GRAVITY * float(sheet.mass.mean())
    energy = stepper.energy(positions) + GRAVITY * float((sheet.mass * positions[:, 1]).sum())
    return {"residual": float(np.linalg.norm(force[free], axis=1).mean() / weight), "energy_mJ": 1000 * energy}


def left_over_by_newton(scene: JudgedScene, positions: np.ndarray) -> float:
    """The same residual as Newton has it: how it moves the vertices in half a millisecond, from rest."""
    fps = 2000.0
    held = replace(
        scene, vertices=positions.astype(np.float64), body=scene.body[-1:], pinned=scene.pinned[-1:], fps=fps
    )
    moved = np.diff(played("newton", held.still(2), substeps=1, iterations=10).frames.astype(np.float64), axis=0)[0]
    mass = scene.sheet.mass
    force = mass[:, None] * moved * fps**2
    return float(np.linalg.norm(force[untouched(scene, positions)], axis=1).mean() / (GRAVITY * mass.mean()))


def untouched(scene: JudgedScene, positions: np.ndarray) -> np.ndarray:
    """Which vertices are neither pinned nor within 8 mm of the body."""
    free = np.ones(len(positions), bool)
    free[scene.pins] = False
    if len(scene.body_faces):
        tree = ClosestTree(scene.body[-1].astype(np.float32), scene.body_faces)
        free &= tree.signed_distances(positions.astype(np.float32)) > 0.008
    return free


def apart_mm(one: np.ndarray, other: np.ndarray, faces: np.ndarray) -> dict[str, float]:
    """Distance between two surfaces, from the vertices of each to the triangles of the other, and of equal vertices."""
    one, other = one.astype(np.float32), other.astype(np.float32)
    both = 1000 * np.concatenate([ClosestTree(b, faces).closest(a).distances for a, b in ((one, other), (other, one))])
    same = 1000 * np.linalg.norm(one - other, axis=1)
    return {"mean": float(both.mean()), "p95": float(np.percentile(both, 95)), "vertices": float(same.mean())}


def swing(height: np.ndarray, seconds: float) -> dict[str, float]:
    """Period [s] of a swing through zero, and its decay: peak after peak of the same side, as a ratio per period."""
    crossing = np.flatnonzero(np.sign(height[1:]) != np.sign(height[:-1]))
    times = seconds * (crossing + height[crossing] / (height[crossing] - height[crossing + 1]))
    peaks = [np.abs(height[a + 1 : b + 1]).max() for a, b in itertools.pairwise(crossing)]
    half = np.diff(times)
    kept = (peaks[-1] / peaks[0]) ** (2 / (len(peaks) - 1)) if len(peaks) > 1 else float("nan")
    return {"period_s": float(2 * half.mean()), "kept_per_period": float(kept)}

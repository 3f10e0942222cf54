"""Measures played scenes: strain, vertices inside, residual forces, distances between surfaces, swings."""

import itertools
from dataclasses import replace

import numpy as np

from benchmarks.engines.play import play_scene
from benchmarks.engines.scene import EngineScene
from hemline.collide import inside
from hemline.meshes import ClosestTree, strains
from hemline.sim import SimSettings, Stepper

GRAVITY = 9.81


def strain(scene: EngineScene, frames: np.ndarray) -> dict[str, float]:
    """Returns median and 99th percentile of |length / rest length - 1| over frames and unpinned edges [%]."""
    sheet = scene.sheet
    loose = ~np.isin(sheet.edges, scene.pins).all(axis=1)
    percent = 100 * np.abs(strains(frames, sheet.edges, sheet.edge_length.astype(np.float32))[:, loose])
    return {"strain_p50": float(np.percentile(percent, 50)), "strain_p99": float(np.percentile(percent, 99))}


def vertices_inside(scene: EngineScene, frames: np.ndarray, first: int = 0) -> int:
    """Counts vertices with a winding number above one half over all frames."""
    if not len(scene.body_faces):
        return 0
    return sum(
        int(inside(scene.body[first + i].astype(np.float32), scene.body_faces, frame.astype(np.float32)).sum())
        for i, frame in enumerate(frames)
    )


def rest_figures(scene: EngineScene, positions: np.ndarray) -> dict[str, float]:
    """Measures the distance of a shape from equilibrium in the energy of hemline.

    Returns:
        `residual`, the mean force on vertices without contact over the mean weight of a vertex, and `energy_mJ`, the
        total elastic and gravitational energy.
    """
    sheet = scene.sheet
    stepper = Stepper(sheet, pinned=scene.pins, settings=SimSettings(self_contact=False))
    positions = positions.astype(np.float64)
    force = -stepper.gradient(positions)
    force[:, 1] -= GRAVITY * sheet.mass
    free = free_vertices(scene, positions)
    weight = GRAVITY * float(sheet.mass.mean())
    energy = stepper.energy(positions) + GRAVITY * float((sheet.mass * positions[:, 1]).sum())
    return {"residual": float(np.linalg.norm(force[free], axis=1).mean() / weight), "energy_mJ": 1000 * energy}


def newton_residual(scene: EngineScene, positions: np.ndarray) -> float:
    """Returns the residual in Newton's energy, from its displacement of resting vertices in half a millisecond."""
    fps = 2000.0
    frozen = replace(
        scene, vertices=positions.astype(np.float64), body=scene.body[-1:], pinned=scene.pinned[-1:], fps=fps
    )
    moved = np.diff(play_scene("newton", frozen.still(2), substeps=1, iterations=10).frames.astype(np.float64), axis=0)[
        0
    ]
    mass = scene.sheet.mass
    force = mass[:, None] * moved * fps**2
    return float(np.linalg.norm(force[free_vertices(scene, positions)], axis=1).mean() / (GRAVITY * mass.mean()))


def free_vertices(scene: EngineScene, positions: np.ndarray) -> np.ndarray:
    """Returns a mask of vertices that are neither pinned nor within 8 mm of the body."""
    free = np.ones(len(positions), bool)
    free[scene.pins] = False
    if len(scene.body_faces):
        tree = ClosestTree(scene.body[-1].astype(np.float32), scene.body_faces)
        free &= tree.signed_distances(positions.astype(np.float32)) > 0.008
    return free


def surface_distances_mm(one: np.ndarray, other: np.ndarray, faces: np.ndarray) -> dict[str, float]:
    """Returns the distances between two surfaces, in both directions, and between equal vertices [mm]."""
    one, other = one.astype(np.float32), other.astype(np.float32)
    both = 1000 * np.concatenate([ClosestTree(b, faces).closest(a).distances for a, b in ((one, other), (other, one))])
    same = 1000 * np.linalg.norm(one - other, axis=1)
    return {"mean": float(both.mean()), "p95": float(np.percentile(both, 95)), "vertices": float(same.mean())}


def swing(height: np.ndarray, seconds: float) -> dict[str, float]:
    """Returns the period [s] of a swing, and the ratio of successive peaks on the same side."""
    crossing = np.flatnonzero(np.sign(height[1:]) != np.sign(height[:-1]))
    times = seconds * (crossing + height[crossing] / (height[crossing] - height[crossing + 1]))
    peaks = [np.abs(height[a + 1 : b + 1]).max() for a, b in itertools.pairwise(crossing)]
    half = np.diff(times)
    ratio = (peaks[-1] / peaks[0]) ** (2 / (len(peaks) - 1)) if len(peaks) > 1 else float("nan")
    return {"period_s": float(2 * half.mean()), "kept_per_period": float(ratio)}

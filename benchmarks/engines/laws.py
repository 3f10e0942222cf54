"""Compares every engine with closed forms of the motion of sheets."""

from typing import Any

import numpy as np
from scipy.integrate import quad, solve_bvp
from scipy.optimize import brentq
from scipy.special import jn_zeros

from benchmarks.engines import scenes
from benchmarks.engines.figures import GRAVITY, swing
from benchmarks.engines.play import DRAPE_SETTINGS, TIGHT_SETTINGS, EngineRun, play_scene
from hemline.sim import Elastic

Row = dict[str, Any]
STIFF = Elastic(density=0.15, young=500.0, poisson=0.0, bending=0.05)
SOFT = Elastic(density=0.15, young=60.0, poisson=0.0, bending=1e-6, damping=0.003)


def rows(engines: list[str], **_: Any) -> list[Row]:
    """Measures all closed forms, and prints them."""
    print(f"{'law':<26}{'engine':<10}{'found':>10}{'closed form':>14}{'off %':>8}   what")
    found = []
    for law in (fall, hanging_strip, other_cuts, sway, pendulum, cantilevers):
        for row in (row for engine in engines for row in law(engine)):
            decay = f", keeps {100 * row['kept_per_period']:.0f} % of its swing" if "kept_per_period" in row else ""
            print(
                f"{row['scene']:<26}{row['engine']:<10}{row['found']:>10.5f}{row['wanted']:>14.5f}"
                f"{row['off_percent']:>8.2f}   {row['what']}{decay}",
                flush=True,
            )
            found.append(row)
    return found


def fall(engine: str) -> list[Row]:
    """Measures half a second of free fall, g t^2 / 2, less the known error g t h / 2 of backward Euler."""
    result = play_scene(engine, scenes.falling(16), **({"iterations": 2} if engine == "newton" else {}))
    start, end = result.frames[0, :, 1], result.frames[-1, :, 1]
    steps = {"hemline": "substeps", "blender": "quality", "newton": "substeps"}[engine]
    seconds = 0.5
    first_order = GRAVITY * seconds / (30 * result.options[steps]) / 2
    return [_row("free fall", engine, (start - end).mean() - first_order, GRAVITY * seconds**2 / 2, "m in 0.5 s")]


def hanging_strip(engine: str) -> list[Row]:
    """Measures a hanging strip of soft cloth in square cells: F S = rho g (L - s), S = Y (F^2 - 1) / 2."""
    return [_strip("hanging strip", engine, (11, 31, 1 / 3, 1.0))]


def other_cuts(engine: str) -> list[Row]:
    """Measures the hanging strip with other cells (width x length); not in Newton, whose elements are ours."""
    if engine == "newton":
        return []
    cuts = {
        "strip, cells 25 x 25": (9, 41, 0.2, 1.0),
        "strip, cells 50 x 50": (5, 21, 0.2, 1.0),
        "strip, cells 38 x 33": (9, 31, 0.3, 1.0),
    }
    return [_strip(name, engine, size) for name, size in cuts.items()]


def _strip(name: str, engine: str, size: tuple[int, int, float, float]) -> Row:
    scene = scenes.hanging(name, size, SOFT, 60, 0.0)
    result = _settle(engine, scene, newton={"substeps": 20, "iterations": 30})
    found = -result.frames[-1][_last_row(scene), 1].mean() - 1

    def stretch(s: float) -> float:
        stress = SOFT.density * GRAVITY * (1 - s)
        return brentq(lambda f: f * SOFT.young * (f**2 - 1) / 2 - stress, 1, 3) - 1

    return _row(name, engine, found, quad(stretch, 0, 1)[0], "m longer")


def sway(engine: str) -> list[Row]:
    """Measures the slowest mode of a hanging sheet without bending: omega = j / 2 sqrt(g / L), J0(j) = 0."""
    scene = scenes.swaying(60)
    found = swing(play_scene(engine, scene, TIGHT_SETTINGS).frames[:, _last_row(scene), 2].mean(axis=1), 1 / scene.fps)
    wanted = 4 * np.pi / jn_zeros(0, 1)[0] * np.sqrt(0.5 / GRAVITY)
    period = _row("swaying sheet", engine, found["period_s"], wanted, "s a period")
    return [period | {"kept_per_period": found["kept_per_period"]}]


def pendulum(engine: str) -> list[Row]:
    """Measures a stiff sheet that swings by 0.1 rad about its upper edge: omega^2 = 3 g / (2 L).

    Blender is skipped, as its angular springs are unstable at that stiffness.
    """
    if engine == "blender":
        return []
    scene = scenes.hanging("pendulum", (5, 17, 0.125, 0.5), STIFF, 60, 0.1)
    result = play_scene(engine, scene, TIGHT_SETTINGS)
    out = result.frames[:, _last_row(scene), 2].mean(axis=1)
    found = swing(out, 1 / scene.fps)
    period = _row("pendulum", engine, found["period_s"], 2 * np.pi * np.sqrt(2 * 0.5 / (3 * GRAVITY)), "s a period")
    return [period | {"kept_per_period": found["kept_per_period"]}]


def cantilevers(engine: str) -> list[Row]:
    """Measures the droop of a strip clamped at one end, the heavy elastica D theta'' = -rho g (L - s) cos theta.

    Newton is skipped, as its sweeps do not come to rest here within minutes.
    """
    if engine == "newton":
        return []
    length, bending = 0.31, 4e-3
    load = 0.15 * GRAVITY / bending
    solved = solve_bvp(
        lambda s, y: np.stack([y[1], -load * (length - s) * np.cos(y[0])]),
        lambda a, b: np.array([a[0], b[1]]),
        np.linspace(0, length, 200),
        np.zeros((2, 200)),
    )
    wanted = abs(quad(lambda s: np.sin(solved.sol(s)[0]), 0, length)[0])
    found = []
    for even, cell_mm in ((False, 10), (False, 5), (True, 10), (True, 5)):
        name = f"cantilever, {'triangles' if even else 'squares'} {cell_mm}"
        scene = scenes.cantilever(name, 90, bending, even=even, cell=cell_mm / 1000)
        sunk = -_settle(engine, scene).frames[-1][_last_row(scene), 1].mean()
        found.append(_row(name, engine, sunk, wanted, "m lower"))
    return found


def _settle(engine: str, scene: Any, **options: dict[str, Any]) -> EngineRun:
    calm = {
        "hemline": {"kept_speed": 0.9},
        "blender": {"air_damping": 1.0, "damping": 5.0},
        "newton": {"kept_speed": 0.9},
    }[engine] | options.get(engine, {})
    return play_scene(engine, scene, DRAPE_SETTINGS, **calm)


def _last_row(scene: Any) -> np.ndarray:
    along = np.linalg.norm(scene.rest_vertices[:, 1:], axis=1)
    return along > along.max() - 1e-6


def _row(scene: str, engine: str, found: float, wanted: float, what: str) -> Row:
    off = 100 * (float(found) / wanted - 1)
    return {
        "scene": scene,
        "engine": engine,
        "found": float(found),
        "wanted": float(wanted),
        "off_percent": off,
        "what": what,
    }

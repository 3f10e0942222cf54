"""Compares one drape and one run in every engine: distances between surfaces, strain and residuals."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.engines import garment_scenes, scenes
from benchmarks.engines.figures import newton_residual, rest_figures, strain, surface_distances_mm, vertices_inside
from benchmarks.engines.pictures import draw_drape, draw_run
from benchmarks.engines.play import DRAPE_SETTINGS, EngineRun, is_available, play_scene, with_self_contact
from benchmarks.engines.scene import EngineScene
from hemline.sim import SimSettings

Row = dict[str, Any]
CALM: dict[str, dict[str, Any]] = {
    "hemline": {"kept_speed": 0.9},
    "blender": {"air_damping": 1.0, "damping": 5.0},
    "newton": {"kept_speed": 0.9, "substeps": 10, "iterations": 10},
}
"""Damping that brings a drape to rest; the shape at rest does not depend on it."""
RUN: dict[str, dict[str, Any]] = {
    "blender": {"quality": 10, "damping": 0.0},
    "newton": {"substeps": 10, "iterations": 10},
}

DISTANCES = f"{'engine':<9}{'to ours: mean, p95 mm':>22}{'same vertex':>12}{'strain p50, p99 %':>21}"
"""Header of the first columns of both tables."""

NEWTON_WORK = ((10, 10), (50, 2), (100, 3), (100, 10))
"""Newton's steps per frame and sweeps per step."""


def ball(engines: list[str], *, self_thickness: float, pictures: Path | None, **_: Any) -> list[Row]:
    """Compares a square of cotton on a ball."""
    scene = scenes.on_a_ball(37, 90)
    settings = with_self_contact(DRAPE_SETTINGS, self_thickness)
    runs = [play_scene(engine, scene, settings, **_options(CALM, engine, self_thickness)) for engine in engines]
    return _drape("ball", scene, runs, pictures)


def drape(engines: list[str], *, skirt: bool, self_thickness: float, pictures: Path | None, **_: Any) -> list[Row]:
    """Compares a garment settled in the rest pose, where takes start."""
    garment = garment_scenes.skirt() if skirt else garment_scenes.cape()
    scene = garment_scenes.rest_scene(garment, 61)
    settings = with_self_contact(SimSettings(), self_thickness)
    rest = garment_scenes.settle(garment, settings)
    runs = [EngineRun("hemline", rest.vertices, np.zeros(1), np.zeros(1), {"settle": settings.settle})]
    others = [engine for engine in engines if engine != "hemline"]
    runs += [play_scene(engine, scene, settings, **_options(CALM, engine, self_thickness)) for engine in others]
    return _drape("drape-skirt" if skirt else "drape-cape", scene, runs, pictures)


def run(engines: list[str], *, skirt: bool, self_thickness: float, pictures: Path | None, **_: Any) -> list[Row]:
    """Compares a garment on the shipped run, from the same settled drape."""
    garment = garment_scenes.skirt() if skirt else garment_scenes.cape()
    settings = with_self_contact(SimSettings(), self_thickness)
    rest = garment_scenes.settle(garment, settings)
    scene, ours, lead = garment_scenes.run_scene(garment, rest, settings, 45)
    others = [engine for engine in engines if engine != "hemline"]
    runs = [ours] + [play_scene(engine, scene, settings, **_options(RUN, engine, self_thickness)) for engine in others]
    print(f"{scene.name}, {len(scene.vertices)} vertices, {scene.frame_count - lead} frames after a lead-in of {lead}")
    print(DISTANCES + f"{'inside a frame':>15}")
    rows = []
    for each in runs:
        frames = each.frames[lead:]
        far = [
            surface_distances_mm(a, b, scene.faces) for a, b in zip(frames[::5], ours.frames[lead:][::5], strict=True)
        ]
        distance = {name: float(np.mean([one[name] for one in far])) for name in far[0]}
        strains = strain(scene, frames)
        within = vertices_inside(scene, frames, lead) / len(frames)
        print(
            f"{each.engine:<9}{distance['mean']:>14.1f}{distance['p95']:>8.1f}{distance['vertices']:>12.1f}"
            f"{strains['strain_p50']:>12.2f}{strains['strain_p99']:>9.2f}{within:>15.2f}",
            flush=True,
        )
        row = {"scene": scene.name, "engine": each.engine, "distance_mm": distance, "inside_per_frame": within}
        rows.append(row | strains | {"asked": each.options})
    if pictures:
        draw_run(pictures / f"run-{'skirt' if skirt else 'cape'}.webp", scene, runs, lead)
    return rows


def sweeps(engines: list[str], *, skirt: bool, **_: Any) -> list[Row]:
    """Measures whether Newton converges to hemline on the first frames of the run with more work per frame."""
    if "newton" not in engines:
        return []
    garment = garment_scenes.skirt() if skirt else garment_scenes.cape()
    settings = with_self_contact(SimSettings(), 0)
    scene, ours, _lead = garment_scenes.run_scene(garment, garment_scenes.settle(garment, settings), settings, 2)
    start = scene.first(8)
    print(
        f"start of {scene.name}, frame 7: Newton beside ours, "
        f"whose strain p99 is {strain(start, ours.frames[7:8])['strain_p99']:.2f} %"
    )
    print(f"{'steps a frame':>14}{'sweeps a step':>14}{'same vertex mm':>15}{'strain p50, p99 %':>19}")
    rows = []
    for steps, count in NEWTON_WORK:
        theirs = play_scene("newton", start, settings, substeps=steps, iterations=count).frames[-1]
        distance = 1000 * float(np.linalg.norm(theirs - ours.frames[7], axis=1).mean())
        strains = strain(start, theirs[None])
        print(
            f"{steps:>14}{count:>14}{distance:>15.1f}{strains['strain_p50']:>12.2f}{strains['strain_p99']:>7.2f}",
            flush=True,
        )
        row = {"scene": f"start of {scene.name}", "engine": "newton", "steps": steps, "sweeps": count}
        rows.append(row | {"distance_mm": distance} | strains)
    return rows


def _drape(name: str, scene: EngineScene, runs: list[EngineRun], pictures: Path | None) -> list[Row]:
    print(f"{scene.name}, {len(scene.vertices)} vertices")
    print(DISTANCES + f"{'inside':>8}{'residual':>10}{'by Newton':>10}{'energy mJ':>11}{'still moving mm':>17}")
    rows = []
    for each in runs:
        last = each.frames[-1]
        distance = surface_distances_mm(last, runs[0].frames[-1], scene.faces)
        strains, rest = strain(scene, last[None]), rest_figures(scene, last)
        theirs = newton_residual(scene, last) if is_available("newton") else float("nan")
        within = vertices_inside(scene, last[None])
        moving = 1000 * float(np.linalg.norm(last - each.frames[-min(10, len(each.frames))], axis=1).mean())
        print(
            f"{each.engine:<9}{distance['mean']:>14.1f}{distance['p95']:>8.1f}{distance['vertices']:>12.1f}"
            f"{strains['strain_p50']:>12.2f}{strains['strain_p99']:>9.2f}{within:>8}{rest['residual']:>10.3f}"
            f"{theirs:>10.3f}{rest['energy_mJ']:>11.1f}{moving:>17.2f}",
            flush=True,
        )
        row = {"scene": scene.name, "engine": each.engine, "distance_mm": distance, "inside": within}
        rows.append(row | strains | rest | {"residual_by_newton": theirs, "moving_mm": moving, "asked": each.options})
    if pictures:
        draw_drape(pictures / f"{name}.png", scene, runs)
    return rows


def _options(table: dict[str, dict[str, Any]], engine: str, self_thickness: float) -> dict[str, Any]:
    return table[engine] | ({} if engine == "hemline" else {"self_thickness": self_thickness})

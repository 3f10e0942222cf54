"""The same drape and the same run in every engine: how far apart the surfaces are, and what is left over in each."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judging import scenes, worn
from benchmarks.judging.engines import RESTING, Played, played, present
from benchmarks.judging.figures import apart_mm, left_over, left_over_by_newton, strain, vertices_inside
from benchmarks.judging.pictures import drawn, drawn_run
from benchmarks.judging.scene import JudgedScene
from benchmarks.judging.settings import with_self_contact
from hemline.sim import SimSettings

Row = dict[str, Any]
CALM: dict[str, dict[str, Any]] = {
    "hemline": {"kept_speed": 0.9},
    "blender": {"air_damping": 1.0, "damping": 5.0},
    "newton": {"kept_speed": 0.9, "substeps": 10, "iterations": 10},
}
"""What takes the motion out of a drape; rest does not depend on it."""
RUN: dict[str, dict[str, Any]] = {
    "blender": {"quality": 10, "damping": 0.0},
    "newton": {"substeps": 10, "iterations": 10},
}

DISTANCES = f"{'engine':<9}{'to ours: mean, p95 mm':>22}{'same vertex':>12}{'strain p50, p99 %':>21}"
"""Head of the columns that both tables begin with."""

WORK = ((10, 10), (50, 2), (100, 3), (100, 10))
"""Newton's steps a frame, and its sweeps a step."""


def ball(engines: list[str], *, self_thickness: float, pictures: Path | None, **_: Any) -> list[Row]:
    """A square of cotton on a ball."""
    scene = scenes.on_a_ball(37, 90)
    settings = with_self_contact(RESTING, self_thickness)
    runs = [played(engine, scene, settings, **_asked(CALM, engine, self_thickness)) for engine in engines]
    return _drape("ball", scene, runs, pictures)


def drape(engines: list[str], *, skirt: bool, self_thickness: float, pictures: Path | None, **_: Any) -> list[Row]:
    """A garment settled in the rest pose; ours is where takes start."""
    garment = worn.skirt() if skirt else worn.cape()
    scene = worn.resting(garment, 61)
    settings = with_self_contact(SimSettings(), self_thickness)
    rest = worn.rest_by_hemline(garment, settings)
    runs = [Played("hemline", rest.vertices, np.zeros(1), np.zeros(1), {"settle": settings.settle})]
    judges = [engine for engine in engines if engine != "hemline"]
    runs += [played(engine, scene, settings, **_asked(CALM, engine, self_thickness)) for engine in judges]
    return _drape("drape-skirt" if skirt else "drape-cape", scene, runs, pictures)


def run(engines: list[str], *, skirt: bool, self_thickness: float, pictures: Path | None, **_: Any) -> list[Row]:
    """A garment on the shipped run, from the same settled drape."""
    garment = worn.skirt() if skirt else worn.cape()
    settings = with_self_contact(SimSettings(), self_thickness)
    rest = worn.rest_by_hemline(garment, settings)
    scene, ours, lead = worn.running(garment, rest, settings, 45)
    judges = [engine for engine in engines if engine != "hemline"]
    runs = [ours] + [played(engine, scene, settings, **_asked(RUN, engine, self_thickness)) for engine in judges]
    print(f"{scene.name}, {len(scene.vertices)} vertices, {scene.frame_count - lead} frames after a lead-in of {lead}")
    print(DISTANCES + f"{'inside a frame':>15}")
    found = []
    for each in runs:
        frames = each.frames[lead:]
        far = [apart_mm(a, b, scene.faces) for a, b in zip(frames[::5], ours.frames[lead:][::5], strict=True)]
        distance = {name: float(np.mean([one[name] for one in far])) for name in far[0]}
        strains = strain(scene, frames)
        within = vertices_inside(scene, frames, lead) / len(frames)
        print(
            f"{each.engine:<9}{distance['mean']:>14.1f}{distance['p95']:>8.1f}{distance['vertices']:>12.1f}"
            f"{strains['strain_p50']:>12.2f}{strains['strain_p99']:>9.2f}{within:>15.2f}",
            flush=True,
        )
        row = {"scene": scene.name, "engine": each.engine, "distance_mm": distance, "inside_per_frame": within}
        found.append(row | strains | {"asked": each.options})
    if pictures:
        drawn_run(pictures / f"run-{'skirt' if skirt else 'cape'}.webp", scene, runs, lead)
    return found


def sweeps(engines: list[str], *, skirt: bool, **_: Any) -> list[Row]:
    """Newton on the first frames of the run with more and more work a frame: does it come to ours?"""
    if "newton" not in engines:
        return []
    garment = worn.skirt() if skirt else worn.cape()
    settings = with_self_contact(SimSettings(), 0)
    scene, ours, _lead = worn.running(garment, worn.rest_by_hemline(garment, settings), settings, 2)
    start = scene.first(8)
    print(
        f"start of {scene.name}, frame 7: Newton beside ours, "
        f"whose strain p99 is {strain(start, ours.frames[7:8])['strain_p99']:.2f} %"
    )
    print(f"{'steps a frame':>14}{'sweeps a step':>14}{'same vertex mm':>15}{'strain p50, p99 %':>19}")
    found = []
    for steps, count in WORK:
        theirs = played("newton", start, settings, substeps=steps, iterations=count).frames[-1]
        far = 1000 * float(np.linalg.norm(theirs - ours.frames[7], axis=1).mean())
        strains = strain(start, theirs[None])
        print(
            f"{steps:>14}{count:>14}{far:>15.1f}{strains['strain_p50']:>12.2f}{strains['strain_p99']:>7.2f}", flush=True
        )
        row = {"scene": f"start of {scene.name}", "engine": "newton", "steps": steps, "sweeps": count}
        found.append(row | {"distance_mm": far} | strains)
    return found


def _drape(name: str, scene: JudgedScene, runs: list[Played], pictures: Path | None) -> list[Row]:
    print(f"{scene.name}, {len(scene.vertices)} vertices")
    print(DISTANCES + f"{'inside':>8}{'residual':>10}{'by Newton':>10}{'energy mJ':>11}{'still moving mm':>17}")
    found = []
    for each in runs:
        last = each.frames[-1]
        distance = apart_mm(last, runs[0].frames[-1], scene.faces)
        strains, rest = strain(scene, last[None]), left_over(scene, last)
        theirs = left_over_by_newton(scene, last) if present("newton") else float("nan")
        within = vertices_inside(scene, last[None])
        moving = 1000 * float(np.linalg.norm(last - each.frames[-min(10, len(each.frames))], axis=1).mean())
        print(
            f"{each.engine:<9}{distance['mean']:>14.1f}{distance['p95']:>8.1f}{distance['vertices']:>12.1f}"
            f"{strains['strain_p50']:>12.2f}{strains['strain_p99']:>9.2f}{within:>8}{rest['residual']:>10.3f}"
            f"{theirs:>10.3f}{rest['energy_mJ']:>11.1f}{moving:>17.2f}",
            flush=True,
        )
        row = {"scene": scene.name, "engine": each.engine, "distance_mm": distance, "inside": within}
        found.append(row | strains | rest | {"residual_by_newton": theirs, "moving_mm": moving, "asked": each.options})
    if pictures:
        drawn(pictures / f"{name}.png", scene, runs)
    return found


def _asked(table: dict[str, dict[str, Any]], engine: str, self_thickness: float) -> dict[str, Any]:
    return table[engine] | ({} if engine == "hemline" else {"self_thickness": self_thickness})

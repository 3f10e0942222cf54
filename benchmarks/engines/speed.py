"""Times hemline and Blender's cloth in alternation on the same run, at equal edge strain."""

import statistics
from typing import Any

import numpy as np

from benchmarks.engines import garment_scenes
from benchmarks.engines.figures import strain
from benchmarks.engines.play import play_scene, with_self_contact
from hemline.compiled import use_threads
from hemline.sim import SimSettings

Row = dict[str, Any]
QUALITIES = (3, 5, 10, 20, 30)
"""Steps per frame of Blender."""
SUBSTEPS = (2, 4)
"""Steps per frame of hemline."""
FRAMES, TURNS = 30, 3


def rows(engines: list[str], *, skirt: bool, self_thickness: float, **_: Any) -> list[Row]:
    """Times both with one and with two threads, and prints medians and ratios."""
    garment = garment_scenes.skirt() if skirt else garment_scenes.cape()
    base = with_self_contact(SimSettings(), self_thickness)
    use_threads(1)
    rest = garment_scenes.settle(garment, base)
    scene, _, lead = garment_scenes.run_scene(garment, rest, base, FRAMES)
    rows = []
    for threads in (1, 2):
        times: dict[tuple[str, int], list[float]] = {}
        strains: dict[tuple[str, int], float] = {}
        for _turn in range(TURNS):
            for quality in QUALITIES if "blender" in engines else ():
                theirs = play_scene(
                    "blender",
                    scene,
                    base,
                    quality=quality,
                    threads=threads,
                    self_thickness=self_thickness,
                    collision_quality=2,
                )
                net = float(np.median(theirs.ms[lead - 1 :]) - np.median(theirs.ms_without[lead - 1 :]))
                times.setdefault(("blender", quality), []).append(net)
                strains["blender", quality] = strain(scene, theirs.frames[lead:])["strain_p99"]
            use_threads(threads)
            for substeps in SUBSTEPS:
                settings = with_self_contact(SimSettings(substeps=substeps), self_thickness)
                _, mine, _ = garment_scenes.run_scene(garment, rest, settings, FRAMES)
                times.setdefault(("hemline", substeps), []).append(float(np.median(mine.ms[lead:])))
                strains["hemline", substeps] = strain(scene, mine.frames[lead:])["strain_p99"]
        rows += _table(scene.name, threads, times, strains, self_thickness)
    return rows


def _table(scene: str, threads: int, times: dict, strains: dict, self_thickness: float) -> list[Row]:
    print(f"{scene}, {threads} thread{'s' if threads > 1 else ''}, self-contact {1000 * self_thickness:.0f} mm")
    print(f"{'engine':<9}{'steps a frame':>14}{'ms a frame':>12}{'strain p99 %':>14}")
    rows = []
    for (engine, steps), spans in times.items():
        ms = statistics.median(spans)
        print(f"{engine:<9}{steps:>14}{ms:>12.1f}{strains[engine, steps]:>14.2f}")
        rows.append(
            {
                "scene": scene,
                "engine": engine,
                "steps": steps,
                "frame_ms": ms,
                "strain_p99": strains[engine, steps],
                "used_threads": threads,
                "self_thickness": self_thickness,
            }
        )
    blender = [row for row in rows if row["engine"] == "blender"]
    for mine in (row for row in rows if row["engine"] == "hemline") if blender else ():
        as_good = [row for row in blender if row["strain_p99"] <= 1.02 * mine["strain_p99"]]
        against = min(as_good or blender, key=lambda row: row["frame_ms" if as_good else "strain_p99"])
        mine["faster"] = against["frame_ms"] / mine["frame_ms"]
        kind = "as good" if as_good else "its best, which is worse"
        print(
            f"ours with {mine['steps']} substeps: {mine['faster']:.2f} x as fast as Blender with {against['steps']} "
            f"({kind}: p99 {against['strain_p99']:.2f} % against {mine['strain_p99']:.2f} %)"
        )
    return rows

"""Draws the pictures of docs/ground_truth.md, with all engines side by side."""

from pathlib import Path

import numpy as np

from benchmarks.engines.play import EngineRun
from benchmarks.engines.scene import EngineScene
from hemline.pictures import BODY, CLOTH, ShadedSurface, frame_points, render, side_by_side, write_png, write_webp

SIZE = (420, 520)
COLOURS = {"hemline": CLOTH, "blender": (0.86, 0.50, 0.15), "newton": (0.36, 0.55, 0.24)}
NAMES = {"hemline": "hemline", "blender": "Blender's cloth", "newton": "Newton, VBD"}


def draw_drape(path: Path, scene: EngineScene, runs: list[EngineRun]) -> None:
    """Draws the last frames from two sides, one column per engine."""
    last, body = [run.frames[-1] for run in runs], scene.body[-1]
    rows = [_row(scene, runs, last, body, view) for view in ("three_quarter", "back_three_quarter")]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, np.concatenate(rows, axis=0))


def draw_run(path: Path, scene: EngineScene, runs: list[EngineRun], lead: int) -> None:
    """Draws the frames after the lead-in as a moving picture."""
    pictures = [
        _row(scene, runs, [run.frames[frame] for run in runs], scene.body[frame], "back_three_quarter", (280, 380))
        for frame in range(lead, scene.frame_count)
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_webp(path, pictures, scene.fps / 2, quality=60)


def _row(scene: EngineScene, runs: list[EngineRun], cloth: list, body: np.ndarray, view: str, size=SIZE) -> np.ndarray:
    skin = [ShadedSurface(body.astype(np.float32), scene.body_faces, BODY, sheen=0.0)] if len(scene.body_faces) else []
    points = np.concatenate([*cloth, body])
    camera, ground = frame_points(points, view, size=size), float(points[:, 1].min())
    painted = [
        render(
            [*skin, ShadedSurface(each.astype(np.float32), scene.faces, COLOURS[run.engine])],
            camera,
            size,
            ground=ground,
        )
        for run, each in zip(runs, cloth, strict=True)
    ]
    return side_by_side(painted, [NAMES[run.engine] for run in runs])

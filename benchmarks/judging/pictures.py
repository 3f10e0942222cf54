"""The pictures of docs/ground_truth.md: all engines side by side."""

from pathlib import Path

import numpy as np

from benchmarks.judging.engines import Played
from benchmarks.judging.scene import JudgedScene
from hemline.pictures import BODY, CLOTH, ShadedSurface, frame_points, render, side_by_side, write_png, write_webp

SIZE = (420, 520)
COLOURS = {"hemline": CLOTH, "blender": (0.86, 0.50, 0.15), "newton": (0.36, 0.55, 0.24)}
NAMES = {"hemline": "hemline", "blender": "Blender's cloth", "newton": "Newton, VBD"}


def drawn(path: Path, scene: JudgedScene, runs: list[Played]) -> None:
    """The last frames from two sides, one column an engine."""
    last, body = [each.frames[-1] for each in runs], scene.body[-1]
    rows = [_row(scene, runs, last, body, view) for view in ("three_quarter", "back_three_quarter")]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, np.concatenate(rows, axis=0))


def drawn_run(path: Path, scene: JudgedScene, runs: list[Played], lead: int) -> None:
    """A moving picture of the frames after the lead-in."""
    pictures = [
        _row(scene, runs, [each.frames[frame] for each in runs], scene.body[frame], "back_three_quarter", (280, 380))
        for frame in range(lead, scene.frame_count)
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_webp(path, pictures, scene.fps / 2, quality=60)


def _row(scene: JudgedScene, runs: list[Played], cloth: list, body: np.ndarray, view: str, size=SIZE) -> np.ndarray:
    skin = [ShadedSurface(body.astype(np.float32), scene.body_faces, BODY, sheen=0.0)] if len(scene.body_faces) else []
    points = np.concatenate([*cloth, body])
    camera, ground = frame_points(points, view, size=size), float(points[:, 1].min())
    painted = [
        render([*skin, ShadedSurface(each.astype(np.float32), scene.faces, COLOURS[run.engine])], camera, size, ground=ground)
        for run, each in zip(runs, cloth, strict=True)
    ]
    return side_by_side(painted, [NAMES[run.engine] for run in runs])

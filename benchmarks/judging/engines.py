"""The three engines behind one call: ours in this process, the judges in environments of their own."""

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judging.scene import JudgedScene
from hemline.meshes import vertex_normals
from hemline.sim import BodySurface, MovingSkin, Scene, SimSettings, Stepper

HERE = Path(__file__).parent
ENVIRONMENTS = {"blender": "HEMLINE_BLENDER_PYTHON", "newton": "HEMLINE_NEWTON_PYTHON"}
"""Environment variables that name each judge's Python; `docs/ground_truth.md` says how to make them."""
DEFAULTS: dict[str, dict[str, Any]] = {
    "blender": {
        "quality": 10,
        "collision_quality": 3,
        "air_damping": 0.0,
        "damping": 0.0,
        "self_thickness": 0.0,
        "threads": 1,
    },
    "newton": {"substeps": 20, "iterations": 20, "kept_speed": 1.0, "self_thickness": 0.0},
}
TIGHT = SimSettings(self_contact=False, residual_share=0.03, solver_share=0.05, newton_steps=12)
"""Our solver with little left over, so that its model is judged and not its haste."""
RESTING = SimSettings(self_contact=False, residual_share=0.05, solver_share=0.05, newton_steps=12, substeps=2)
"""For drapes, where long steps lose energy sooner."""


@dataclass(frozen=True)
class Played:
    """What an engine made of a scene.

    Attributes:
        engine: `hemline`, `blender` or `newton`.
        frames: Positions (frames, verts, 3) [m].
        ms: Time of each frame after the first [ms].
        ms_without: The same with the cloth switched off: playing and reading alone [ms].
        options: What it was asked.
    """

    engine: str
    frames: np.ndarray
    ms: np.ndarray
    ms_without: np.ndarray
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def frame_ms(self) -> float:
        """Median time of the cloth in a frame [ms]."""
        return float(np.median(self.ms) - np.median(self.ms_without))


def present(engine: str) -> bool:
    """Whether an engine can be called."""
    return engine == "hemline" or bool(os.environ.get(ENVIRONMENTS[engine]))


def played(engine: str, scene: JudgedScene, settings: SimSettings | None = None, **options: Any) -> Played:
    """Play a scene in an engine.

    Args:
        engine: `hemline`, `blender` or `newton`.
        scene: What to play.
        settings: Gravity, thickness, contact for all; substeps and tolerances for ours.
        options: For a judge: in the place of those of `DEFAULTS`. For ours: `kept_speed`, the share of the velocity
            that outlives a frame.

    Raises:
        RuntimeError: The judge failed.
    """
    settings = settings or TIGHT
    if engine == "hemline":
        return ours(scene, settings, **options)
    asked = DEFAULTS[engine] | options
    with tempfile.TemporaryDirectory() as folder:
        given, got = Path(folder) / "scene.npz", Path(folder) / "played.npz"
        scene.write(given, settings)
        command = [os.environ[ENVIRONMENTS[engine]], str(HERE / f"{engine}_cloth.py"), str(given), str(got)]
        done = subprocess.run([*command, json.dumps(asked)], capture_output=True, text=True, check=False)
        if done.returncode or not got.exists():
            raise RuntimeError(f"{engine} failed on '{scene.name}': {done.stderr[-1500:]}")
        with np.load(got) as arrays:
            return Played(engine, arrays["frames"], arrays["ms"][1:], arrays["ms_without"][1:], asked)


def ours(scene: JudgedScene, settings: SimSettings, *, kept_speed: float = 1.0, threads: int = 1) -> Played:
    """Play a scene with our stepper: body and pins go straight from frame to frame, no projection."""
    from hemline.compiled import use_threads

    use_threads(threads)
    surface = BodySurface(scene.body_faces, reach=settings.contact_reach) if len(scene.body_faces) else None
    stepper = Stepper(scene.sheet, pinned=scene.pins, surface=surface, settings=settings)
    state, frames, ms = stepper.start(scene.vertices), [scene.vertices], []
    h = 1 / scene.fps / settings.substeps
    for frame in range(1, scene.frame_count):
        began = time.perf_counter()
        moving = _Moving(scene, frame)
        for step in range(settings.substeps):
            scene_at = moving.within(step / settings.substeps, 1 / settings.substeps)
            state, _ = stepper.advance(state, h, scene_at)
        state = replace(state, velocities=kept_speed * state.velocities)
        ms.append(1000 * (time.perf_counter() - began))
        frames.append(state.positions)
    options = {"substeps": settings.substeps, "residual_share": settings.residual_share, "threads": threads}
    return Played("hemline", np.array(frames, np.float32), np.array(ms), np.zeros(len(ms)), options)


class _Moving:
    """A scene on the way to a frame; moments are kept, as each step ends where the next begins."""

    def __init__(self, scene: JudgedScene, frame: int):
        self.scene, self.frame = scene, frame
        self.known: dict[float, Scene] = {}

    def within(self, begin: float, length: float) -> Callable[[float], Scene]:
        """The scene at a share of a step, which is a share of the frame itself."""
        return lambda share: self.at(round(begin + share * length, 9))

    def at(self, share: float) -> Scene:
        """The scene at a share of the frame."""
        if share not in self.known:
            scene, frame = self.scene, self.frame
            pinned = (1 - share) * scene.pinned[frame - 1] + share * scene.pinned[frame]
            skin = None
            if len(scene.body_faces):
                body = ((1 - share) * scene.body[frame - 1] + share * scene.body[frame]).astype(np.float32)
                skin = MovingSkin(body, vertex_normals(body, scene.body_faces))
            self.known[share] = Scene(pinned, skin)
        return self.known[share]

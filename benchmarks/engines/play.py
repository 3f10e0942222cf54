"""Plays a scene in one of three engines: hemline in this process, the others in environments of their own."""

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

from benchmarks.engines.scene import EngineScene
from hemline.meshes import vertex_normals
from hemline.sim import BodySurface, MovingSkin, SimSettings, Stepper, StepScene

HERE = Path(__file__).parent
ENVIRONMENTS = {"blender": "HEMLINE_BLENDER_PYTHON", "newton": "HEMLINE_NEWTON_PYTHON"}
"""Environment variables that name the Python of each reference engine; see `docs/ground_truth.md`."""
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
TIGHT_SETTINGS = SimSettings(self_contact=False, residual_share=0.03, solver_share=0.05, newton_steps=12)
"""Settings of hemline with a small residual, so that the model is compared and not the tolerance."""
DRAPE_SETTINGS = SimSettings(self_contact=False, residual_share=0.05, solver_share=0.05, newton_steps=12, substeps=2)
"""Settings of hemline for drapes, with long steps that lose energy sooner."""


@dataclass(frozen=True)
class EngineRun:
    """Result of playing a scene in an engine.

    Attributes:
        engine: `hemline`, `blender` or `newton`.
        frames: Positions (frames, verts, 3) [m].
        ms: Time of each frame after the first [ms].
        ms_without: Time of each frame without cloth, for playback and reading alone [ms].
        options: Options of the run.
    """

    engine: str
    frames: np.ndarray
    ms: np.ndarray
    ms_without: np.ndarray
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def frame_ms(self) -> float:
        """Median time of the cloth per frame [ms]."""
        return float(np.median(self.ms) - np.median(self.ms_without))


def is_available(engine: str) -> bool:
    """Returns whether an engine is installed."""
    return engine == "hemline" or bool(os.environ.get(ENVIRONMENTS[engine]))


def play_scene(engine: str, scene: EngineScene, settings: SimSettings | None = None, **options: Any) -> EngineRun:
    """Plays a scene in an engine.

    Args:
        engine: `hemline`, `blender` or `newton`.
        scene: The scene.
        settings: Gravity, thickness and contact for all engines; substeps and tolerances for hemline.
        options: Replace those of `DEFAULTS` for a reference engine. hemline has `kept_speed`, the fraction of the
            velocity that remains after each frame.

    Raises:
        RuntimeError: The reference engine failed.
    """
    settings = settings or TIGHT_SETTINGS
    if engine == "hemline":
        return play_hemline(scene, settings, **options)
    settings_of_engine = DEFAULTS[engine] | options
    with tempfile.TemporaryDirectory() as folder:
        source, result = Path(folder) / "scene.npz", Path(folder) / "played.npz"
        scene.write(source, settings)
        command = [os.environ[ENVIRONMENTS[engine]], str(HERE / f"{engine}_cloth.py"), str(source), str(result)]
        done = subprocess.run([*command, json.dumps(settings_of_engine)], capture_output=True, text=True, check=False)
        if done.returncode or not result.exists():
            raise RuntimeError(f"{engine} failed on '{scene.name}': {done.stderr[-1500:]}")
        with np.load(result) as arrays:
            return EngineRun(engine, arrays["frames"], arrays["ms"][1:], arrays["ms_without"][1:], settings_of_engine)


def play_hemline(scene: EngineScene, settings: SimSettings, *, kept_speed: float = 1.0, threads: int = 1) -> EngineRun:
    """Plays a scene with our stepper; body and pins are interpolated linearly, and there is no projection."""
    from hemline.compiled import use_threads

    use_threads(threads)
    surface = BodySurface(scene.body_faces, reach=settings.contact_reach) if len(scene.body_faces) else None
    stepper = Stepper(scene.sheet, pinned=scene.pins, surface=surface, settings=settings)
    state, frames, ms = stepper.start(scene.vertices), [scene.vertices], []
    h = 1 / scene.fps / settings.substeps
    for frame in range(1, scene.frame_count):
        began = time.perf_counter()
        moving = _SceneMotion(scene, frame)
        for step in range(settings.substeps):
            scene_at = moving.within(step / settings.substeps, 1 / settings.substeps)
            state, _ = stepper.advance(state, h, scene_at)
        state = replace(state, velocities=kept_speed * state.velocities)
        ms.append(1000 * (time.perf_counter() - began))
        frames.append(state.positions)
    options = {"substeps": settings.substeps, "residual_share": settings.residual_share, "threads": threads}
    return EngineRun("hemline", np.array(frames, np.float32), np.array(ms), np.zeros(len(ms)), options)


class _SceneMotion:
    """Scene between two frames. Moments are cached, as each step ends where the next one begins."""

    def __init__(self, scene: EngineScene, frame: int):
        self.scene, self.frame = scene, frame
        self.cache: dict[float, StepScene] = {}

    def within(self, begin: float, length: float) -> Callable[[float], StepScene]:
        """Returns the scene as a function of the fraction of a step within the frame."""
        return lambda fraction: self.at(round(begin + fraction * length, 9))

    def at(self, fraction: float) -> StepScene:
        """Returns the scene at a fraction of the frame."""
        if fraction not in self.cache:
            scene, frame = self.scene, self.frame
            pinned = (1 - fraction) * scene.pinned[frame - 1] + fraction * scene.pinned[frame]
            skin = None
            if len(scene.body_faces):
                body = ((1 - fraction) * scene.body[frame - 1] + fraction * scene.body[frame]).astype(np.float32)
                skin = MovingSkin(body, vertex_normals(body, scene.body_faces))
            self.cache[fraction] = StepScene(pinned, skin)
        return self.cache[fraction]


def with_self_contact(settings: SimSettings, thickness: float) -> SimSettings:
    """Returns the settings with self-contact of a thickness [m]; 0 switches it off."""
    if thickness > 0:
        return replace(settings, self_contact=True, self_thickness=thickness)
    return replace(settings, self_contact=False)

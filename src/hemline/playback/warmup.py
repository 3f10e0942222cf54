"""Run each stage once on what ships, so that numba compiles and caches it."""

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

from hemline import animators, bodies, export, garments, motions, sim
from hemline.collide.winding.numbers import inside

from .play import play
from .player import Player
from .record import record


@cache
def _animator():
    return animators.load("cape")


def _playback() -> None:
    cape = _animator()
    body = bodies.load(cape.body_name).shaped()
    frames = list(play(cape, body, motions.load("run")[:8], untangle=True))
    Player.prepare(cape, body, detail=0.25)
    posed = frames[-1].body
    inside(posed.vertices, body.body.faces, frames[-1].vertices)


def _pictures() -> None:
    cape = _animator()
    body = bodies.load(cape.body_name).shaped()
    motion = motions.load("run")[:2]
    clip = record(
        play(cape, body, motion), garment_name="cape", garment_faces=cape.garment.faces, motion=motion, fps=30
    )
    with tempfile.TemporaryDirectory() as folder:
        export.write(Path(folder) / "warm.png", clip)


def _simulation() -> None:
    garment = garments.load("cape-light")
    body = bodies.load(garment.body_name).shaped()
    motion = body.placed(motions.load("run").resampled(30))[:2]
    rest = sim.rest_drape(garment, body, sim.SimSettings())
    sim.simulate(garment, body, motion, sim.SimSettings(), start=rest)


STAGES: dict[str, Callable[[], None]] = {"playback": _playback, "pictures": _pictures, "simulation": _simulation}

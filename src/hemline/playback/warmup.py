"""Runs each part of the package once, so that numba compiles its kernels and caches them on disk."""

import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

from hemline import animators, bodies, export, garments, motions, sim
from hemline.animators import Animator
from hemline.animators.own_body import own_body
from hemline.collide.winding.numbers import inside
from hemline.compiled import at_most
from hemline.playback.player.player import Player
from hemline.tryon import open_garment

from .play import play
from .record import record

SMALL_GARMENT = "close-top:3@50"
"""Garment that is tried on and settled."""


@cache
def _animator():
    return animators.load("cape")


def _playback() -> None:
    cape = _animator()
    body = own_body(cape).shaped()
    frames = list(play(cape, body, motions.load("run")[:8], untangle=True))
    Player.prepare(cape, body, detail=0.25)
    posed = frames[-1].body
    inside(posed.vertices, body.body.faces, frames[-1].vertices)


def _pictures() -> None:
    cape = _animator()
    body = own_body(cape).shaped()
    motion = motions.load("run")[:2]
    clip = record(
        play(cape, body, motion), garment_name="cape", garment_faces=cape.garment.faces, motion=motion, fps=30
    )
    with tempfile.TemporaryDirectory() as folder:
        export.write(Path(folder) / "warm.png", clip)


def _simulation() -> None:
    garment = garments.load("cape-light")
    body = bodies.load("anny24").shaped()
    motion = body.placed(motions.load("run").resample(30))[:2]
    rest = sim.rest_drape(garment, body, sim.SimSettings())
    sim.simulate(garment, body, motion, sim.SimSettings(), start=rest)


def _close_fitting() -> None:
    _warm(animators.load("tshirt-light"))


def _any_garment() -> None:
    body = bodies.load("anny24").shaped()
    for name in ("lag", "live", "skinned", "swingar"):
        model = animators.load(name)
        assert isinstance(model, animators.Wearable)
        _warm(model.animator_for(garments.load("tshirt-light"), body))


def _warm(animator: Animator | animators.Wearable) -> None:
    assert isinstance(animator, Animator)
    Player.prepare(animator, bodies.load("anny24").shaped()).warm_up(motions.load("run")[0])


def _trying_on() -> None:
    open_garment(SMALL_GARMENT, bodies.load("anny24").shaped(), tryon="always")


def _drapes() -> None:
    garment = garments.load(SMALL_GARMENT)
    pose = bodies.load(garment.body_name).shaped().rest_pose
    with tempfile.TemporaryDirectory() as folder:
        sim.produce_posed(folder, garment, [[pose]], [(1.0,)], turns=[0], jobs=1)


def _simulation_on_one_thread() -> None:
    with at_most(1):
        _simulation()


STAGES: dict[str, Callable[[], None]] = {
    "simulation": _simulation,
    "simulation, one thread": _simulation_on_one_thread,
    "playback": _playback,
    "pictures": _pictures,
    "close-fitting": _close_fitting,
    "any garment": _any_garment,
    "drapes": _drapes,
    "trying on": _trying_on,
}
"""Parts to run, the longest first, so that processes that share them finish together."""


def run_stage(name: str) -> float:
    """Runs a part; returns the time that it took [s].

    Args:
        name: One of `STAGES`.
    """
    began = time.perf_counter()
    STAGES[name]()
    return time.perf_counter() - began

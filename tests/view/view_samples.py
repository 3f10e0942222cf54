"""Stages that are quick to make: the shipped T-shirt on a short stretch of a clip, a made take."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np

from hemline import animators, bodies, datasets, motions
from hemline.bodies import ShapedBody
from hemline.datasets import Take
from hemline.motions import Motion
from hemline.view import Catalog, Page, PlayedClip, Stage

FPS = 30.0


@cache
def shirt():
    return animators.load("tshirt-light")


@cache
def body() -> ShapedBody:
    return bodies.load("anny24").shaped()


@cache
def clip() -> Motion:
    return motions.load("walk")[:20]


def stage(betas: tuple[float, ...] = ()) -> Stage:
    return Stage(PlayedClip.on(shirt(), body().body.shaped(betas), clip(), fps=FPS))


@cache
def take() -> Take:
    """What the shirt plays, a centimetre too high, as if it were simulated."""
    motion = body().placed(clip())[:4]
    rest = shirt().garment.vertices + np.float32([0, 0.01, 0])
    count = len(motion)
    return Take(
        "clip",
        np.repeat(rest[None], count, axis=0),
        motion,
        np.zeros(0, np.float32),
        np.zeros(count, bool),
        np.zeros(count, np.int32),
        {},
        {"garment": shirt().garment.hash, "clip": "walk", "subject": "35", "part": 0},
    )


def catalog(folder=None) -> Catalog:
    """The shirt, two clips, and where a folder is given a take in a dataset there."""
    held = ()
    if folder is not None:
        held = (datasets.create(folder, shirt().garment),)
        held[0].add(take())
    return Catalog({"shirt": shirt}, {"walk": clip, "turn": lambda: motions.load("turn")[:12]}, held)


@contextmanager
def serving(page: Page) -> Iterator[Page]:
    """A page that plays in a thread, which is waited for at the end."""
    thread = threading.Thread(target=page.serve_forever)
    thread.start()
    try:
        yield page
    finally:
        page.close()
        thread.join(30)
        assert not thread.is_alive()

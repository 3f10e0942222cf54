"""Garments to carry and to simulate in real time, small enough for seconds."""

from dataclasses import replace
from functools import cache

import numpy as np

from hemline import bodies, garments
from hemline.animators.live import AnimatorLive, Live, LiveConfig
from hemline.garments import Garment, coarser_garment

SMALL = LiveConfig(fewest=150, most=200)


@cache
def body():
    return bodies.load("anny24").shaped()


@cache
def skirt() -> Garment:
    return garments.load("skirt-light")


@cache
def live_cape() -> AnimatorLive:
    """The light cape of 700 vertices, simulated with 200."""
    cape, _ = coarser_garment(garments.load("cape-light"), 0.175)
    return Live(SMALL).animator_for(cape, body())


@cache
def exact_cape() -> AnimatorLive:
    """The light cape of 700 vertices, simulated with 200 by the offline simulator."""
    return Live(LiveConfig(fewest=150, most=200, quality="exact")).animator_for(live_cape().garment, body())


@cache
def two_sheets() -> tuple[Garment, Garment, np.ndarray]:
    """Two flat squares on each other, and every other row and column of them."""
    size, step = 13, 0.01
    grid = np.stack(np.meshgrid(np.arange(size), np.arange(size), indexing="ij"), axis=-1).reshape(-1, 2)
    one = np.concatenate([step * grid, np.zeros((len(grid), 1))], axis=1)
    fine = np.concatenate([one, one + [0, 0, 0.001]])
    kept = np.flatnonzero((np.concatenate([grid, grid]) % 3 == 0).all(axis=1))
    few = len(range(0, size, 3))
    return _sheet(fine, size), _sheet(fine[kept], few), kept


def _sheet(vertices: np.ndarray, size: int) -> Garment:
    corner = np.arange(size * (size - 1)).reshape(size - 1, size)[:, :-1].reshape(-1)
    one = np.stack([corner, corner + size, corner + 1], axis=1)
    two = np.stack([corner + 1, corner + size, corner + size + 1], axis=1)
    faces = np.concatenate([one, two])
    faces = np.concatenate([faces, faces + size * size]).astype(np.int32)
    corners = vertices[faces][:, :, :2]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    return replace(
        skirt(), vertices=vertices.astype(np.float32), faces=faces, rest_edges=edges, pins=_no_pins(), chains=()
    )


def _no_pins():
    pins = skirt().pins
    return replace(pins, **{name: getattr(pins, name)[:0] for name in vars(pins)})

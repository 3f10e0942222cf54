"""Scenes of sheets with closed-form motion, and of a sheet on a ball."""

from dataclasses import replace

import numpy as np
from scipy.special import j0, jn_zeros

from benchmarks.engines.scene import EngineScene
from hemline.sim import Elastic

COTTON = Elastic(density=0.15, young=120.0, poisson=0.3, bending=6e-6, damping=0.003, friction=0.4)
"""Shipped cotton without air drag, which Blender and Newton do not model in this form."""
NO_BODY, NO_FACES = np.zeros((0, 3)), np.zeros((0, 3), np.int32)


def cut_rectangle(across: int, along: int, width: float, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cuts a flat rectangle with alternating diagonals; returns flat coordinates, faces and rest edges."""
    u, v = np.meshgrid(np.linspace(0, width, across), np.linspace(0, length, along), indexing="ij")
    number = np.arange(across * along).reshape(across, along)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    even = (np.indices(a.shape).sum(axis=0) % 2 == 0)[..., None]
    first = np.where(even, np.stack([a, b, c], -1), np.stack([a, b, d], -1)).reshape(-1, 3)
    second = np.where(even, np.stack([a, c, d], -1), np.stack([b, c, d], -1)).reshape(-1, 3)
    flat, faces = np.stack([u.ravel(), v.ravel()], 1), np.concatenate([first, second]).astype(np.int32)
    return flat, faces, np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)


def hanging(name: str, size: tuple[int, int, float, float], elastic: Elastic, frames: int, tilt: float) -> EngineScene:
    """Makes a rectangle fixed at its upper edge, at an angle to the vertical.

    Args:
        name: Name in tables.
        size: Vertices across and along, width and length [m].
        elastic: Material.
        frames: Number of frames.
        tilt: Angle to the vertical [rad]; pi / 2 is horizontal.
    """
    flat, faces, rest = cut_rectangle(*size)
    x = np.stack([flat[:, 0], -flat[:, 1] * np.cos(tilt), flat[:, 1] * np.sin(tilt)], axis=1)
    top = np.flatnonzero(flat[:, 1] == 0)
    return _bare(name, x, faces, rest, elastic, top).still(frames)


def swaying(frames: int, out: float = 0.02, length: float = 0.5) -> EngineScene:
    """Makes a hanging sheet in the slowest mode of a chain, J0(j sqrt(s / L)) at a height s above the lower end.

    Args:
        frames: Number of frames.
        out: Displacement of the lower edge [m].
        length: Length of the sheet [m].
    """
    flat, faces, rest = cut_rectangle(9, 33, 0.25, length)
    s, first = np.linspace(0, length, 2001), jn_zeros(0, 1)[0]
    curve = out * j0(first * np.sqrt((length - s) / length))
    fallen = np.concatenate([[0], np.cumsum(np.sqrt((s[1] - s[0]) ** 2 - np.diff(curve) ** 2))])
    x = np.stack([flat[:, 0], -np.interp(flat[:, 1], s, fallen), np.interp(flat[:, 1], s, curve)], axis=1)
    elastic = Elastic(density=0.15, young=300.0, poisson=0.0, bending=1e-8)
    at_rest = np.stack([flat[:, 0], -flat[:, 1], 0 * flat[:, 0]], axis=1)
    scene = _bare("swaying sheet", x, faces, rest, elastic, np.flatnonzero(flat[:, 1] == 0)).still(frames)
    return replace(scene, rest_vertices=at_rest)


def falling(frames: int) -> EngineScene:
    """Makes a free square."""
    flat, faces, rest = cut_rectangle(9, 9, 0.4, 0.4)
    x = np.stack([flat[:, 0], 0 * flat[:, 0], flat[:, 1]], axis=1)
    return _bare("falling square", x, faces, rest, COTTON, np.zeros(0, int)).still(frames)


def cantilever(name: str, frames: int, bending: float, *, even: bool, cell: float) -> EngineScene:
    """Makes a strip of 10 cm width, clamped horizontally over 10 mm at one end.

    Args:
        name: Name in tables.
        frames: Number of frames.
        bending: Bending stiffness [N m].
        even: Whether triangles are equilateral; otherwise squares are cut in two.
        cell: Distance between rows [m].
    """
    across, along = round(0.1 / cell) + 1, round(0.32 / cell) + 1
    flat, faces, rest = cut_rectangle(across, along, 0.1, 0.32)
    if even:
        row = np.round(flat[:, 1] / cell).astype(int)
        flat = flat * (2 / np.sqrt(3), 1) + np.stack([(row % 2) * cell / np.sqrt(3), 0 * row], axis=1)
        number = np.arange(across * along).reshape(across, along)
        a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        odd = (np.indices(a.shape)[1] % 2 == 1)[..., None]
        first = np.where(odd, np.stack([a, b, c], -1), np.stack([a, b, d], -1)).reshape(-1, 3)
        second = np.where(odd, np.stack([a, c, d], -1), np.stack([b, c, d], -1)).reshape(-1, 3)
        faces = np.concatenate([first, second]).astype(np.int32)
        rest = np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)
    x = np.stack([flat[:, 0], 0 * flat[:, 0], flat[:, 1]], axis=1)
    elastic = Elastic(density=0.15, young=500.0, poisson=0.0, bending=bending, damping=0.003)
    return _bare(name, x, faces, rest, elastic, np.flatnonzero(flat[:, 1] < 0.0101)).still(frames)


def on_a_ball(count: int, frames: int, *, size: float = 0.8, radius: float = 0.2) -> EngineScene:
    """Makes a square of cotton that falls onto a ball."""
    import trimesh

    flat, faces, rest = cut_rectangle(count, count, size, size)
    x = np.stack([flat[:, 0] - size / 2, np.full(len(flat), radius + 0.01), flat[:, 1] - size / 2], axis=1)
    ball = trimesh.creation.icosphere(4, radius)
    body = np.repeat(np.asarray(ball.vertices)[None], frames, axis=0)
    return EngineScene(
        "square on a ball",
        x,
        faces,
        rest,
        x,
        COTTON,
        np.zeros((frames, 0, 3)),
        np.zeros(0, int),
        body,
        np.asarray(ball.faces, np.int32),
    )


def _bare(name, x, faces, rest, elastic, pins) -> EngineScene:
    return EngineScene(name, x, faces, rest, x, elastic, x[pins][None], pins, NO_BODY[None], NO_FACES)

"""A small cape that sways by a formula, for tests of the learning part."""

import numpy as np

from hemline.animators.ropes.bones.body_inputs import BODY_INPUT_COUNT, REST_INPUTS
from hemline.animators.ropes.fit.frames import KeyFrames

ROWS, COLUMNS = 20, 15
VERTICES = ROWS * COLUMNS
NODES = np.array([r * COLUMNS + c for c in (1, 5, 9, 13) for r in (0, 5, 10, 15, 19)])
"""Bones are vertices here: four chains of five."""


def grid() -> tuple[np.ndarray, np.ndarray]:
    """Rest vertices (300, 3) [m] of a sheet that hangs down, and its triangles."""
    down, across = np.meshgrid(np.linspace(0, 1, ROWS), np.linspace(-0.4, 0.4, COLUMNS), indexing="ij")
    vertices = np.stack([across, 1.4 - down, -0.15 - 0.05 * down], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(ROWS - 1)[:, None] * COLUMNS + np.arange(COLUMNS - 1)).reshape(-1)
    one = np.stack([corner, corner + COLUMNS, corner + 1], axis=1)
    two = np.stack([corner + 1, corner + COLUMNS, corner + COLUMNS + 1], axis=1)
    return vertices, np.concatenate([one, two]).astype(np.int32)


def sway(clip: int, frames: int) -> np.ndarray:
    """Displacements (frames, verts, 3) [m] of one clip: a swing, a twist and a wave that grow towards the hem."""
    rest, _ = grid()
    random = np.random.default_rng(clip)
    down, across = (1.4 - rest[:, 1]) ** 1.5, rest[:, 0]
    t = np.arange(frames)[:, None] / 30 + random.uniform(0, 9)
    swing = 0.3 * np.sin(random.uniform(2, 5) * t) * down
    side = 0.15 * np.sin(random.uniform(2, 5) * t + 1) * down
    twist = 0.2 * np.sin(random.uniform(2, 5) * t + 2) * down * across
    wave = 0.04 * down * np.sin(8 * across + 6 * t)
    lift = -0.5 * (swing**2 + side**2)
    return np.stack([side, lift, swing + twist + wave], axis=-1).astype(np.float32)


def swaying_bodies(clip: np.ndarray, frames: int) -> np.ndarray:
    """What the bone correction sees of the body (frames, 60), by a formula: it turns at its own pace in each clip."""
    t = np.tile(np.arange(frames) / 30, len(clip) // frames)
    pace = 1 + 0.3 * (clip % 7)
    waves = np.sin(pace[:, None] * t[:, None] + np.arange(BODY_INPUT_COUNT))
    return (REST_INPUTS + 0.5 * waves).astype(np.float32)


def swaying_frames(clips: int = 10, frames: int = 60, *, order: np.ndarray | None = None) -> KeyFrames:
    """Frames of several clips: eight in ten to train, one to validate, one to test."""
    displacements = np.concatenate([sway(clip, frames) for clip in range(clips)])
    clip = np.repeat(np.arange(clips), frames)
    order = np.arange(len(displacements)) if order is None else order
    bones = displacements[:, NODES]
    free = np.ones((len(NODES), 3), np.float32)
    free[::5] = 0
    return KeyFrames(
        displacements=displacements.reshape(len(clip), -1)[order],
        bones=np.ascontiguousarray(bones.reshape(len(clip), -1)[order]),
        rope_bones=np.ascontiguousarray(bones.reshape(len(clip), -1)[order]),
        body=swaying_bodies(clip, frames)[order],
        free=free.reshape(-1),
        side=np.where(clip % 10 < 8, 0, clip % 10 - 7)[order].astype(np.int32),
        take=clip[order].astype(np.int32),
        mark=f"swaying {clips} {frames}",
    )

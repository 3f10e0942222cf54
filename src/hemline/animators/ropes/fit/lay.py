"""The ropes of a dataset's garment: laid out, and calibrated on the clips to train on."""

from dataclasses import replace

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.config import RopesConfig
from hemline.animators.ropes.layout.layout import lay_out
from hemline.arrays import FramesOfVertices, Vertices
from hemline.bodies.body import ShapedBody
from hemline.datasets import Row
from hemline.learning.key_frame import to_key
from hemline.motions import JOINT_NAMES

from .calibrate import Clip, bone_error_mm, calibrated
from .gather import Source

WINDOW_SECONDS, SHORTEST = 2.0, 1.0
"""Windows to which constants are fitted, and the shortest clips from which they are taken [s]."""
MOST_CLIPS = 12
"""Clips that the constants are fitted to."""
MOST_FRAMES = 80
"""Frames that a skinning decomposition looks at."""


def ropes_for(
    source: Source, shaped: ShapedBody, rest: Vertices, config: RopesConfig, progress: Progress | None
) -> tuple[Ropes, dict[str, float]]:
    """Lay ropes on the garment of a dataset and bring their constants close to the simulation.

    Args:
        source: The takes.
        shaped: The body on the shape that the garment was made on.
        rest: The settled drape on it [m].
        config: Options.
        progress: Called with stage, steps done and steps in all.

    Returns:
        The ropes, and the mean distance of their bones to the ground truth over windows of `WINDOW_SECONDS` on their
        own, on the clips to train on and on the others [mm]; clips shorter than that say nothing.
    """
    strain = float(np.median([row.figures.get("edge_strain_p99", 0.02) for row in source.rows]))
    garment = source.dataset.garment
    ropes = lay_out(
        garment if config.layout == "auto" else replace(garment, chains=()),
        shaped,
        rest=rest,
        chain_count=config.chains,
        bone_counts=(config.chain_bones - 1, config.chain_bones + 1),
        strain_p99=strain,
        frames=spread_frames(source, shaped) if config.layout == "ssdr" else None,
    )
    train = _clips(source, ropes, shaped, train=True)
    if config.calibrate and train:
        ropes = calibrated(
            ropes,
            shaped,
            train,
            window_seconds=_window(train),
            gradient_steps=config.gradient_steps,
            progress=progress,
        )
    figures = {}
    for name, clips in (("train", train), ("held_out", _clips(source, ropes, shaped, train=False))):
        if clips:
            figures[f"{name}_ropes_mm"] = bone_error_mm(ropes, shaped, clips, window_seconds=_window(clips))
    return ropes, figures


def spread_frames(source: Source, shaped: ShapedBody) -> FramesOfVertices:
    """Frames of the takes to train on, spread evenly over them, the motion of the key joint taken off [m]."""
    key = JOINT_NAMES.index(source.dataset.garment.key_joint)
    rows = _rows(source, shaped, train=True)
    each = max(1, MOST_FRAMES // len(rows))
    found = []
    for row in rows:
        take = source.dataset.take(row)
        some = take.clip_frames[np.linspace(0, len(take.clip_frames) - 1, min(each, row.clip_frames)).astype(int)]
        transforms, _ = shaped.transforms_of(take.motion.rotations[some], take.motion.translations[some])
        found += [to_key(at[key].astype(np.float64), take.vertices[i]) for at, i in zip(transforms, some, strict=True)]
    return np.array([found[i] for i in np.linspace(0, len(found) - 1, min(MOST_FRAMES, len(found))).astype(int)])


def _window(clips: list[Clip]) -> float:
    """Length of the windows: no longer than the longest clip has room for [s]."""
    return min(WINDOW_SECONDS, max((len(motion) - 2) / motion.fps for motion, _ in clips))


def _clips(source: Source, ropes: Ropes, shaped: ShapedBody, *, train: bool) -> list[Clip]:
    """Poses and simulated bones of takes on this shape, spread evenly over the dataset."""
    rows = _rows(source, shaped, train=train)
    found = []
    for index in np.unique(np.linspace(0, len(rows) - 1, min(MOST_CLIPS, len(rows))).astype(int)):
        take = source.dataset.take(rows[index])
        first = int(take.clip_frames[0])
        motion = take.motion[first:]
        if len(motion) > SHORTEST * motion.fps + 1:
            found.append((motion, ropes.embedded(take.vertices[first:])))
    return found


def _rows(source: Source, shaped: ShapedBody, *, train: bool) -> list[Row]:
    """The takes on this shape to train on, or the others."""
    return [
        row
        for row, side in zip(source.rows, source.sides, strict=True)
        if (side == 0) is train and np.array_equal(source.shaped[source.shape_of(row)].betas, shaped.betas)
    ]

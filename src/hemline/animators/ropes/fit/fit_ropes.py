"""Building of the ropes of a dataset's garment, and their calibration on the clips to train on."""

import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.config import RopesConfig
from hemline.animators.ropes.layout.fault import layout_fault
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.animators.ropes.layout.plan import FramesInKey
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.arrays import FramesOfVertices, Vertices
from hemline.bodies.body import ShapedBody
from hemline.datasets import Row
from hemline.errors import BadDataset, BadGarment, HemlineWarning
from hemline.garments.garment import Garment
from hemline.learning.key_frame import to_key_frame
from hemline.motions import JOINT_NAMES

from .air import air_density_of
from .calibrate import Clip, bone_error_mm, calibrate
from .gather import TakeFrames

WINDOW_SECONDS, SHORTEST_CLIP_SECONDS = 1.3, 1.0
"""Length of the windows to which constants are fitted, and of the shortest clips from which they are taken [s]."""
MAX_CLIPS = 24
"""Largest number of clips that the constants are fitted to."""
MAX_SAMPLED_FRAMES = 80
"""Largest number of frames that show where cloth swings, and where it follows the body."""


def fit_ropes(
    source: TakeFrames, shaped: ShapedBody, rest: Vertices, config: RopesConfig, progress: Progress | None
) -> tuple[Ropes, dict[str, float]]:
    """Builds ropes on the garment of a dataset and fits their constants to the simulation.

    Args:
        source: The takes.
        shaped: The body on the shape that the garment was made on.
        rest: The settled drape on it [m].
        config: Options.
        progress: Called with stage, steps done and steps in all.

    Returns:
        The ropes, and the mean distance of their bones to the ground truth over windows of `WINDOW_SECONDS`, on the
        clips to train on and on the others [mm]. Shorter clips are ignored.

    Raises:
        BadDataset: Bones are laid by a decomposition, and no take is on that shape of the body.
    """
    strain = float(np.median([row.figures.get("edge_strain_p99", 0.02) for row in source.rows]))
    garment = source.dataset.garment
    build = partial(
        build_ropes,
        garment if config.layout == "auto" else replace(garment, chains=()),
        shaped,
        rest=rest,
        chain_count=config.chains,
        bone_counts=(config.chain_bones - 1, config.chain_bones + 1),
        strain_p99=strain,
        constants=RopeConstants.of_material(garment.material, air_density_of(source)),
        least_swing=config.least_swing,
    )
    frames = sample_frames(source, shaped)
    if config.layout == "auto" and not garment.chains:
        ropes = _place_chains(garment, build, frames)
    else:
        shown = _shown(frames, garment) if config.layout in ("ssdr", "scattered") else None
        ropes = build(frames=shown, scattered=config.layout == "scattered", carry=frames)
    train = calibration_clips(source, ropes, shaped, train=True)
    if config.calibrate and train:
        ropes = calibrate(
            ropes,
            shaped,
            train,
            window_seconds=_window(train),
            progress=progress,
        )
    figures = {}
    for name, clips in (("train", train), ("held_out", calibration_clips(source, ropes, shaped, train=False))):
        if clips:
            figures[f"{name}_ropes_mm"] = bone_error_mm(ropes, shaped, clips, window_seconds=_window(clips))
    return ropes, figures


def _place_chains(garment: Garment, build: Callable[..., Ropes], frames: FramesInKey | None) -> Ropes:
    """Lays chains along geodesic lines; where these do not suit the garment, through bones of a decomposition.

    Args:
        garment: The garment.
        build: `build_ropes` with all arguments but the frames and whether the bones are scattered.
        frames: Simulated frames; None if there are none on the shape of the body that the garment was made on.

    Raises:
        BadDataset: Lines do not suit the garment, and there are no frames.

    Warns:
        HemlineWarning: Geodesic lines do not suit the garment.
    """
    try:
        fault = layout_fault(garment, build())
        if fault is None:
            return build(carry=frames)
    except BadGarment as reason:
        fault = str(reason)
    what = f"chains from the rim to the hem do not suit '{garment.name}'"
    cure = "a decomposition of the takes puts the bones instead (--layout scattered)"
    warnings.warn(HemlineWarning(what, fault, cure), stacklevel=2)
    return build(frames=_shown(frames, garment), scattered=True, carry=frames)


def _shown(frames: FramesInKey | None, garment: Garment) -> FramesOfVertices:
    """Returns the vertices of simulated frames for a decomposition."""
    if frames is None:
        what = f"bones of '{garment.name}' are laid by takes on the body that it was made on"
        raise BadDataset(what, "takes on other shapes of the body only", "simulate clips without --betas as well")
    return frames.vertices


def sample_frames(source: TakeFrames, shaped: ShapedBody) -> FramesInKey | None:
    """Returns frames sampled evenly from the takes to train on, or None if there are none on this shape of the body."""
    key = JOINT_NAMES.index(source.dataset.garment.key_joint)
    rows = _rows(source, shaped, train=True)
    if not rows:
        return None
    each = max(1, MAX_SAMPLED_FRAMES // len(rows))
    vertices, skins = [], []
    for row in rows:
        take = source.dataset.take(row)
        some = take.clip_frames[np.linspace(0, len(take.clip_frames) - 1, min(each, row.clip_frames)).astype(int)]
        transforms, _ = shaped.transforms_of(take.motion.rotations[some], take.motion.translations[some])
        for at, index in zip(transforms.astype(np.float64), some, strict=True):
            vertices.append(to_key_frame(at[key], take.vertices[index]))
            turned = at[key, :, :3].T @ at
            turned[..., 3] -= at[key, :, :3].T @ at[key, :, 3]
            skins.append(turned)
    chosen = np.linspace(0, len(vertices) - 1, min(MAX_SAMPLED_FRAMES, len(vertices))).astype(int)
    return FramesInKey(np.array([vertices[i] for i in chosen]), np.array([skins[i] for i in chosen]))


def _window(clips: list[Clip]) -> float:
    """Returns the length of the windows, at most that of the longest clip [s]."""
    return min(WINDOW_SECONDS, max((len(motion) - 2) / motion.fps for motion, _ in clips))


def calibration_clips(source: TakeFrames, ropes: Ropes, shaped: ShapedBody, *, train: bool) -> list[Clip]:
    """Returns poses and simulated bones of takes on one body shape, spread evenly over the dataset.

    Args:
        source: The takes.
        ropes: The bones.
        shaped: The body of that shape.
        train: Take those to train on; otherwise the others.
    """
    rows = _rows(source, shaped, train=train)
    result = []
    for index in np.unique(np.linspace(0, len(rows) - 1, min(MAX_CLIPS, len(rows))).astype(int)):
        take = source.dataset.take(rows[index])
        first = int(take.clip_frames[0])
        motion = take.motion[first:]
        if len(motion) > SHORTEST_CLIP_SECONDS * motion.fps + 1:
            result.append((motion, ropes.positions_on(take.vertices[first:])))
    return result


def _rows(source: TakeFrames, shaped: ShapedBody, *, train: bool) -> list[Row]:
    """Returns the takes on this shape to train on, or the others."""
    return [
        row
        for row, side in zip(source.rows, source.sides, strict=True)
        if (side == 0) is train and np.array_equal(source.shaped[source.shape_of(row)].betas, shaped.betas)
    ]

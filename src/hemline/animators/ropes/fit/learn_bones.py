"""Fit of learned bones to simulated ones, and the bones of a garment in playing."""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.bones.learned_bones import LearnedBones
from hemline.animators.ropes.config import RopesConfig
from hemline.arrays import Float
from hemline.errors import BadDataset, MissingExtra
from hemline.files import content_hash
from hemline.learning.pca import principal_of_map

from .gather import TakeFrames
from .sequences import sequences

SHORTEST_ROLLOUT = 10
"""Smallest number of steps of a rollout."""


def learn_bones(
    source: TakeFrames,
    ropes: Ropes,
    config: RopesConfig,
    *,
    seed: int,
    progress: Progress | None = None,
    folder: Path | None = None,
) -> LearnedBones:
    """Fits learned bones to the simulated ones.

    Args:
        source: The takes.
        ropes: The bones of the garment.
        config: Options.
        seed: Seed of all random numbers.
        progress: Called with stage, passes done and in all.
        folder: Where the state of the training is saved.

    Raises:
        BadDataset: No take is long enough.
        BadModel: The training diverged.
        MissingExtra: torch is not installed.
    """
    try:
        from .rollouts import train_rollouts
    except ModuleNotFoundError as reason:
        raise MissingExtra("torch", "learn", "fitting rope chains") from reason
    report = progress or (lambda stage, done, total: None)
    data = sequences(source, ropes, clearance=config.bone_clearance, mirror=config.mirror)
    if data.longest < SHORTEST_ROLLOUT:
        got = f"none longer than {max(0, data.longest + 3)} frames"
        what = f"learned bones need takes of {SHORTEST_ROLLOUT + 3} frames, lead-in and all"
        raise BadDataset(what, got, "simulate longer clips, or ask for 'bones': 'ropes'")
    trained = data.bones[data.side == 0].reshape((data.side == 0).sum(), -1)
    rows = trained.shape[1]
    modes = principal_of_map(np.eye(rows), np.zeros(rows), trained, config.bone_components).basis
    network, low, high = train_rollouts(
        data,
        modes,
        config,
        seed=seed,
        mark=content_hash(asdict(config), {"seed": seed}, source.mark, data.bones),
        progress=lambda done, total: report("learned bones", done, total),
        folder=folder,
    )
    return LearnedBones(modes, network, low, high, data.dt, config.bone_clearance)


def play_bones(source: TakeFrames, bones: BoneSource) -> Float[np.ndarray, "frames ins"]:
    """Returns displacements of all bones in playing the held-out takes, clip by clip without lead-ins [m]."""
    displacements = []
    for take, side, shape in source.takes():
        if side == 0:
            continue
        shaped = source.shaped[shape]
        rest = rest_bones(bones.ropes, source.rests[shape], shaped)
        state, moved = bones.start(shaped.posed(take.motion[0])), []
        for index in range(len(take.motion)):
            state, each = bones.step(state, shaped.posed(take.motion[index]), 1 / take.motion.fps, rest)
            moved.append(each)
        displacements.append(np.stack(moved)[take.clip_frames])
    return np.concatenate(displacements)

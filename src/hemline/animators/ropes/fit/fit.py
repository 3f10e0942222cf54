"""From simulated takes to a model: lay the ropes, calibrate them, learn the networks."""

import importlib.util
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.base import Progress
from hemline.animators.checkpoints import checkpoint_folder
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.bones.learned_bones import LearnedBones
from hemline.animators.ropes.config import RopesConfig
from hemline.animators.ropes.model import AnimatorRopes
from hemline.animators.terms import garment_terms
from hemline.bodies.body import ShapedBody
from hemline.datasets import Dataset
from hemline.datasets.take import take_metadata
from hemline.errors import MissingExtra
from hemline.learning.mlp import Mlp
from hemline.motions.terms import as_stated

from .fit_figures import own_figures
from .frames import Frames
from .gather import Source, gather
from .lay import ropes_for
from .learn import Learned, learn
from .learn_bones import learn_bones, own_bones


def fit(
    dataset: Dataset,
    config: RopesConfig | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
    ropes: Ropes | None = None,
) -> AnimatorRopes:
    """Fit rope chains and their networks to the takes of a dataset.

    Args:
        dataset: Takes of one garment, with the rest drape of each body shape.
        config: Options.
        seed: Seed of all that is random; the same one gives the same model on the same machine and threads.
        progress: Called with stage, steps done and steps in all.
        checkpoints: A folder for the state of the training, made and removed here: a fit that was killed goes on from
            there. Displacements of all frames are kept there, too (4 bytes a coordinate and frame).
        ropes: Bones laid out by hand or calibrated before; None: laid out and calibrated here.

    Returns:
        The animator.

    Raises:
        BadDataset: The dataset holds no take to train on, or no rest drape.
        BadOutput: The folder of the checkpoints cannot be written, or its disk has too little room.
        BadModel: The training diverged.
        MissingExtra: torch is not installed.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 to 9. Differs: see `learn.learn` and `networks.train_network`.
    """
    if importlib.util.find_spec("torch") is None:
        raise MissingExtra("torch", "learn", "fitting rope chains")
    config = config or RopesConfig()
    garment = dataset.garment
    source = Source.of(dataset)
    shaped = bodies.load(garment.body_name).shaped(garment.body_betas)
    rest = np.ascontiguousarray(dataset.rest(garment.body_betas).vertices[0], np.float32)
    found: dict[str, float] = {}
    if ropes is None:
        ropes, found = ropes_for(source, shaped, rest, config, progress)
    with checkpoint_folder(checkpoints) as folder:
        frames, clearances = gather(source, ropes, folder, mirror=config.mirror, progress=progress)
        learned = learn(frames, clearances, config, seed=seed, progress=progress, folder=folder)
        correction, corrected = kept_correction(frames, learned)
        learned = replace(learned, correction=correction)
        played, figures = _own(source, ropes, frames, learned, config, seed, progress, folder)
    return AnimatorRopes(
        garment,
        ropes,
        rest,
        learned.skinning_basis,
        learned.shape_basis,
        learned.skinning,
        learned.shape,
        learned.correction,
        body_name=garment.body_name,
        body_hash=shaped.body.hash,
        config=config,
        learned=played,
        figures=learned.figures | found | corrected | figures,
        licences=_licences(source, shaped),
    )


def kept_correction(frames: Frames, learned: Learned) -> tuple[Mlp, dict[str, float]]:
    """The bone correction, silenced where cloth is farther from the held-out takes with it than without.

    Args:
        frames: The frames, with the bones of the ropes.
        learned: Networks and correction.

    Returns:
        The correction that plays; `val_uncorrected_error_mm`, `val_corrected_error_mm` and those of the test split.
    """
    held_out = frames.rope_bones[frames.side > 0]
    figures = own_figures(frames, learned.skinned, "uncorrected", held_out)
    figures |= own_figures(frames, learned.skinned, "corrected", held_out + learned.correction.many(held_out))
    worse = figures.get("val_corrected_error_mm", 0.0) > figures.get("val_uncorrected_error_mm", math.inf)
    return learned.correction.silent() if worse else learned.correction, figures


def _own(
    source: Source,
    ropes: Ropes,
    frames: Frames,
    learned: Learned,
    config: RopesConfig,
    seed: int,
    progress: Progress | None,
    folder: Path,
) -> tuple[LearnedBones | None, dict[str, float]]:
    """The learned bones, unless ropes are asked for or better on validation; what both make of the held-out takes."""
    skinned, roped = learned.skinned, BoneSource(ropes, learned.correction, None)
    held_out = frames.rope_bones[frames.side > 0]
    figures = own_figures(frames, skinned, "ropes", held_out + learned.correction.many(held_out))
    if config.bones == "ropes":
        return None, figures | _named_own(figures, "ropes")
    bones = learn_bones(source, ropes, config, seed=seed, progress=progress, folder=folder)
    moved = own_bones(source, replace(roped, learned=bones)) if len(held_out) else held_out
    figures |= own_figures(frames, skinned, "learned", moved)
    better = figures.get("val_learned_error_mm", math.inf) < figures.get("val_ropes_error_mm", math.inf)
    chosen = "learned" if config.bones == "learned" or better else "ropes"
    return bones if chosen == "learned" else None, figures | _named_own(figures, chosen)


def _named_own(figures: dict[str, float], chosen: str) -> dict[str, float]:
    """The errors of what plays, as `*_own_error_mm`."""
    return {
        name.replace(f"_{chosen}_", "_own_"): value
        for name, value in figures.items()
        if name.endswith(f"_{chosen}_error_mm")
    }


def _licences(source: Source, shaped: ShapedBody) -> tuple[str, ...]:
    motions = {take_metadata(source.dataset.path(row.name))["motion"]["licence"] for row in source.rows}
    return as_stated((shaped.body.licence, *garment_terms(source.dataset.garment), *sorted(motions)))

"""The fit of rope chains, from simulated takes to a model: build the ropes, calibrate them, train the networks."""

import importlib.util
import math
import warnings
from pathlib import Path

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.checkpoints import checkpoint_folder
from hemline.animators.ropes.bones.bone_correction import BoneCorrection
from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.config import RopesConfig
from hemline.animators.ropes.model import AnimatorRopes
from hemline.animators.terms import garment_terms
from hemline.arrays import Float
from hemline.bodies.body import ShapedBody
from hemline.datasets import Dataset
from hemline.datasets.take import take_metadata
from hemline.errors import HemlineWarning, MissingExtra
from hemline.garments.garment import Garment
from hemline.garments.hanging import HANGING_DISTANCE, LITTLE_HANGS, hanging_percent
from hemline.motions.terms import as_stated

from .correction import fit_correction, worst_correction
from .fit_figures import figures_of_bones
from .fit_ropes import fit_ropes
from .frames import KeyFrames
from .gather import TakeFrames, gather
from .learn import learn
from .play import play_held_out
from .swing import with_swing_gain
from .training_set import MeshNetworks


def fit(
    dataset: Dataset,
    config: RopesConfig | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
    ropes: Ropes | None = None,
) -> AnimatorRopes:
    """Fits rope chains and their networks to the takes of a dataset.

    Args:
        dataset: Takes of one garment, with the rest drape of each body shape.
        config: Options.
        seed: Seed of all random numbers; equal seeds give equal models on the same machine with as many threads.
        progress: Called with stage, steps done and steps in all.
        checkpoints: A folder for the state of the training, created and removed here: a fit that was killed resumes
            from it. It also holds the displacements of all frames (4 bytes per coordinate and frame).
        ropes: Ropes built by hand or calibrated before; None: they are built and calibrated here.

    Returns:
        The animator.

    Raises:
        BadDataset: The dataset holds no take to train on, or no rest drape.
        BadOutput: The folder of the checkpoints cannot be written, or its disk has too little room.
        BadModel: The training diverged.
        MissingExtra: torch is not installed.

    Warns:
        HemlineWarning: Little of the garment hangs; or see `fit_ropes`.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 to 9. Differs: see `learn.learn` and `networks.train_network`.
    """
    config = config or RopesConfig()
    if config.epochs and not importlib.util.find_spec("torch"):
        raise MissingExtra("torch", "learn", "training networks of rope chains")
    garment = dataset.garment
    source = TakeFrames.of(dataset)
    shaped = dataset.body.shaped(garment.body_betas)
    rest = np.ascontiguousarray(dataset.rest(garment.body_betas).vertices[0], np.float32)
    rope_figures = {"hanging_percent": hanging_percent(rest, garment.faces, shaped)}
    warn_if_close(garment, rope_figures["hanging_percent"])
    if ropes is None:
        ropes, figures_of_ropes = fit_ropes(source, shaped, rest, config, progress)
        rope_figures |= figures_of_ropes
    with checkpoint_folder(checkpoints) as folder:
        frames, clearances = gather(
            source, ropes, folder, mirror=config.mirror, clear=config.epochs > 0, progress=progress
        )
        learned = learn(frames, clearances, config, seed=seed, progress=progress, folder=folder)
        fitted = fit_correction(frames, config.correction_components)
        fitted = with_swing_gain(source, BoneSource(ropes, fitted))
        played = play_held_out(source, BoneSource(ropes, fitted))
        correction, correction_figures = choose_correction(frames, learned.mesh_networks, fitted, played)
    return AnimatorRopes(
        garment,
        ropes,
        rest,
        learned.skinning_basis,
        learned.shape_basis,
        learned.skinning,
        learned.shape,
        correction,
        body_name=garment.body_name,
        body_hash=shaped.body.hash,
        config=config,
        figures=learned.figures | rope_figures | {"swing_gain": correction.swing_gain} | correction_figures,
        licences=_licences(source, shaped),
    )


def warn_if_close(garment: Garment, percent: float) -> None:
    """Warns before anything is trained if little of a garment hangs, since ropes show only what does.

    Args:
        garment: The garment.
        percent: Part of its cloth that hangs, see `garments.hanging.hanging_percent`.
    """
    if percent < LITTLE_HANGS:
        what = f"little of '{garment.name}' hangs, and rope chains are for cloth that does"
        got = f"{percent:.0f} % of it farther than {100 * HANGING_DISTANCE:.0f} cm from the skin"
        cure = "fit --animator agentdress to what 'hemline drape GARMENT --anchors 4 --poses 40 --random 10' makes"
        warnings.warn(HemlineWarning(what, got, cure), stacklevel=3)


def choose_correction(
    frames: KeyFrames,
    mesh_networks: MeshNetworks,
    correction: BoneCorrection,
    played: Float[np.ndarray, "held_out ins"],
) -> tuple[BoneCorrection, dict[str, float]]:
    """Returns the bone correction, or one without effect where it increases the error on held-out takes.

    Args:
        frames: The frames, with the bones of the ropes.
        mesh_networks: Both networks from bones to mesh.
        correction: The correction that was fitted.
        played: Displacements of all bones in the held-out frames as played with it, see `play_held_out` [m].

    Returns:
        The correction for playing; the figures `val_uncorrected_error_mm`, `val_corrected_error_mm` and those of the
        test split; and `val_worst_correction`, the largest mean distance of the corrected bones in a validation take,
        as a ratio to that without the correction.
    """
    figures = figures_of_bones(frames, mesh_networks, "uncorrected", frames.rope_bones[frames.side > 0])
    figures |= figures_of_bones(frames, mesh_networks, "corrected", played)
    if len(frames.val):
        figures["val_worst_correction"] = worst_correction(frames, played)
    worse = figures.get("val_corrected_error_mm", 0.0) > figures.get("val_uncorrected_error_mm", math.inf)
    return correction.with_zero_output() if worse else correction, figures


def _licences(source: TakeFrames, shaped: ShapedBody) -> tuple[str, ...]:
    motions = {take_metadata(source.dataset.path(row.name))["motion"]["licence"] for row in source.rows}
    return as_stated((shaped.body.licence, *garment_terms(source.dataset.garment), *sorted(motions)))

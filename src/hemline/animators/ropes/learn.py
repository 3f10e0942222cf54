"""Bases, networks and bone correction from frames: the order of Sections 7 and 8."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from hemline.animators.base import Progress
from hemline.arrays import Float
from hemline.errors import MissingExtra
from hemline.files import content_hash
from hemline.learning.collision import Clearances
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import PackedBasis, pack_basis
from hemline.learning.pca import Pca, principal

from .config import RopesConfig
from .frames import Frames
from .training_set import Contact, Skinned, TrainingSet

BASIS_FRAMES = 5000
"""Frames that a basis is found from; of more, this many are drawn: its time grows with their square."""
CHUNK = 256
"""Frames handled at a time where whole frames are needed."""


@dataclass(frozen=True)
class Learned:
    """What a fit finds out about a garment."""

    skinning_basis: PackedBasis
    shape_basis: PackedBasis
    skinning: Mlp
    shape: Mlp
    correction: Mlp
    figures: dict[str, float]


@dataclass(frozen=True)
class Stage:
    """One basis and its network."""

    pca: Pca
    basis: PackedBasis
    network: Mlp
    coefficients: Float[np.ndarray, "frames modes"]
    """What the network makes of the simulated bones of each frame [m]."""

    def rows(self, frames: np.ndarray | slice, rows: np.ndarray | slice) -> Float[np.ndarray, "frames rows"]:
        """Displacements that this stage adds, of some frames at some rows [m]."""
        return self.coefficients[frames] @ self.unpacked[:, rows]

    @cached_property
    def unpacked(self) -> Float[np.ndarray, "modes rows"]:
        """The basis as it is played."""
        return self.basis.unpacked()


def learn(
    frames: Frames,
    clearances: Clearances | None,
    config: RopesConfig,
    *,
    seed: int,
    progress: Progress | None = None,
    folder: Path | None = None,
) -> Learned:
    """Fit both bases, both networks and the bone correction.

    Args:
        frames: Displacements, bones and the split.
        clearances: Where the body is, for the collision term; None leaves it out.
        config: Options.
        seed: Seed of all that is random.
        progress: Called with stage, passes done and in all.
        folder: Where the state of the training is kept.

    Returns:
        Bases, networks, figures.

    Raises:
        BadDataset: No frame moves.
        BadModel: The training diverged.
        MissingExtra: torch is not installed.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 and 8. The second basis is that of the residual of the first network as it is
        played, so it mends what packing the first basis to 8 bits left over, too.
    """
    tell = progress or (lambda stage, done, total: None)
    mark = content_hash(asdict(config), {"seed": seed}, frames.mark)
    train = frames.train
    if len(train) > BASIS_FRAMES:
        train = np.sort(np.random.default_rng(seed).choice(train, BASIS_FRAMES, replace=False))

    def truth(at: slice) -> np.ndarray:
        return np.ascontiguousarray(frames.displacements[train, at])

    skinning_settings = (config.components, config.second_columns, config.skinning_rate, seed)
    first = _stage("skinning", truth, None, frames, clearances, config, skinning_settings, mark, tell, folder)

    def residual(at: slice) -> np.ndarray:
        return truth(at) - first.rows(train, at)

    shape_settings = (config.shape_components, 0, config.shape_rate, seed + 1)
    second = _stage("shape", residual, first, frames, clearances, config, shape_settings, mark, tell, folder)
    from .correction import train_correction

    skinned = Skinned((first.network, second.network), np.concatenate([first.unpacked, second.unpacked]))
    correction = train_correction(
        frames,
        skinned,
        clearances,
        config,
        seed=seed,
        mark=mark,
        folder=folder,
        progress=lambda done, total: tell("bone correction", done, total),
    )
    figures = _figures(frames, first, second) | _rope_figures(frames, skinned, correction)
    return Learned(first.basis, second.basis, first.network, second.network, correction, figures)


def _stage(
    name: str,
    strips: Callable[[slice], np.ndarray],
    before: Stage | None,
    frames: Frames,
    clearances: Clearances | None,
    config: RopesConfig,
    settings: tuple[int, int, float, int],
    mark: str,
    tell: Progress,
    folder: Path | None,
) -> Stage:
    try:
        from .networks import train_network
    except ModuleNotFoundError as reason:
        raise MissingExtra("torch", "learn", "fitting rope chains") from reason
    components, extra, rate, seed = settings
    tell(f"{name} basis", 0, 1)
    pca = principal(strips, frames.displacements.shape[1], components)
    basis = pack_basis(pca.basis, pca.deviations, extra=extra)
    tell(f"{name} basis", 1, 1)
    training = TrainingSet(
        stage=name,
        bones=frames.bones,
        free=frames.free,
        coefficients=_projected(frames, before, pca),
        deviations=pca.deviations,
        train=frames.train,
        val=frames.val,
        vertex_count=frames.vertex_count,
    )
    unpacked = basis.unpacked()
    earlier = (before.coefficients, before.unpacked) if before else None
    contact = Contact(unpacked, frames.displacements, earlier, clearances) if clearances else None
    network = train_network(
        training,
        contact,
        config,
        rate=rate,
        seed=seed,
        mark=mark,
        folder=folder,
        progress=lambda done, total: tell(f"{name} network", done, total),
    )
    return Stage(pca, basis, network, network.many(frames.bones))


def _projected(frames: Frames, before: Stage | None, pca: Pca) -> Float[np.ndarray, "frames modes"]:
    """Coefficients of the ground truth (less what is there before) of all frames, held-out ones too."""
    whole = pca.coefficients(lambda at: frames.displacements[:, at])
    return whole - pca.coefficients(lambda at: before.rows(slice(None), at)) if before else whole


def _figures(frames: Frames, first: Stage, second: Stage) -> dict[str, float]:
    """Mean distances to the ground truth [mm], driven by its bones, by side of the split and stage."""
    figures = {
        "skinning_explained_share": first.pca.explained,
        "shape_explained_share": second.pca.explained,
        "train_frames": float(len(frames.train)),
        "val_frames": float(len(frames.val)),
        "test_frames": float(len(frames.test)),
    }
    perfect = replace(first, coefficients=_projected(frames, None, first.pca))
    for side, chosen in (("train", frames.train), ("val", frames.val), ("test", frames.test)):
        if len(chosen):
            figures[f"{side}_skinning_basis_mm"] = _mean_error_mm(frames, chosen, [perfect])
            figures[f"{side}_skinning_mm"] = _mean_error_mm(frames, chosen, [first])
            figures[f"{side}_error_mm"] = _mean_error_mm(frames, chosen, [first, second])
    return figures


def _rope_figures(frames: Frames, skinned: Skinned, correction: Mlp) -> dict[str, float]:
    """Mean distances to the ground truth, driven by the bones of the ropes, uncorrected and corrected [mm]."""
    figures = {}
    for side, chosen in (("train", frames.train), ("val", frames.val), ("test", frames.test)):
        some = chosen[:: max(1, len(chosen) // CHUNK)]
        if not len(some):
            continue
        bones, truth = frames.rope_bones[some], np.array(frames.displacements[some])
        for name, given in (("uncorrected", bones), ("own", bones + correction.many(bones))):
            coefficients = np.concatenate([network.many(given) for network in skinned.networks], axis=1)
            left = (coefficients @ skinned.basis - truth).reshape(len(some), -1, 3)
            figures[f"{side}_{name}_error_mm"] = 1e3 * float(np.linalg.norm(left, axis=2).mean())
    return figures


def _mean_error_mm(frames: Frames, chosen: np.ndarray, stages: list[Stage]) -> float:
    total = 0.0
    for start in range(0, len(chosen), CHUNK):
        some = chosen[start : start + CHUNK]
        left = np.array(frames.displacements[some])
        for stage in stages:
            left -= stage.rows(some, slice(None))
        total += float(np.linalg.norm(left.reshape(len(some), -1, 3), axis=2).mean(axis=1).sum())
    return 1e3 * total / len(chosen)

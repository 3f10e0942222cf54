"""Bases, networks and bone correction from frames: the order of Sections 7 and 8."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.ropes.config import RopesConfig
from hemline.errors import MissingExtra
from hemline.files import content_hash
from hemline.learning.collision import Clearances
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import PackedBasis, pack_basis
from hemline.learning.pca import Pca, principal_of_map

from .fit_figures import fit_figures
from .frames import Frames
from .linear import LinearMap
from .stage import Stage, projected
from .training_set import Contact, Skinned, TrainingSet


@dataclass(frozen=True)
class Learned:
    """What a fit finds out about a garment."""

    skinning_basis: PackedBasis
    shape_basis: PackedBasis
    skinning: Mlp
    shape: Mlp
    correction: Mlp
    figures: dict[str, float]

    @property
    def skinned(self) -> Skinned:
        """The two networks as they are played."""
        bases = [each.unpacked() for each in (self.skinning_basis, self.shape_basis)]
        return Skinned((self.skinning, self.shape), np.concatenate(bases))


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
        Clothing", 2024, Sections 7 and 8. Differs: a basis holds what a linear map from the bones can say of the ground
        truth, or of the residual of the first network (as it is played, 8 bits and all), not those themselves: much of
        them no network can say, and what it can would not find room. See `linear.LinearMap`.
    """
    tell = progress or (lambda stage, done, total: None)
    mark = content_hash(asdict(config), {"seed": seed}, frames.mark)
    tell("line", 0, 1)
    linear = LinearMap.fitted(frames, config.bone_noise)
    tell("line", 1, 1)
    trained = frames.bones[frames.train]
    common = (frames, clearances, config, mark, tell, folder)
    pca = principal_of_map(linear.matrix, linear.offset, trained, config.components)
    first = _stage("skinning", pca, None, config.second_columns, config.skinning_rate, seed, *common)
    pca = principal_of_map(*linear.beyond(frames, first), trained, config.shape_components)
    second = _stage("shape", pca, first, 0, config.shape_rate, seed + 1, *common)
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
    figures = fit_figures(frames, first, second, linear)
    return Learned(first.basis, second.basis, first.network, second.network, correction, figures)


def _stage(
    name: str,
    pca: Pca,
    before: Stage | None,
    extra: int,
    rate: float,
    seed: int,
    frames: Frames,
    clearances: Clearances | None,
    config: RopesConfig,
    mark: str,
    tell: Progress,
    folder: Path | None,
) -> Stage:
    try:
        from .networks import train_network
    except ModuleNotFoundError as reason:
        raise MissingExtra("torch", "learn", "fitting rope chains") from reason
    basis = pack_basis(pca.basis, pca.deviations, extra=extra)
    training = TrainingSet(
        stage=name,
        bones=frames.bones,
        free=frames.free,
        coefficients=projected(frames, before, pca),
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

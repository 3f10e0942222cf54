"""Fit of bases and networks to frames, in the order of Sections 7 and 8."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hemline.animators.base import Progress
from hemline.animators.ropes.config import RopesConfig
from hemline.files import content_hash
from hemline.learning.collision import Clearances
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import PackedBasis, pack_basis
from hemline.learning.pca import Pca, principal_of_map

from .basis_network import BasisNetwork, project_frames
from .fit_figures import fit_figures
from .frames import KeyFrames
from .linear import LinearMap, linear_network
from .training_set import CollisionTerm, MeshNetworks, TrainingSet


@dataclass(frozen=True)
class Learned:
    """Bases, networks and figures of a fit."""

    skinning_basis: PackedBasis
    shape_basis: PackedBasis
    skinning: Mlp
    shape: Mlp
    figures: dict[str, float]

    @property
    def mesh_networks(self) -> MeshNetworks:
        """The two networks from bones to mesh, as they are used in playing."""
        bases = [each.unpack() for each in (self.skinning_basis, self.shape_basis)]
        return MeshNetworks((self.skinning, self.shape), np.concatenate(bases))


def learn(
    frames: KeyFrames,
    clearances: Clearances | None,
    config: RopesConfig,
    *,
    seed: int,
    progress: Progress | None = None,
    folder: Path | None = None,
) -> Learned:
    """Fits both bases and both networks. Where no network is better than a linear map, that is kept instead.

    Args:
        frames: Displacements, bones and the split.
        clearances: Clearances from the body for the collision term; None omits it.
        config: Options.
        seed: Seed of all random numbers.
        progress: Called with stage, passes done and in all.
        folder: Where the state of the training is saved.

    Returns:
        Bases, networks, figures.

    Raises:
        BadDataset: No frame moves.
        BadModel: The training diverged.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 and 8. Differs: a basis spans the output of a linear map from the bones to the
        ground truth, or to the residual of the first network (8-bit columns included), instead of the frames or
        residuals themselves: much of those no network can predict, and what it can predict would find no room. See
        `linear.LinearMap`.
    """
    report = progress or (lambda stage, done, total: None)
    mark = content_hash(asdict(config), {"seed": seed}, frames.mark)
    report("line", 0, 1)
    linear = LinearMap.fit(frames, config.bone_noise)
    report("line", 1, 1)
    trained = frames.bones[frames.train]
    common = (frames, clearances, config, mark, report, folder)
    pca = principal_of_map(linear.matrix, linear.offset, trained, config.components)
    first = _train_stage("skinning", pca, None, config.second_columns, config.skinning_rate, seed, *common)
    pca = principal_of_map(*linear.beyond(frames, first), trained, config.shape_components)
    second = _train_stage("shape", pca, first, 0, config.shape_rate, seed + 1, *common)
    figures = fit_figures(frames, first, second, linear)
    return Learned(first.basis, second.basis, first.network, second.network, figures)


def _train_stage(
    name: str,
    pca: Pca,
    before: BasisNetwork | None,
    extra: int,
    rate: float,
    seed: int,
    frames: KeyFrames,
    clearances: Clearances | None,
    config: RopesConfig,
    mark: str,
    report: Progress,
    folder: Path | None,
) -> BasisNetwork:
    basis = pack_basis(pca.basis, pca.deviations, extra=extra)
    training = TrainingSet(
        stage=name,
        bones=frames.bones,
        free=frames.free,
        coefficients=project_frames(frames, before, pca),
        deviations=pca.deviations,
        train=frames.train,
        val=frames.val,
        vertex_count=frames.vertex_count,
    )
    vectors = basis.unpack()
    earlier = (before.coefficients, before.vectors) if before else None
    contact = CollisionTerm(vectors, frames.displacements, earlier, clearances) if clearances else None
    network = linear_network(training, config.bone_noise)
    if config.epochs:
        from .networks import train_network

        trained = train_network(
            training,
            contact,
            config,
            rate=rate,
            seed=seed,
            mark=mark,
            folder=folder,
            progress=lambda done, total: report(f"{name} network", done, total),
        )
        network = trained or network
    return BasisNetwork(pca, basis, network, network.many(frames.bones))

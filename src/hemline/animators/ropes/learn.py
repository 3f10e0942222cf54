"""Both bases and both networks from frames: the order of Sections 7 and 8."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from hemline.animators.base import Progress
from hemline.arrays import Float
from hemline.errors import MissingExtra
from hemline.files import content_hash

from .collision import Clearances
from .config import RopesConfig
from .frames import Frames
from .lesson import Contact, Lesson
from .mlp import Mlp
from .pca import Pca, principal
from .reconstruct import PackedBasis, pack_basis

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
    figures: dict[str, float]


@dataclass(frozen=True)
class Stage:
    """One basis and its network."""

    pca: Pca
    basis: PackedBasis
    network: Mlp
    coefficients: Float[np.ndarray, "examples modes"]
    """What the network makes of the bones of each example [m]; see `Lesson`."""

    def rows(self, examples: np.ndarray | slice, rows: np.ndarray | slice) -> Float[np.ndarray, "examples rows"]:
        """Displacements that this stage adds, of some examples at some rows [m]."""
        return self.coefficients[examples] @ self.unpacked[:, rows]

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
    """Fit both bases and both networks.

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

    Source: Jin et al., "Rope chains", 2024, Sections 7 and 8. The second basis is that of the residual of the first
        network as it is played, so it mends what packing the first basis to 8 bits left over, too.
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
    return Learned(first.basis, second.basis, first.network, second.network, _figures(frames, first, second))


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
        from .nets import train_network
    except ModuleNotFoundError as reason:
        raise MissingExtra("torch", "learn", "fitting rope chains") from reason
    components, extra, rate, seed = settings
    tell(f"{name} basis", 0, 1)
    pca = principal(strips, frames.displacements.shape[1], components)
    basis = pack_basis(pca.basis, pca.deviations, extra=extra)
    tell(f"{name} basis", 1, 1)
    lesson = Lesson(
        stage=name, bones=frames.example_bones, free=frames.free, coefficients=_projected(frames, before, pca),
        deviations=pca.deviations, train=frames.train, val=frames.val, frame_count=len(frames.side),
        vertex_count=frames.vertex_count,
    )  # fmt: skip
    unpacked = basis.unpacked()

    def astray(chosen: np.ndarray, rows: np.ndarray) -> np.ndarray:
        truth = frames.displacements[(chosen % len(frames.side))[:, None], rows]
        return before.rows(chosen, rows) - truth if before else -truth

    contact = Contact(unpacked, astray, clearances) if clearances else None
    network = train_network(
        lesson, contact, config, rate=rate, seed=seed, mark=mark, folder=folder,
        progress=lambda done, total: tell(f"{name} network", done, total),
    )  # fmt: skip
    return Stage(pca, basis, network, network.many(frames.example_bones))


def _projected(frames: Frames, before: Stage | None, pca: Pca) -> Float[np.ndarray, "examples modes"]:
    """Coefficients of the truth (less what is there before) of all examples, held-out ones too."""
    times = len(frames.example_bones) // len(frames.side)
    whole = np.tile(pca.coefficients(lambda at: frames.displacements[:, at]), (times, 1))
    return whole - pca.coefficients(lambda at: before.rows(slice(None), at)) if before else whole


def _figures(frames: Frames, first: Stage, second: Stage) -> dict[str, float]:
    """Mean distances to the truth [mm], driven by the bones of the truth, by side of the split and stage."""
    figures = {
        "skinning_explained_share": first.pca.explained, "shape_explained_share": second.pca.explained,
        "train_frames": float(len(frames.train)), "val_frames": float(len(frames.val)),
        "test_frames": float(len(frames.test)),
    }  # fmt: skip
    perfect = replace(first, coefficients=_projected(frames, None, first.pca))
    for side, chosen in (("train", frames.train), ("val", frames.val), ("test", frames.test)):
        if len(chosen):
            figures[f"{side}_skinning_basis_mm"] = _mean_error_mm(frames, chosen, [perfect])
            figures[f"{side}_skinning_mm"] = _mean_error_mm(frames, chosen, [first])
            figures[f"{side}_error_mm"] = _mean_error_mm(frames, chosen, [first, second])
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

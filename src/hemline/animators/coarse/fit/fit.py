"""Fits a network to takes of many garments."""

from collections.abc import Callable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, Protocol

from hemline.animators.base import Progress
from hemline.animators.checkpoints import checkpoint_folder
from hemline.animators.coarse.config import CoarseConfig
from hemline.animators.coarse.network import Network
from hemline.animators.coarse.relatives import Relatives
from hemline.animators.coarse.weights import NetworkReader, Weights
from hemline.animators.model_file import load
from hemline.animators.terms import garment_terms
from hemline.datasets.collection import Collection, Entry
from hemline.datasets.take import take_metadata
from hemline.errors import BadDataset, BadInput
from hemline.files import content_hash
from hemline.garments.proxy.proxy import proxy_of
from hemline.motions.terms import as_stated

from .split_frames import HELD_OUT, SplitFrames, take_id
from .walk import TakeWalk


class NetworkTrainer(NetworkReader, Protocol):
    """A kind of animator that trains its network, see `kind.NetworkKind`."""

    def train(
        self,
        frames: SplitFrames,
        config: Any,
        *,
        start: Any,
        seed: int,
        mark: str,
        checkpoints: Path | None,
        tell: Callable[[str, int, int], None],
    ) -> tuple[Network, dict[str, float]]:
        """Trains a network; returns it and its figures. See `kind.NetworkKind.train`."""
        ...


def fit(
    kind: NetworkTrainer,
    data: Collection,
    config: Any,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
) -> Weights:
    """Trains a network on takes of many garments, or continues from a model with takes of one garment or more.

    Some subjects and some garments are held out. The epoch with the smallest error on them is kept.

    Args:
        kind: The kind of animator.
        data: Takes of proxies.
        config: Options of the fit.
        seed: Seed of everything random.
        progress: Called with the stage, the steps done and the number of steps.
        checkpoints: Folder for the state of the training, from which a killed fit continues.

    Raises:
        BadDataset: There are fewer than three garments, or no takes to train on or to choose epochs by.
        BadInput: The model to continue from is another animator.
        BadModel: The training diverged.
    """
    tell = progress or (lambda *_: None)
    start = _starting_weights(kind.name, config.start) if config.start else None
    config = config if start is None else replace(start.config, **_training_options(config))
    splits = split_takes(data, config.held_out, garments=start is None)
    if not splits["train"] or not any(splits[name] for name in HELD_OUT):
        raise BadDataset(f"{kind.name} needs takes to learn from and takes to choose by", "none", "simulate more clips")
    mark = content_hash(asdict(config) | {"seed": seed, "takes": [each.row.name for each in splits["train"]]})
    with checkpoint_folder(checkpoints) as folder:
        walk = TakeWalk(config.size, config.stride, config.recent)
        frames = SplitFrames.of(
            data, splits, walk, folder / "frames", jobs=config.jobs, tell=lambda *done: tell("read", *done)
        )
        before = None if start is None else start.network
        network, figures = kind.train(frames, config, start=before, seed=seed, mark=mark, checkpoints=folder, tell=tell)
    garments = sorted({each.dataset for each in splits["train"]})
    figures |= {"garments": float(len(garments)), "takes": float(len(splits["train"]))}
    relatives = Relatives.of_garments([proxy_of(data.garments[each], config.size)[0] for each in garments])
    if start is not None:
        relatives = start.relatives.merge(relatives)
    return Weights(kind, config, network, relatives, figures, licences_of(data)).as_stored()


def _training_options(config: CoarseConfig) -> dict[str, Any]:
    """Returns the options that a fit does not take from the weights that it continues from."""
    return {each.name: getattr(config, each.name) for each in fields(config) if each.name not in config.SIZES}


def _starting_weights(kind: str, name: str) -> Weights:
    """Loads the weights of a model to continue from."""
    model = load(name)
    weights = getattr(model, "weights", None)
    if model.name != kind or not isinstance(weights, Weights):
        raise BadInput(f"option 'start' must name a {kind} model", f"'{name}', a model of {model.name}", "name one")
    return weights


def licences_of(data: Collection) -> list[str]:
    """Returns the licence terms of the bodies, of the garments' meshes and of the motions, each once."""
    terms = {body.licence for body in data.bodies}
    terms |= {text for garment in data.garments for text in garment_terms(garment)}
    for entry in data.clips():
        terms.add(take_metadata(data.datasets[entry.dataset].path(entry.row.name))["motion"]["licence"])
    return list(as_stated(sorted(terms)))


def split_takes(data: Collection, held_out: float, *, garments: bool = True) -> dict[str, list[Entry]]:
    """Splits takes into those to train on and those of new subjects, of new garments and of both.

    Args:
        data: The datasets.
        held_out: Fraction of the frames that each split holds out.
        garments: Whether garments are held out as well as subjects.

    Returns:
        The takes of `train` and of each split in `HELD_OUT`.
    """
    fractions = (1 - held_out, held_out, 0.0)
    clips = {take_id(entry) for entry in data.split("train", by="subject", fractions=fractions)}
    of_garments = data.split("train", by="garment", fractions=fractions) if garments else data.clips()
    known = {take_id(entry) for entry in of_garments}
    splits: dict[str, list[Entry]] = {name: [] for name in ("train", *HELD_OUT)}
    for entry in data.clips():
        clip, garment = take_id(entry) in clips, take_id(entry) in known
        name = "train" if clip and garment else "new_clip" if garment else "new_garment" if clip else "both_new"
        splits[name].append(entry)
    return splits

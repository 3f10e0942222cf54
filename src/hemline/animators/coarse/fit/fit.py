"""From takes of many garments to a model that is worn by garments never seen."""

from collections.abc import Callable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, Protocol

from hemline import bodies
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
    """A kind of animator whose network is learned."""

    def learned(
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
        """The network and its figures, see `kind.CoarseKind.learned`."""
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
    """Learn from takes of many garments; or go on from a model, with takes of one garment or more.

    Some subjects and some garments are held out: the epoch that is kept is the one that errs least on them.

    Args:
        kind: What is fitted.
        data: Takes of proxies.
        config: Its options.
        seed: Seed of all that is random.
        progress: Called with stage, steps done and steps in all.
        checkpoints: A folder for the state of the training: a fit that was killed goes on from there.

    Raises:
        BadDataset: Fewer than three garments, or nothing to learn from or to choose by.
        BadInput: What is to be gone on from is another animator.
        BadModel: The training diverged.
    """
    tell = progress or (lambda *_: None)
    start = _starting_weights(kind.name, config.start) if config.start else None
    config = config if start is None else replace(start.config, **_training_options(config))
    sides = split_takes(data, config.held_out, garments=start is None)
    if not sides["train"] or not any(sides[name] for name in HELD_OUT):
        raise BadDataset(f"{kind.name} needs takes to learn from and takes to choose by", "none", "simulate more clips")
    mark = content_hash(asdict(config) | {"seed": seed, "takes": [each.row.name for each in sides["train"]]})
    with checkpoint_folder(checkpoints) as folder:
        walk = TakeWalk(config.size, config.stride)
        frames = SplitFrames.of(
            data, sides, walk, folder / "frames", jobs=config.jobs, tell=lambda *done: tell("read", *done)
        )
        before = None if start is None else start.network
        network, figures = kind.learned(
            frames, config, start=before, seed=seed, mark=mark, checkpoints=folder, tell=tell
        )
    garments = sorted({each.dataset for each in sides["train"]})
    figures |= {"garments": float(len(garments)), "takes": float(len(sides["train"]))}
    known = Relatives.of_garments([proxy_of(data.garments[each], config.size)[0] for each in garments])
    if start is not None:
        known = start.relatives.joined(known)
    return Weights(kind, config, network, known, figures, licences_of(data)).rounded()


def _training_options(config: CoarseConfig) -> dict[str, Any]:
    """Options of how it is learned; the others are those of the weights that are gone on from."""
    return {each.name: getattr(config, each.name) for each in fields(config) if each.name not in config.SIZES}


def _starting_weights(kind: str, name: str) -> Weights:
    """The weights of a model to go on from."""
    model = load(name)
    weights = getattr(model, "weights", None)
    if model.name != kind or not isinstance(weights, Weights):
        raise BadInput(f"option 'start' must name a {kind} model", f"'{name}', a model of {model.name}", "name one")
    return weights


def licences_of(data: Collection) -> list[str]:
    """Terms of the bodies, of the garments' meshes and of the motions, each once."""
    found = {bodies.load(garment.body_name).licence for garment in data.garments}
    found |= {text for garment in data.garments for text in garment_terms(garment)}
    for entry in data.clips():
        found.add(take_metadata(data.datasets[entry.dataset].path(entry.row.name))["motion"]["licence"])
    return list(as_stated(sorted(found)))


def split_takes(data: Collection, held_out: float, *, garments: bool = True) -> dict[str, list[Entry]]:
    """Takes to learn from, and those of new subjects, of new garments, and of both.

    Args:
        data: The datasets.
        held_out: Share of the frames that each split holds out.
        garments: Whether garments are held out, too.
    """
    shares = (1 - held_out, held_out, 0.0)
    clips = {take_id(entry) for entry in data.split("train", by="subject", fractions=shares)}
    known = {
        take_id(entry) for entry in (data.split("train", by="garment", fractions=shares) if garments else data.clips())
    }
    found: dict[str, list[Entry]] = {name: [] for name in ("train", *HELD_OUT)}
    for entry in data.clips():
        clip, garment = take_id(entry) in clips, take_id(entry) in known
        name = "train" if clip and garment else "new_clip" if garment else "new_garment" if clip else "both_new"
        found[name].append(entry)
    return found

"""From takes of many garments to a model that is worn by garments never seen."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from hemline import bodies
from hemline.animators.base import Progress
from hemline.datasets.collection import Collection, Entry
from hemline.datasets.take import take_metadata
from hemline.errors import BadDataset
from hemline.files import content_hash

from .config import SwingarConfig
from .relatives import Relatives

if TYPE_CHECKING:
    from .wearable import Swingar

SIDES = ("new_clip", "new_garment", "both_new")
"""What epochs are chosen by."""


def fit(
    data: Collection,
    config: SwingarConfig | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
) -> "Swingar":
    """Learn from takes of many garments.

    Some subjects and some garments are held out: the epoch that is kept is the one that errs least on them.

    Args:
        data: Takes of proxies.
        config: Options.
        seed: Seed of all that is random.
        progress: Called with stage, steps done and steps in all.
        checkpoints: A folder for the state of the training: a fit that was killed goes on from there.

    Raises:
        BadDataset: Fewer than three garments or subjects, or nothing to learn from or to choose by.
        BadModel: The training diverged.
    """
    from .fit_graph import fit_graph
    from .fit_lag import fit_lag
    from .wearable import Swingar
    from .weights import Weights

    config, tell = config or SwingarConfig(), progress or (lambda *_: None)
    sides = divided(data, config.held_out)
    if not sides["train"] or not any(sides[name] for name in SIDES):
        raise BadDataset("swingar needs takes to learn from and takes to choose by", "none", "simulate more garments")
    mark = content_hash(asdict(config) | {"seed": seed, "takes": [each.row.name for each in sides["train"]]})
    if checkpoints is not None:
        checkpoints.mkdir(parents=True, exist_ok=True)
    learn = fit_lag if config.learner == "lag" else fit_graph
    mover, figures = learn(data, sides, config, seed=seed, mark=mark, checkpoints=checkpoints, tell=tell)
    garments = sorted({each.dataset for each in sides["train"]})
    figures |= {"garments": float(len(garments)), "takes": float(len(sides["train"]))}
    known = Relatives.of_garments([data.garments[each] for each in garments])
    return Swingar(Weights(config, mover, known, figures, licences_of(data)).rounded())


def licences_of(data: Collection) -> list[str]:
    """Notices of the bodies and of the motions, each once."""
    found = {bodies.load(garment.body_name).licence: None for garment in data.garments}
    for entry in data.clips():
        found[take_metadata(data.datasets[entry.dataset].path(entry.row.name))["motion"]["licence"]] = None
    return sorted(each for each in found if each)


def divided(data: Collection, held_out: float) -> dict[str, list[Entry]]:
    """Takes to learn from, and those of new subjects, of new garments, and of both."""
    shares = (1 - held_out, held_out, 0.0)
    known = [{id_of(entry) for entry in data.split("train", by=by, fractions=shares)} for by in ("subject", "garment")]
    found: dict[str, list[Entry]] = {name: [] for name in ("train", *SIDES)}
    for entry in data.clips():
        clip, garment = (id_of(entry) in each for each in known)
        name = "train" if clip and garment else "new_clip" if garment else "new_garment" if clip else "both_new"
        found[name].append(entry)
    return found


def id_of(entry: Entry) -> tuple[int, str]:
    """Which take it is."""
    return entry.dataset, entry.row.name

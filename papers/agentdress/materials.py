"""Material as a third dimension: `python -m papers.agentdress.materials ANCHORS OTHER... --test FOLDER`.

The paper leaves it to future work. ANCHORS is a dataset made by `hemline drape GARMENT --anchors ...`, each OTHER the
same garment in another material and some of its poses (`hemline drape GARMENT --material NAME --poses-of ANCHORS`). The
test set consists of poses of people who appear in no fit, on the mean body, in all these materials and those named by
`--unknown`; its folder is made and continued.

The simulated garment of the fit replaces the pose model, so that only the effect of the material is evaluated; "as
played" includes the pose model. Adds a row per material to benchmarks/results/agentdress_materials.jsonl;
`beyond.py` shows them.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.fit.material_fit import MaterialChanges
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bodies import PosedBody
from hemline.compiled import use_threads
from hemline.datasets import Dataset, leave_out_faulty, open_dataset
from hemline.garments import Garment
from hemline.garments.material import Material
from papers.agentdress.models.ablations import binding_of
from papers.agentdress.settled.pairs import choose_pairs, mean_distance_mm, settle_in_poses
from papers.report import mean_of, parse_options, record

NAME = "agentdress_materials"


def fit_materials(garment: Garment, anchors: AnchorSet, others: Sequence[Dataset]) -> AnimatorAgentDress:
    """Fits a model to anchors and datasets of other materials."""
    changes = MaterialChanges.of(garment, anchors, others)
    return fit_anchors(garment, anchors, AgentDressConfig(), materials=changes, progress=lambda *_: None)


def predictions(
    models: dict[str, AnimatorAgentDress], mean: np.ndarray | None, name: str, posed: PosedBody, own: np.ndarray
) -> dict[str, np.ndarray]:
    """Returns the garment in another material and a pose as predicted in several ways [m].

    Args:
        models: Models that support materials, by the name of the prediction.
        mean: Mean change in the material over all poses of the fit [m]; None if it was not draped.
        name: Name of the material.
        posed: The body.
        own: The garment in the material of the fit, simulated [m].
    """
    model = next(iter(models.values()))
    results = {"material left out": own}
    if mean is not None:
        binding, rest = binding_of(model), model.tables.rest.astype(np.float64)
        offsets = binding.offsets(posed.transforms, rest, own)
        results["mean change"] = binding.skin(posed.transforms, rest, offsets + mean)
    for prediction, each in models.items():
        after, before = (variant.drape(posed).astype(np.float64) for variant in (each.in_material(name), each))
        results[prediction] = own + after - before
    results["as played, material left out"] = model.drape(posed)
    results["as played"] = model.in_material(name).drape(posed)
    return results


def main() -> None:
    """Settles what the test set lacks, measures and records."""
    options = parse_options(
        __doc__,
        "anchors",
        "others...",
        test=(Path, "a folder for the test set; made and continued"),
        unknown=(["wool"], "materials that were not draped"),
        poses=(20, "number of test poses"),
        seed=0,
        jobs=1,
    )
    use_threads(1)
    dataset = leave_out_faulty(open_dataset(options.anchors))
    others = [leave_out_faulty(open_dataset(folder)) for folder in options.others]
    garment, anchors, body = dataset.garment, AnchorSet.of(dataset), bodies.load(dataset.garment.body_name).shaped()
    model = fit_materials(garment, anchors, others)
    poses = [pose for pose, _ in choose_pairs(options.poses, options.seed, garment.body_name)]
    plain = settle_in_poses(options.test / "as-fitted", garment, poses, jobs=options.jobs)
    by_name = {each.garment.material.name: each for each in others}
    for name in (*by_name, *options.unknown):
        truths = settle_in_poses(options.test / name, garment.in_material(Material.of(name)), poses, jobs=options.jobs)
        models, mean = {"told": model}, None
        if name in by_name:
            mean = MaterialChanges.of(garment, anchors, [by_name[name]]).added.mean(axis=0).reshape(-1, 3)
            rest = [each for other, each in by_name.items() if other != name]
            models |= {"told, from the others alone": fit_materials(garment, anchors, rest)} if rest else {}
        errors = []
        for pose, own, truth in zip(poses, plain, truths, strict=True):
            if own is not None and truth is not None:
                results = predictions(models, mean, name, body.posed(pose), own.astype(np.float64))
                errors.append({key: mean_distance_mm(vertices, truth) for key, vertices in results.items()})
        row = {
            "garment": garment.name,
            "from": garment.material.name,
            "to": name,
            "known": len(open_dataset(by_name[name].folder).anchors()) if name in by_name else 0,
            "judged": len(errors),
            "error_mm": {key: round(mean_of(errors, key), 2) for key in errors[0]},
        }
        print(record(NAME, row), flush=True)


if __name__ == "__main__":
    main()

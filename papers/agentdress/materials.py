"""Material as a third dimension: `python -m papers.agentdress.materials ANCHORS OTHER... --test FOLDER`.

It is future work of the paper. ANCHORS is what `hemline drape GARMENT --anchors ...` made, each OTHER the same garment
of another material in some of its poses (`hemline drape GARMENT --material NAME --poses-of ANCHORS`). Judged in poses
of clips of subjects that are in no fit, on the mean body, in which the garment is settled of all these materials and of
those named by `--unknown`; the folder of the test is made and continued.

The garment of the fit, simulated, stands for the pose model, so that what is missed is the material alone; *as played*
has the pose model, too. One JSON line a material goes to benchmarks/results/agentdress_materials.jsonl.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.fit.material_fit import MaterialChanges
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bench.machine import commit, machine
from hemline.bodies import PosedBody
from hemline.compiled import use_threads
from hemline.datasets import Dataset, open_dataset
from hemline.garments import Garment
from hemline.garments.material import MATERIALS
from hemline.motions.motion import Pose
from hemline.sim import produce_posed
from papers.agentdress.compared import binding_of
from papers.agentdress.pairs import chosen

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "agentdress_materials.jsonl"


def settled(folder: Path, garment: Garment, poses: list[Pose], jobs: int) -> list[np.ndarray | None]:
    """The garment in each pose on the mean body [m]; None where it came not to rest."""
    found = produce_posed(folder, garment, [[pose] for pose in poses], [()], jobs=jobs)
    dataset = open_dataset(folder)
    return [None if each is None else dataset.take(each.names[0]).vertices[0].astype(np.float64) for each in found]


def error_mm(guess: np.ndarray, truth: np.ndarray) -> float:
    """Mean distance of vertices [mm]."""
    return 1e3 * float(np.linalg.norm(guess - truth, axis=1).mean())


def fitted(garment: Garment, anchors: AnchorSet, others: Sequence[Dataset]) -> AnimatorAgentDress:
    """A model of these materials."""
    changes = MaterialChanges.of(garment, anchors, others)
    return fit_anchors(garment, anchors, AgentDressConfig(), materials=changes, progress=lambda *_: None)


def ways(
    models: dict[str, AnimatorAgentDress], mean: np.ndarray | None, name: str, posed: PosedBody, one: np.ndarray
) -> dict[str, np.ndarray]:
    """What each way makes of the garment of the fit in a pose [m].

    Args:
        models: Models that are told the material, by the way that they are a model of.
        mean: What the material adds in the mean over all poses of the fit [m]; None: it is in no fit.
        name: Of the material.
        posed: The body.
        one: The garment of its own material, simulated [m].
    """
    plain = next(iter(models.values()))
    binding, rest = binding_of(plain), plain.tables.rest.astype(np.float64)
    offsets = binding.offsets(posed.transforms, rest, one)
    found = {"material left out": one}
    if mean is not None:
        found["mean change"] = binding.skin(posed.transforms, rest, offsets + mean)
    for way, model in models.items():
        told, without = (each.settled(posed).astype(np.float64) for each in (model.in_material(name), model))
        found[way] = one + told - without
    found["as played, material left out"] = plain.settled(posed)
    found["as played"] = plain.in_material(name).settled(posed)
    return found


def main() -> None:
    """Settle what is missing, measure, print, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("anchors", type=Path)
    parser.add_argument("others", type=Path, nargs="+")
    parser.add_argument("--test", type=Path, required=True)
    parser.add_argument("--unknown", nargs="*", default=["wool"], choices=sorted(MATERIALS))
    parser.add_argument("--poses", type=int, default=20, help="poses that are judged")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    use_threads(1)
    dataset, others = open_dataset(asked.anchors), [open_dataset(folder) for folder in asked.others]
    garment, anchors, body = dataset.garment, AnchorSet.of(dataset), bodies.load(dataset.garment.body_name).shaped()
    whole = fitted(garment, anchors, others)
    poses = [pose for pose, _ in chosen(asked.poses, asked.seed, garment.body_name)]
    plain = settled(asked.test / "as-fitted", garment, poses, asked.jobs)
    by_name = {each.garment.material.name: each for each in others}
    for name in (*by_name, *asked.unknown):
        worn = settled(asked.test / name, garment.in_material(MATERIALS[name]), poses, asked.jobs)
        models, mean = {"told": whole}, None
        if name in by_name:
            added = MaterialChanges.of(garment, anchors, [by_name[name]]).added
            mean = added.mean(axis=0).reshape(-1, 3)
            rest = [each for other, each in by_name.items() if other != name]
            models |= {"told, from the others alone": fitted(garment, anchors, rest)} if rest else {}
        rows = [
            {way: error_mm(guess, truth) for way, guess in ways(models, mean, name, body.posed(pose), one).items()}
            for pose, one, truth in zip(poses, plain, worn, strict=True)
            if one is not None and truth is not None
        ]
        row = {
            "garment": garment.name,
            "from": garment.material.name,
            "to": name,
            "known": len(open_dataset(by_name[name].folder).anchors()) if name in by_name else 0,
            "judged": len(rows),
            "error_mm": {way: round(float(np.mean([each[way] for each in rows])), 2) for way in rows[0]},
            "machine": machine(),
            "commit": commit(),
        }
        print(row, flush=True)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()

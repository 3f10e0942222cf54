"""Material as a third dimension: `python benchmarks/claims/agentdress/materials.py ANCHORS TEST`.

It is future work of the paper. ANCHORS is what `hemline drape GARMENT --anchors ...` made, TEST a folder for what is
settled here, made and continued: the garment of other materials walked into some of the anchors' poses, and into poses
of clips of subjects that are in no fit, on the mean body. What the material changes at the anchors is carried to the
other poses as AgentDress carries what the shape changes: blended over the nearest anchors (Eq. 8), in the turned frames
of the vertices.

The garment of the fit, simulated, stands for the pose model, so that what is missed is the material alone. One JSON
line a material goes to benchmarks/results/agentdress_materials.jsonl.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from compared import binding_of
from convergence import chosen
from pairs import chosen as chosen_pairs

from hemline import bodies
from hemline.animators.agentdress.anchor_set import AnchorSet
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit import fit_anchors
from hemline.animators.agentdress.rigged_anchors import blend_of
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.datasets import open_dataset
from hemline.datasets.joint_sensitivity import joint_weights
from hemline.garments import Garment
from hemline.garments.material import MATERIALS
from hemline.motions.motion import Pose
from hemline.sim import produce_posed

RESULTS = Path(__file__).parents[2] / "results" / "agentdress_materials.jsonl"


def settled(folder: Path, garment: Garment, poses: list[Pose], jobs: int) -> list[np.ndarray | None]:
    """The garment in each pose on the mean body [m]; None where it came not to rest."""
    found = produce_posed(folder, garment, [[pose] for pose in poses], [()], jobs=jobs)
    dataset = open_dataset(folder)
    return [None if each is None else dataset.take(each.names[0]).vertices[0].astype(np.float64) for each in found]


def main() -> None:
    """Settle what is missing, measure, print, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("anchors", type=Path)
    parser.add_argument("test", type=Path)
    parser.add_argument("--materials", nargs="+", default=["silk", "denim"], choices=sorted(MATERIALS))
    parser.add_argument("--known", type=int, default=12, help="anchors in which the material is known")
    parser.add_argument("--poses", type=int, default=10, help="poses that are judged")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    use_threads(1)
    dataset = open_dataset(asked.anchors)
    garment, anchors, body = dataset.garment, AnchorSet.of(dataset), bodies.load(dataset.garment.body_name).shaped()
    model = fit_anchors(garment, anchors, AgentDressConfig(), progress=lambda stage, done, total: None)
    binding, rest = binding_of(model), model.tables.rest.astype(np.float64)
    some = chosen(anchors.rotations, joint_weights(anchors.sensitivity[0]), asked.known)
    known = [Pose(anchors.rotations[each].astype(np.float32), body.rest_pose.translation) for each in some]
    others = [pose for pose, _ in chosen_pairs(asked.poses, asked.seed, garment.body_name)]
    plain = settled(asked.test / "as-fitted", garment, [*known, *others], asked.jobs)
    for name in asked.materials:
        worn = settled(asked.test / name, replace(garment, material=MATERIALS[name]), [*known, *others], asked.jobs)
        changes, usable = [], []
        for number, pose in enumerate(known):
            one, other = plain[number], worn[number]
            if one is not None and other is not None:
                transforms = body.posed(pose).transforms
                change = binding.offsets(transforms, rest, other) - binding.offsets(transforms, rest, one)
                changes.append(change)
                usable.append(some[number])
        rows = []
        for number, pose in enumerate(others, len(known)):
            one, truth = plain[number], worn[number]
            if one is None or truth is None:
                continue
            transforms = body.posed(pose).transforms
            offsets = binding.offsets(transforms, rest, one)
            blend = blend_of(model, anchors.rotations[usable], pose)
            ways = {
                "material left out": offsets,
                "change of the nearest anchors": offsets + np.einsum("va,avi->vi", blend, np.array(changes)),
                "mean change": offsets + np.mean(changes, axis=0),
            }
            rows.append(
                {
                    way: 1e3 * float(np.linalg.norm(binding.posed(transforms, rest, each) - truth, axis=1).mean())
                    for way, each in ways.items()
                }
            )
        row = {
            "garment": garment.name,
            "from": garment.material.name,
            "to": name,
            "known": len(usable),
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

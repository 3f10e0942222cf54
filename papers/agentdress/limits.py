"""Where AgentDress ends, too loose and too tight: `python -m papers.agentdress.limits MODEL ANCHORS TEST`.

MODEL is a file or the name of a shipped model, ANCHORS the dataset that it was fitted to, TEST a folder for the test
set, made and continued here. First the garment of the model on bodies from small to large, the one of Fig. 13 among
them, in poses of clips of subjects that are in no fit. Then other garments, close and loose: the simulation on the mean
body, and what the shape adds in the nearest anchor's pose, simulated too (Eq. 3 with all its terms known), so that what
is missed is the assumption that skinning carries shape from pose to pose.

One JSON line goes to benchmarks/results/agentdress_limits.jsonl; the page papers/agentdress/pages/limits.md and its pictures
are written anew.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

import hemline
from hemline import bodies, garments, motions
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Vertices
from hemline.bench.machine import commit, machine
from hemline.bodies import Body, PosedBody, ShapedBody
from hemline.collide.winding.numbers import inside
from hemline.compiled import use_threads
from hemline.datasets import open_dataset
from hemline.garments import Garment
from hemline.meshes import edge_strains
from hemline.motions.motion import Pose
from hemline.sim import produce_posed, produce_rests
from hemline.sim.takes.database import poses_of
from papers.agentdress.limits_page import PAGES, draw_curves, draw_worst, page

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "agentdress_limits.jsonl"
CLIPS = ("run", "walk", "jump", "kick", "dance")
"""Shipped excerpts, no other clip of whose subjects is in a fit."""
GARMENTS = ("tshirt-light", "skirt-light", "cape-light")
FIGURE = (-2.0, 2.0, 0.0, 0.0)
"""Betas of the body of Fig. 13."""
HALF = (-1.0, 1.0, 0.0, 0.0)
"""The body on which other garments are judged: half way to that of Fig. 13."""


def volume(body: Body, betas: np.ndarray) -> float:
    """Volume of a body in its rest pose [m^3]."""
    shaped = body.shaped(betas.astype(np.float32))
    a, b, c = shaped.vertices[body.faces].astype(np.float64).transpose(1, 0, 2)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


def shapes_of(body: Body) -> dict[str, tuple[float, ...]]:
    """Betas by name of the body: along the first one; Fig. 13's; as far away, where the volume grows fastest."""
    grows = np.array([volume(body, each) - volume(body, -each) for each in 0.5 * np.eye(4)])
    heavy = np.linalg.norm(FIGURE) * grows / np.linalg.norm(grows)
    along = {f"first beta {first:g}": (first,) for first in (-2.0, -1.0, 0.0, 1.0, 2.0)}
    return {"of Fig. 13": FIGURE} | along | {"heaviest": tuple(heavy.tolist()), "lightest": tuple((-heavy).tolist())}


def poses_from_clips(count: int, seed: int, body: Body) -> list[Pose]:
    """Poses that nobody fitted to, arms lifted as in anchors."""
    rotations = poses_of([motions.load(name) for name in CLIPS])
    chosen = np.random.default_rng(seed).permutation(len(rotations))[:count]
    return [Pose(rotations[each].astype(np.float32), body.shaped().rest_pose.translation) for each in chosen]


def walked(folder: Path, garment: Garment, poses: list[Pose], betas: tuple[float, ...], jobs: int) -> list:
    """The garment in each pose on a body [m], None where it did not come to rest."""
    found = produce_posed(folder, garment, [[pose] for pose in poses], [betas], jobs=jobs)
    dataset = open_dataset(folder)
    return [None if each is None else dataset.take(each.names[0]).vertices[0] for each in found]


def apart_mm(one: Vertices, other: Vertices) -> float:
    """Mean distance of vertices [mm]."""
    return 1e3 * float(np.linalg.norm(np.asarray(one, np.float64) - other, axis=1).mean())


def fit_of(worn: Vertices, posed: PosedBody, garment: Garment) -> dict[str, float]:
    """How a simulated garment fits: mean distance to the closest vertex of the body, mean stretch of its edges."""
    from scipy.spatial import KDTree

    gap = KDTree(posed.vertices).query(worn)[0].mean()
    strains = edge_strains(worn, garment.faces, garment.rest_edges)
    return {"gap_mm": 1e3 * float(gap), "stretch_percent": 100 * float(np.maximum(strains, 0).mean())}


def on_body(model: AnimatorAgentDress, betas: tuple[float, ...], each: tuple[Pose, Vertices, Vertices]) -> dict:
    """Errors in one pose, given the simulated garment on the mean body and on this one."""
    pose, mean, truth = each
    tables, body = model.tables, bodies.load(model.body_name)
    binding = Binding(tables.indices, tables.weights, tables.nearest)
    plain, posed = body.shaped().posed(pose), body.shaped(np.array(betas, np.float32)).posed(pose)
    nominal = binding.offsets(plain.transforms, tables.rest, mean).astype(np.float32)
    driven = replace(tables, pose_weights=np.zeros_like(tables.pose_weights), offset=nominal)
    ours = model.settled(posed)
    return fit_of(truth, posed, model.garment) | {
        "error_mm": apart_mm(ours, truth),
        "driven_mm": apart_mm(replace(model, tables=driven).settled(posed), truth),
        "inside_percent": 100 * float(np.mean(inside(posed.vertices, posed.faces, ours))),
    }


def synthesised(
    binding: Binding,
    shaped: tuple[ShapedBody, ShapedBody],
    rests: tuple[np.ndarray, np.ndarray],
    anchor: Pose,
    settled: tuple[Vertices, Vertices],
    pose: Pose,
    mean: Vertices,
) -> np.ndarray:
    """Eq. 3: the garment on a body in a pose (verts, 3) [m].

    Args:
        binding: Of the garment.
        shaped: The mean body, and this one.
        rests: The garment in the rest pose on both [m].
        anchor: The pose of the anchor.
        settled: The garment there on both [m].
        pose: The pose.
        mean: The garment there on the mean body [m].
    """
    there = [
        binding.offsets(each.posed(anchor).transforms, rest, worn)
        for each, rest, worn in zip(shaped, rests, settled, strict=True)
    ]
    nominal = binding.offsets(shaped[0].posed(pose).transforms, rests[0], mean)
    return binding.skin(shaped[1].posed(pose).transforms, rests[1], nominal + there[1] - there[0])


def transferred(folder: Path, garment: Garment, poses: list[Pose], anchors: list[Pose], jobs: int) -> dict | None:
    """Eq. 3 with every term simulated, of a garment on the body half way to Fig. 13's; None: it never came to rest."""
    body = bodies.load(garment.body_name)
    rests = produce_rests(folder, garment, [(), HALF])
    if any(isinstance(each, str) for each in rests):
        return None
    plain, other = (each.vertices[0].astype(np.float64) for each in rests if not isinstance(each, str))
    two = body.shaped(), body.shaped(np.array(HALF, np.float32))
    binding = Binding.of(plain.astype(np.float32), garment.faces, two[0].posed(two[0].rest_pose))
    at, near = ([walked(folder, garment, where, betas, jobs) for betas in ((), HALF)] for where in (poses, anchors))
    found = []
    for pose, anchor, *worn in zip(poses, anchors, *at, *near, strict=True):
        if any(each is None for each in worn):
            continue
        mean, truth, *settled = worn
        posed = two[1].posed(pose)
        told = synthesised(binding, two, (plain, other), anchor, (settled[0], settled[1]), pose, mean)
        skinned = binding.skin(posed.transforms, other)
        errors = {"error_mm": apart_mm(told, truth), "skinned_mm": apart_mm(skinned, truth)}
        found.append(fit_of(truth, posed, garment) | errors)
    return mean_of(found) | {"poses": len(found)} if found else None


def mean_of(rows: list[dict]) -> dict[str, float]:
    """The mean of each figure."""
    return {name: round(float(np.mean([row[name] for row in rows])), 2) for name in rows[0]}


def nearest(anchors: AnchorSet, pose: Pose) -> Pose:
    """The anchor whose joints are turned most alike."""
    alike = np.abs(np.einsum("aji,ji->aj", anchors.rotations, pose.rotations.astype(np.float64)))
    angles = 2 * np.arccos(np.minimum(alike, 1)).mean(axis=1)
    return Pose(anchors.rotations[angles.argmin()].astype(np.float32), pose.translation)


def main() -> None:
    """Make what is missing of the test set, measure, print, record, draw."""
    parser = argparse.ArgumentParser(description="Where AgentDress ends: too loose, too tight.")
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("anchors", type=Path, help="the dataset that it was fitted to")
    parser.add_argument("test", type=Path, help="a folder for the test set; made and continued")
    parser.add_argument("--poses", type=int, default=5, help="poses on each body, and of each garment")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    use_threads(1)
    model, anchors = hemline.load(asked.model), AnchorSet.of(open_dataset(asked.anchors))
    assert isinstance(model, AnimatorAgentDress)
    body = bodies.load(model.body_name)
    poses = poses_from_clips(asked.poses, asked.seed, body)
    means = walked(asked.test / model.garment.name, model.garment, poses, (), asked.jobs)
    by_body, worst = {}, None
    for name, betas in shapes_of(body).items():
        truths = walked(asked.test / model.garment.name, model.garment, poses, betas, asked.jobs)
        each = [(p, m, t) for p, m, t in zip(poses, means, truths, strict=True) if m is not None and t is not None]
        if not each:
            continue
        rows = [on_body(model, betas, one) for one in each]
        by_body[name] = mean_of(rows) | {"betas": [round(b, 2) for b in betas], "poses": len(rows)}
        print(f"{name:<16} {by_body[name]}", flush=True)
        if betas == FIGURE:
            worst = each[int(np.argmax([row["error_mm"] for row in rows]))]
    near, by_garment = [nearest(anchors, pose) for pose in poses], {}
    for name in GARMENTS:
        by_garment[name] = transferred(asked.test / name, garments.load(name), poses, near, asked.jobs)
        print(f"{name:<16} {by_garment[name]}", flush=True)
    row = {"garment": model.garment.name, "by_body": by_body, "by_garment": by_garment}
    row |= {"threads": 1, "machine": machine(), "commit": commit()}
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")
    draw_curves(row)
    if worst is not None:
        pose, mean, truth = worst
        posed = body.shaped(np.array(FIGURE, np.float32)).posed(pose)
        draw_worst(model.garment.faces, body.shaped().posed(pose), mean, posed, truth, model.settled(posed))
    (PAGES / "limits.md").write_text(page(row))


if __name__ == "__main__":
    main()

"""The clothing shape model beside DRAPE's: `python -m papers.agentdress.shape_models ANCHORS TEST`.

ANCHORS is a dataset of anchors, TEST a folder for the test set, made and continued here: the garment walked
(`sim.rest.walk`) into poses of some anchors on random bodies. In each of these poses every way is fitted to the same
seventeen drapes and compared with the same test drapes (section 4.3 and Figs. 6 and 7 of the paper).

One JSON line goes to benchmarks/results/agentdress_shape_models.jsonl; the page papers/agentdress/pages/shape_models.md and its
pictures are written anew. With another number of random betas than the four of the paper, only the line is.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.bench.machine import commit, machine
from hemline.collide.winding.numbers import inside
from hemline.compiled import use_threads
from hemline.datasets import open_dataset
from papers.agentdress.shape_drapes import settled_drapes, some_shapes
from papers.agentdress.shape_drawing import draw_bars, draw_components, draw_predictions
from papers.agentdress.shape_page import MOVED, page
from papers.agentdress.shape_ways import COMPONENTS, Ways, apart_mm

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "agentdress_shape_models.jsonl"
FOLDER = ROOT / "papers" / "agentdress" / "pages"
MOST, PAPERS_BETAS, SHOWN, WORST = 10, 4, 1, 5
"""Components at most; betas of the paper; number of the pose of Fig. 7, right, from 0; worst shapes that are listed."""
OURS, DRAPE = "coordinates", "DRAPE"


def by_components(scenes: list[Ways]) -> dict[str, np.ndarray]:
    """Mean error of predictions on unseen shapes, by the number of components [mm]."""
    found: dict[str, list[float]] = {"coordinates": [], "gradients": []}
    for count in range(1, MOST + 1):
        ours, theirs = [], []
        for each in scenes:
            known = each.known(each.drapes.betas)
            rows = each.coordinates(components=count).at(known)
            ours.append(apart_mm(rows.reshape(len(known), -1, 3), each.drapes.unseen))
            theirs.append(apart_mm(each.drape(components=count).at(known), each.drapes.unseen))
        found["coordinates"].append(float(np.concatenate(ours).mean()))
        found["gradients"].append(float(np.concatenate(theirs).mean()))
    return {name: np.array(values) for name, values in found.items()}


def inside_percent(ways: Ways, worn: np.ndarray) -> float:
    """Vertices inside the body, mean over the unseen shapes."""
    posed = [ways.posed(betas) for betas in ways.drapes.betas]
    each = zip(worn, posed, strict=True)
    return 100 * float(
        np.mean([inside(there.vertices, there.faces, cloth.astype(np.float32)) for cloth, there in each])
    )


def milliseconds(ways: Ways) -> dict[str, float]:
    """Median time of one prediction, its model fitted."""
    betas, found = ways.known(ways.drapes.betas)[:1], {}
    for name, model in {OURS: ways.coordinates(), DRAPE: ways.drape()}.items():
        taken = []
        for _ in range(20):
            begun = time.perf_counter()
            model.at(betas)
            taken.append(time.perf_counter() - begun)
        found[name] = 1e3 * float(np.median(taken))
    return found


def worst_shapes(scenes: list[Ways], errors: dict[str, list[np.ndarray]]) -> list[dict]:
    """Shapes with the largest mean error over the poses."""
    by_shape: dict[tuple[float, ...], list[tuple[float, float]]] = {}
    for each, ours, theirs in zip(scenes, errors[OURS], errors[DRAPE], strict=True):
        for betas, *both in zip(each.drapes.betas.tolist(), ours, theirs, strict=True):
            by_shape.setdefault(tuple(betas), []).append((float(both[0]), float(both[1])))
    means = {betas: np.mean(both, axis=0) for betas, both in by_shape.items()}
    order = sorted(means, key=lambda betas: -means[betas][0])[:WORST]
    return [{"betas": [round(b, 2) for b in each], OURS: means[each][0], DRAPE: means[each][1]} for each in order]


def measured(scenes: list[Ways]) -> dict:
    """All figures."""
    errors: dict[str, list[np.ndarray]] = {}
    before, after = [], []
    for each in scenes:
        found = each.all()
        for name in (OURS, DRAPE):
            pushed = each.pushed_out(found[name])
            if name == OURS:
                before.append(inside_percent(each, found[name]))
                after.append(inside_percent(each, pushed))
            found[f"{name}, pushed out of the body"] = pushed
        for name, worn in found.items():
            errors.setdefault(name, []).append(apart_mm(worn, each.drapes.unseen))
    means = {name: float(np.concatenate(values).mean()) for name, values in errors.items()}
    poses = {name: [float(value.mean()) for value in values] for name, values in errors.items()}
    lower = 100 * (1 - np.array(poses[OURS]) / np.array(poses[DRAPE]))
    shares = [each.shares(MOST) for each in scenes]
    return {
        "pairs": sum(len(each.drapes.betas) for each in scenes),
        "error_mm": means,
        "error_p90_mm": {name: float(np.percentile(np.concatenate(each), 90)) for name, each in errors.items()},
        "error_by_pose_mm": {name: poses[name] for name in (OURS, DRAPE, MOVED)},
        "lower_than_drape_percent": {
            "all": 100 * (1 - means[OURS] / means[DRAPE]),
            "pose, least": lower.min(),
            "pose, most": lower.max(),
            "as played": 100 * (1 - means["kernel over pose and shape, as played"] / means[DRAPE]),
        },
        "squares_gain_percent": 100 * (1 - means[OURS] / means["coordinates, without squares"]),
        "explained_percent": {
            name: (100 * np.mean([share[name] for share in shares], axis=0)).tolist() for name in shares[0]
        },
        "error_by_components_mm": {name: each.tolist() for name, each in by_components(scenes).items()},
        "inside_percent": {"as predicted": float(np.mean(before)), "pushed out": float(np.mean(after))},
        "milliseconds": milliseconds(scenes[0]),
        "worst": worst_shapes(scenes, errors),
    }


def rounded(value: Any) -> Any:
    """Floats of a row to four digits after the point."""
    if isinstance(value, dict):
        return {name: rounded(each) for name, each in value.items()}
    if isinstance(value, list):
        return [rounded(each) for each in value]
    return round(float(value), 4) if isinstance(value, float) else value


def main() -> None:
    """Make what is missing of the test set, measure, print, record, draw."""
    parser = argparse.ArgumentParser(description="The clothing shape model beside DRAPE's.")
    parser.add_argument("anchors", type=Path, help="a dataset of anchors")
    parser.add_argument("test", type=Path, help="a folder for the test set; made and continued")
    parser.add_argument("--poses", type=int, default=8, help="anchors; the paper has 20")
    parser.add_argument("--shapes", type=int, default=20, help="random bodies in each; the paper has 100")
    parser.add_argument("--betas", type=int, default=PAPERS_BETAS, help="how many betas of them are random")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    use_threads(1)
    dataset = open_dataset(asked.anchors)
    garment, anchors = dataset.garment, AnchorSet.of(dataset)
    body = bodies.load(garment.body_name)
    shapes = some_shapes(body, asked.shapes, asked.betas, asked.seed)
    options = {"poses": asked.poses, "shapes": shapes, "seed": asked.seed, "jobs": asked.jobs}
    drapes = settled_drapes(anchors, asked.test, garment, **options)
    model = fit_anchors(garment, anchors, AgentDressConfig(), progress=lambda stage, done, total: None)
    scenes = [Ways.of(each, anchors, body, model) for each in drapes]
    row = {
        "garment": garment.name,
        "poses": len(scenes),
        "shapes": asked.shapes,
        "random_betas": asked.betas,
        "components": COMPONENTS,
    } | measured(scenes)
    row = rounded(row) | {"threads": 1, "machine": machine(), "commit": commit()}
    for name, value in row["error_mm"].items():
        print(f"{name:<42} {value:6.2f} mm, nine in ten below {row['error_p90_mm'][name]:6.2f}")
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")
    if asked.betas != PAPERS_BETAS:
        return
    folder = FOLDER / "shape_models"
    shares = {name: np.array(each) / 100 for name, each in row["explained_percent"].items()}
    draw_components(folder, shares, {n: np.array(each) for n, each in row["error_by_components_mm"].items()})
    draw_bars(folder, row["error_by_pose_mm"])
    shown = scenes[min(SHOWN, len(scenes) - 1)]
    told = shown.all()
    worst = int(apart_mm(told[OURS], shown.drapes.unseen).argmax())
    draw_predictions(folder, shown, worst, {name: told[name][worst] for name in (OURS, DRAPE, MOVED)})
    (FOLDER / "shape_models.md").write_text(page(row))


if __name__ == "__main__":
    main()

"""Measures how far models are from the simulation on garments that they were not fitted to, by class of garment.

    python -m papers.swingar.unseen TAKES... --model swingar --model lag --model live \\
        --model "lag, trained alike"=FILE -o benchmarks/results/unseen.json

TAKES are datasets of test garments, subjects and bodies that `python -m hemline.models.make.swingar_takes` made. The
baselines are the settled garment skinned with the weights of the nearest skin, skinned with the soft weights of `lag`
and `swingar`, and carried rigidly with the key joint. Models are evaluated as the player shows them, with projection.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hemline import bodies, load
from hemline.animators import Animator
from hemline.animators.soft_weights import soft_weights
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody, skin_points
from hemline.compiled import threads
from hemline.datasets import Dataset, Take, open_dataset
from hemline.errors import BadDataset
from hemline.garments import Garment
from hemline.meshes import ClosestTree, edge_strains
from hemline.motions import JOINT_NAMES
from hemline.playback.play import play
from hemline.playback.tally import Tally

LOOSE_MM = 25.0
"""Mean distance to the skin at rest from which a garment counts as loose."""
EVERY = 2
"""Interval between the frames in which baselines are evaluated."""


@dataclass(frozen=True)
class Rest:
    """A garment settled on a body, with the baselines that carry it along."""

    garment: Garment
    shaped: ShapedBody
    vertices: np.ndarray

    @property
    def gap_mm(self) -> float:
        """Mean distance from the skin [mm]."""
        skin = ClosestTree(self.shaped.vertices, self.shaped.body.faces)
        return 1e3 * float(skin.closest(self.vertices).distances.mean())

    def errors_mm(self, take: Take) -> dict[str, list[float]]:
        """Returns the errors of the baselines in every other frame [mm]."""
        body, soft = self.shaped.body, soft_weights(self.vertices, self.shaped.body, self.shaped.vertices)
        near = ClosestTree(self.shaped.vertices, body.faces).closest(self.vertices)
        nearest = body.faces[near.faces, near.weights.argmax(axis=1)]
        ways = {"skinned": (body.weight_indices[nearest], body.weights[nearest]), "skinned softly": tuple(soft)}
        found: dict[str, list[float]] = {name: [] for name in (*ways, "carried rigidly")}
        for frame in take.clip_frames[::EVERY]:
            transforms, truth = self.shaped.posed(take.motion[frame]).transforms, take.vertices[frame]
            for name, (joints, weights) in ways.items():
                found[name].append(apart_mm(skin_points(transforms, joints, weights, self.vertices), truth))
            key = transforms[JOINT_NAMES.index(self.garment.key_joint)]
            found["carried rigidly"].append(apart_mm(self.vertices @ key[:, :3].T + key[:, 3], truth))
        return found


def apart_mm(one: np.ndarray, other: np.ndarray) -> float:
    """Returns the mean distance of vertices [mm]."""
    return 1e3 * float(np.linalg.norm(one.astype(np.float64) - other, axis=1).mean())


def evaluate_garment(data: Dataset, models: dict[str, Any], most: int) -> dict[str, Any]:
    """Returns the row of one garment."""
    garment, clips = data.garment, data.clips()[:most]
    worn = {
        name: model.animator_for(garment, bodies.load(garment.body_name).shaped()) for name, model in models.items()
    }
    figures: dict[str, list[dict[str, float]]] = {name: [] for name in worn}
    carried: dict[str, list[float]] = {}
    gaps = []
    for row in clips:
        shaped, take = bodies.load(garment.body_name).shaped(row.betas), data.take(row)
        rest = Rest(garment.dressed(shaped), shaped, data.rest(shaped.betas).vertices[0])
        gaps.append(rest.gap_mm)
        for name, errors in rest.errors_mm(take).items():
            carried.setdefault(name, []).extend(errors)
        for name, animator in worn.items():
            figures[name].append(evaluate_take(animator, shaped, take))
    return {
        "garment": garment.name,
        "class": "loose" if np.mean(gaps) > LOOSE_MM else "close-fitting",
        "gap_mm": float(np.mean(gaps)),
        "vertices": len(garment.vertices),
        "takes": len(clips),
        "frames": sum(row.clip_frames for row in clips),
        "carried_mm": {name: float(np.mean(errors)) for name, errors in carried.items()},
        "relatives": {name: each.relatives for name, each in worn.items() if hasattr(each, "relatives")},
        "models": {name: means(each) for name, each in figures.items()},
    }


def means(rows: list[dict[str, float]]) -> dict[str, float]:
    """Averages figures over takes."""
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}


def evaluate_take(animator: Animator, shaped: ShapedBody, take: Take) -> dict[str, float]:
    """Returns figures of a take as the player shows it. Frames of the lead-in do not count."""
    tally = Tally(animator)
    for index, frame in enumerate(play(animator, shaped, take.motion, fps=None, placed=True, pre_roll=0.0)):
        if not take.lead_in[index]:
            tally.add(frame, take.vertices[index], take.motion.fps)
    found = tally.figures()
    strains = [
        float(np.percentile(np.maximum(edge_strains(each, animator.garment.faces, animator.garment.rest_edges), 0), 99))
        for each in take.vertices[take.clip_frames[::EVERY]]
    ]
    return {
        "error_mm": found["vertex_error_mm"]["mean"],
        "error_p95_mm": found["vertex_error_mm"]["p95"],
        "normal_deg": found["normal_error_deg"]["mean"],
        "jerk_ratio": found["jerk_m_s3"]["ratio"],
        "stretch_p99_percent": found["stretch_percent"]["p99_mean"],
        "truth_stretch_p99_percent": 100 * float(np.mean(strains)),
        "inside_before_percent": found["inside_percent"]["before"],
        "inside_percent": found["inside_percent"]["after"],
        "animator_ms": found["frame_ms"]["stages"]["animator"],
        "frame_ms": found["frame_ms"]["median"],
    }


def summary(rows: list[dict[str, Any]]) -> str:
    """Returns a table of classes; garments are weighted by their numbers of frames."""
    lines = []
    for kind in ("close-fitting", "loose"):
        of_kind = [row for row in rows if row["class"] == kind]
        if not of_kind:
            continue
        frames = [row["frames"] for row in of_kind]

        def mean(values: list[float], frames: list[int] = frames) -> str:
            return f"{np.average(values, weights=frames):.1f}"

        errors = {name: mean([row["carried_mm"][name] for row in of_kind]) for name in of_kind[0]["carried_mm"]}
        errors |= {name: mean([row["models"][name]["error_mm"] for row in of_kind]) for name in of_kind[0]["models"]}
        lines.append(f"{kind}: {len(of_kind)} garments, {sum(frames)} frames, mm: {errors}")
    return "\n".join(lines)


def main() -> None:
    """Evaluates all garments, prints and writes the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("takes", nargs="+", type=Path)
    parser.add_argument("--model", action="append", default=[], help="a shipped model, or LABEL=FILE")
    parser.add_argument("--most", type=int, default=100, help="takes of each garment at most")
    parser.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    shipped = {name: load(name) for name in given.model if "=" not in name}
    named = {label: load(file) for label, _, file in (name.partition("=") for name in given.model if "=" in name)}
    skinned = {
        f"{name}, begins skinned": each.with_simulated_start(0.0)
        for name, each in shipped.items()
        if each.name in ("lag", "swingar")
    }
    models, rows = shipped | named | skinned, []
    for folder in given.takes:
        try:
            data = open_dataset(folder)
            if not data.clips():
                continue
        except BadDataset:
            continue
        rows.append(evaluate_garment(data, models, given.most))
        errors = rows[-1]["carried_mm"] | {name: each["error_mm"] for name, each in rows[-1]["models"].items()}
        print(rows[-1]["garment"], rows[-1]["class"], {name: round(mm, 1) for name, mm in errors.items()}, flush=True)
        if given.output:
            made = {"machine": machine(), "threads": threads(), "commit": commit(), "rows": rows}
            given.output.write_text(json.dumps(made, indent=1, default=float) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()

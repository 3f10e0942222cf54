"""How far models are from the simulation on garments that they were not fitted to, by class of garment.

    python benchmarks/claims/swingar/unseen.py TAKES... --model swingar --model live -o PAGE.json

TAKES are datasets that `python -m hemline.models.make.swingar_takes` made of garments, subjects and bodies apart. Beside
each model: the settled garment skinned, with the soft weights of the fit and with those of the nearest skin, and carried
rigidly with the key joint. Errors are of the vertices in the world, mean of the frames, before whole cloth and
projection; then as it is shown.
"""

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline import bodies, load
from hemline.animators import Wearable
from hemline.animators.swingar.soft_weights import soft_weights
from hemline.bodies import ShapedBody, skin_points
from hemline.datasets import Take, open_dataset
from hemline.errors import HemlineError
from hemline.garments import Garment
from hemline.meshes import ClosestTree
from hemline.motions import JOINT_NAMES
from hemline.playback import Player

LOOSE_MM = 40.0
"""Mean distance to the skin at rest from which a garment is called loose."""


@dataclass(frozen=True)
class Rest:
    """A garment settled on a body, and the ways of carrying it without any learning."""

    garment: Garment
    shaped: ShapedBody
    vertices: np.ndarray

    @property
    def gap_mm(self) -> float:
        """Mean distance to the skin."""
        return 1e3 * float(
            ClosestTree(self.shaped.vertices, self.shaped.body.faces).closest(self.vertices).distances.mean()
        )

    def baselines(self, take: Take, frames: np.ndarray) -> dict[str, np.ndarray]:
        """Error of each frame by way [m]."""
        soft = soft_weights(self.vertices, self.shaped)
        body = self.shaped.body
        nearest = np.linalg.norm(self.vertices[:, None] - self.shaped.vertices[None, ::4], axis=2).argmin(axis=1) * 4
        key = JOINT_NAMES.index(self.garment.key_joint)
        found: dict[str, list[float]] = {"skinned softly": [], "skinned": [], "carried rigidly": []}
        for frame in frames:
            transforms, truth = self.shaped.posed(take.motion[frame]).transforms, take.vertices[frame]
            for name, joints, weights in (
                ("skinned softly", soft.joints, soft.weights),
                ("skinned", body.weight_indices[nearest], body.weights[nearest]),
            ):
                found[name].append(apart(skin_points(transforms, joints, weights, self.vertices), truth))
            t = transforms[key]
            found["carried rigidly"].append(apart(self.vertices @ t[:, :3].T + t[:, 3], truth))
        return {name: np.array(errors) for name, errors in found.items()}


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Mean distance of vertices [m]."""
    return float(np.linalg.norm(one.astype(np.float64) - other, axis=1).mean())


def played(animator, shaped: ShapedBody, take: Take, frames: np.ndarray, shown: bool) -> dict[str, np.ndarray | float]:
    """Error of each frame [m], and milliseconds of a step."""
    wanted, errors, spans = set(frames.tolist()), [], []
    player = Player.prepare(animator, shaped, placed=True) if shown else None
    state = player.start(take.motion[0]) if player else animator.start(shaped.posed(take.motion[0]))
    for frame in range(1, len(take.motion)):
        began = time.perf_counter()
        if player:
            state, seen = player.step(state, take.motion[frame], 1 / take.motion.fps)
            vertices = seen.vertices
        else:
            state, vertices = animator.step(state, shaped.posed(take.motion[frame]), 1 / take.motion.fps)
        spans.append(1e3 * (time.perf_counter() - began))
        if frame in wanted:
            errors.append(apart(vertices, take.vertices[frame]))
    return {"errors": np.array(errors), "ms": float(np.median(spans))}


def main() -> None:
    """Judge, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("takes", nargs="+", type=Path)
    parser.add_argument("--model", action="append", default=[])
    parser.add_argument("--shown", action="store_true", help="as the player shows it, too")
    parser.add_argument("--most", type=int, default=100, help="takes of each garment at most")
    parser.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    models = {name: load(name) for name in given.model}
    rows = []
    for folder in given.takes:
        try:
            data = open_dataset(folder)
            clips = data.clips()[: given.most]
        except HemlineError:
            continue
        if not clips:
            continue
        garment, found = data.garment, {}
        gaps: list[float] = []
        made = {}
        for row in clips:
            shaped = bodies.load(garment.body_name).shaped(row.betas)
            take = data.take(row)
            frames = take.clip_frames[take.clip_frames > 0][::2]
            rest = Rest(garment.dressed(shaped), shaped, data.rest(shaped.betas).vertices[0])
            gaps.append(rest.gap_mm)
            for name, errors in rest.baselines(take, frames).items():
                found.setdefault(name, []).append(errors)
            for name, model in models.items():
                if name not in made:
                    assert isinstance(model, Wearable)
                    made[name] = model.worn_by(garment, bodies.load(garment.body_name).shaped())
                for shown in (False, True) if given.shown else (False,):
                    told = played(made[name], shaped, take, frames, shown)
                    label = f"{name}, shown" if shown else name
                    found.setdefault(label, []).append(told["errors"])
                    found.setdefault(f"{label} ms", []).append(np.array([told["ms"]]))
        row = {"garment": folder.name, "vertices": len(garment.vertices), "takes": len(clips), "gap_mm": np.mean(gaps)}
        row["class"] = "loose" if row["gap_mm"] > LOOSE_MM else "close"
        row["frames"] = int(sum(len(each) for each in found["skinned"]))
        for name, errors in found.items():
            all_errors = np.concatenate(errors)
            row[name] = float(all_errors.mean()) * (1 if name.endswith(" ms") else 1e3)
        rows.append(row)
        print({k: round(v, 1) if isinstance(v, float) else v for k, v in row.items()}, flush=True)
    for kind in ("loose", "close"):
        of_kind = [row for row in rows if row["class"] == kind]
        if of_kind:
            weights = [row["frames"] for row in of_kind]
            names = [k for k, v in of_kind[0].items() if isinstance(v, float) and k != "gap_mm"]
            means = {
                name: round(float(np.average([row[name] for row in of_kind], weights=weights)), 1) for name in names
            }
            print(kind, len(of_kind), "garments", sum(weights), "frames", means)
    if given.output:
        given.output.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()

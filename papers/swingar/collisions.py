"""Evaluates SwinGar's neural distance and collision handling: `python -m papers.swingar.collisions [MODEL ...]`.

First come errors of the distance around bodies in poses of test subjects, within and beyond the shapes of the training,
beside plain baselines. Each MODEL, a file of `hemline.models.make.neural_sdf`, adds a row. Then come Tables II and III:
light garments carried by plain skinning in clips of those subjects and pushed out of the body by Eq. 10 and by its two
baselines. The clips of ../shared/data/motion are needed.

Appends a JSON line to benchmarks/results/swingar_collisions.jsonl, and writes the page
papers/swingar/pages/collisions.md with its picture.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from hemline import bodies, garments
from hemline.bench.machine import commit, machine
from hemline.collide import Projector, inside
from hemline.collide.neural_sdf.exact import ExactDistance
from hemline.collide.neural_sdf.handling import (
    MovedGarment,
    Neighbours,
    push_out,
    push_out_by_distance,
    push_out_by_scale,
)
from hemline.collide.neural_sdf.inputs import condition
from hemline.collide.neural_sdf.neural_sdf import NeuralSdf, load_neural_sdf
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.compiled import use_threads
from hemline.learning.fit.distance_network import DistanceNetwork
from hemline.metrics import laplacian_deviation
from hemline.models.make.neural_sdf.samples import (
    MAX_BETA,
    DistanceSamples,
    clips_by_side,
    in_pelvis_frame,
    sample_bodies,
)
from papers.swingar.collisions_page import PAGE, PICTURES, page, picture

ROOT = Path(__file__).parents[2]
CLIPS = ROOT.parent / "shared" / "data" / "motion"
RESULTS = ROOT / "benchmarks" / "results" / "swingar_collisions.jsonl"
GARMENTS = ("tshirt-light", "dress-light", "skirt-light", "trousers-light")
BODIES, BEYOND = 15, 4.0
"""Number of posed bodies of each kind, and the largest beta of those beyond the training."""
CLIPS_A_GARMENT, FRAMES = 6, 6
"""Numbers of clips and of frames of each garment."""
NEAR = 0.01
"""Distance from the skin within which signs and gradients are evaluated [m]."""
BANDS = {
    "inside, deeper than 1 cm": (-np.inf, -NEAR),
    "within 1 cm": (-NEAR, NEAR),
    "1 to 5 cm": (NEAR, 0.05),
    "5 to 15 cm": (0.05, 0.15),
    "farther": (0.15, np.inf),
}

DistanceFunction = Callable[[object, np.ndarray], np.ndarray]
"""Returns the distances of points to a posed body."""


def nearest_vertex(posed, points: np.ndarray) -> np.ndarray:
    """Returns distances to the nearest vertex of the body, signed by its normal [m]."""
    distances, nearest = KDTree(posed.vertices).query(points)
    behind = np.einsum("pc,pc->p", points - posed.vertices[nearest], posed.normals[nearest]) < 0
    return np.where(behind, -distances, distances)


def rounded_cones(posed, points: np.ndarray) -> np.ndarray:
    """Returns distances to the rounded cones of `BodyPrimitives` [m]."""
    return BodyPrimitives.fit(posed.shaped).distances(points, posed.transforms)[0]


def posed_bodies(samples: DistanceSamples):
    """Yields each posed body of the samples, in the frame of its pelvis."""
    body = bodies.load("anny24")
    for betas, rotations in zip(samples.betas, samples.rotations, strict=True):
        shaped = body.shaped(betas)
        yield shaped.posed(in_pelvis_frame(shaped, rotations))


def errors(samples: DistanceSamples, function: DistanceFunction) -> dict[str, float]:
    """Returns the mean error of each band [mm], and wrong signs within a centimetre [%]."""
    pairs = zip(posed_bodies(samples), samples.points, strict=True)
    found = np.concatenate([function(body, points) for body, points in pairs])
    truth = samples.distances.reshape(-1)
    off = 1000 * np.abs(found - truth)
    near, clear = np.abs(truth) < NEAR, (np.abs(truth) < NEAR) & (np.abs(truth) > 0.002)
    wrong = (found < 0) != (truth < 0)
    result = {name: float(off[(truth >= low) & (truth < high)].mean()) for name, (low, high) in BANDS.items()}
    return result | {
        "p95 within 1 cm": float(np.percentile(off[near], 95)),
        "wrong sign": 100 * float(wrong[near].mean()),
        "wrong sign beyond 2 mm": 100 * float(wrong[clear].mean()),
    }


def turned_deg(samples: DistanceSamples, model: NeuralSdf) -> float:
    """Returns the mean angle between the gradient and the true one within a centimetre of the skin [degrees]."""
    angles = []
    for posed, *row in zip(posed_bodies(samples), samples.points, samples.distances, samples.gradients, strict=True):
        points, truth, normals = row
        near = np.abs(truth) < NEAR
        gradients = model.at(posed).with_gradients(points[near])[1]
        cosine = (gradients * normals[near]).sum(axis=1) / np.linalg.norm(gradients, axis=1)
        angles.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return float(np.concatenate(angles).mean())


def fastest_ms(work: Callable[[], object], turns: int = 8) -> float:
    """Returns the least time of several runs [ms]; other work on the machine only adds to it."""
    work()
    found = []
    for _ in range(turns):
        began = time.perf_counter()
        work()
        found.append(1000 * (time.perf_counter() - began))
    return min(found)


def times(model: NeuralSdf, samples: DistanceSamples) -> dict[str, float]:
    """Measures a frame of 1,000 points with everything that depends on the pose, without skinning the body [ms]."""
    posed, points = next(iter(posed_bodies(samples))), samples.points[0, :1000]
    _ = posed.vertices, posed.normals
    body = posed.shaped.body
    read = len(condition(posed.shaped.betas, posed.pose.rotations))
    wide = DistanceNetwork.initialize(model.inputs, width=512, condition=read, seed=0)
    wide = wide.to_neural_sdf((body.name, body.hash), model.beta_range, {})
    return {
        "neural, value": fastest_ms(lambda: model.at(posed).signed_distances(points)),
        "neural, value and gradient": fastest_ms(lambda: model.at(posed).with_gradients(points)),
        "neural of 512, value": fastest_ms(lambda: wide.at(posed).signed_distances(points), 5),
        "neural of 512, value and gradient": fastest_ms(lambda: wide.at(posed).with_gradients(points), 5),
        "exact, value and gradient": fastest_ms(lambda: ExactDistance.of(posed).with_gradients(points), 5),
        "nearest vertex": fastest_ms(lambda: nearest_vertex(posed, points)),
        "rounded cones": fastest_ms(lambda: rounded_cones(posed, points)),
    }


@dataclass(frozen=True)
class Known:
    """A distance that was evaluated at all vertices of a frame."""

    distances: np.ndarray
    gradients: np.ndarray

    def signed_distances(self, points: np.ndarray) -> np.ndarray:
        """Returns the distances of all vertices [m]."""
        return self.distances

    def with_gradients(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns distances [m] and gradients of the vertices inside."""
        inside = self.distances < 0
        return self.distances[inside], self.gradients[inside]


def carried(garment, shaped) -> Callable[[object], np.ndarray]:
    """Returns a function that skins the garment with the weights of the nearest vertices of the body at rest."""
    rest = garment.dressed(shaped).vertices
    nearest = KDTree(shaped.vertices).query(rest)[1]
    indices, weights = shaped.body.weight_indices[nearest], shaped.body.weights[nearest]
    return lambda posed: bodies.skin_points(posed.transforms, indices, weights, rest)


def corrections(vertices: np.ndarray, distance, neighbours: Neighbours) -> dict[str, MovedGarment]:
    """Pushes vertices out of the body in three ways.

    Returns:
        Eq. 10; `TailorNet`, one distance for all, a millimetre more than the deepest vertex; `ReFU`, a scale of the
        depths that moves vertices as far on average as Eq. 10 does.
    """
    ours = push_out(vertices, distance, neighbours)
    signed = distance.signed_distances(vertices)
    if not ours.moved.any():
        return dict.fromkeys(("TailorNet", "ReFU", "Eq. 10"), ours)
    depths = -signed[ours.moved]
    scale = float(np.linalg.norm(ours.vertices - vertices, axis=1)[ours.moved].mean() / depths.mean())
    return {
        "TailorNet": push_out_by_distance(vertices, distance, float(depths.max()) + 0.001),
        "ReFU": push_out_by_scale(vertices, distance, max(scale, 1.0)),
        "Eq. 10": ours,
    }


def garment_rows(name: str, model: NeuralSdf, clips, seed: int) -> tuple[dict, dict, tuple]:
    """Returns means over frames of Table II, vertices inside [%], and of Table III, deviations; and the worst frame."""
    garment, body, random = garments.load(name), bodies.load("anny24"), np.random.default_rng(seed)
    neighbours = Neighbours.of(garment.vertices, garment.faces)
    shares: dict[str, list[float]] = {}
    deviations: dict[str, list[float]] = {}
    most, shown = -1.0, ()
    for clip in [clips[i] for i in random.choice(len(clips), CLIPS_A_GARMENT, replace=False)]:
        shaped = body.shaped(np.clip(random.normal(0, 1, len(body.shapedirs)), -2, 2))
        motion, carry = shaped.placed(clip), carried(garment, shaped)
        projector = Projector.prepare(shaped, garment.dressed(shaped).vertices, garment.faces)
        for frame in np.linspace(0, len(motion) - 1, 2 + FRAMES // CLIPS_A_GARMENT).astype(int)[1:-1]:
            posed = shaped.posed(shaped.untangle(motion[int(frame)]))
            vertices = carry(posed)
            sunk = inside(posed.vertices, posed.faces, vertices)
            frame_shares = {"before": sunk.mean()}
            for kind, asked in (("neural", model.at(posed)), ("exact", ExactDistance.of(posed))):
                distance = Known(*asked.with_gradients(vertices))
                for way, found in corrections(vertices, distance, neighbours).items():
                    frame_shares[f"{way}, {kind}"] = inside(posed.vertices, posed.faces, found.vertices).mean()
                    moved = laplacian_deviation(vertices, found.vertices, garment.faces, found.moved)
                    if np.isfinite(moved):
                        deviations.setdefault(f"{way}, {kind}", []).append(moved)
                    if (way, kind) == ("Eq. 10", "neural"):
                        corrected = found.vertices
            _, out, report = projector.project(projector.start(), posed, corrected, dt=1 / 30)
            left = inside(posed.vertices, posed.faces, out)
            left[report.pinched] = False
            frame_shares |= {"projected": left.mean(), "pinched": len(report.pinched) / len(out)}
            for key, share in frame_shares.items():
                shares.setdefault(key, []).append(100 * float(share))
            if sunk.mean() > most:
                most, shown = float(sunk.mean()), (name, posed, garment.faces, vertices, corrected, out)
    means = {key: float(np.mean(each)) for key, each in shares.items()}
    return means, {key: float(np.mean(each)) for key, each in deviations.items()}, shown


def main() -> None:
    """Measures everything and writes the page."""
    use_threads(1)
    model, body = load_neural_sdf(), bodies.load("anny24")
    if not CLIPS.is_dir():
        sys.exit(f"{CLIPS} is missing: clips of held-out subjects are needed")
    clips = clips_by_side(CLIPS)["test"]
    known = sample_bodies(body, clips, BODIES, np.random.default_rng(7))
    beyond = sample_bodies(body, clips, BODIES, np.random.default_rng(8), largest=BEYOND)
    rows: dict[str, DistanceFunction] = {"shipped": lambda posed, points: model.at(posed).signed_distances(points)}
    trials = {Path(name).stem: load_neural_sdf(name) for name in sys.argv[1:]}
    for name, trial in trials.items():
        rows[name] = lambda posed, points, trial=trial: trial.at(posed).signed_distances(points)
    rows |= {"rounded cones": rounded_cones, "nearest vertex": nearest_vertex}
    result = {
        "machine": machine(),
        "commit": commit(),
        "date": time.strftime("%Y-%m-%d"),
        "model": dict(model.figures) | {"inputs": model.inputs, "width": model.width, "flops": model.flops()},
        "trials": {n: dict(t.figures) | {"inputs": t.inputs, "width": t.width} for n, t in trials.items()},
        "largest_beta": {"known": MAX_BETA, "beyond": BEYOND},
        "bodies": BODIES,
        "frames": FRAMES,
        "known": {name: errors(known, way) for name, way in rows.items()},
        "beyond": {name: errors(beyond, rows[name]) for name in ("shipped", "rounded cones", "nearest vertex")},
        "turned_deg": {"known": turned_deg(known, model), "beyond": turned_deg(beyond, model)},
        "ms": times(model, known),
        "inside": {},
        "deviation": {},
    }
    shown = []
    for seed, name in enumerate(GARMENTS):
        result["inside"][name], result["deviation"][name], worst = garment_rows(name, model, clips, seed)
        shown.append(worst)
        print(name, result["inside"][name], result["deviation"][name], flush=True)
    RESULTS.write_text(json.dumps(result) + "\n")
    PICTURES.mkdir(parents=True, exist_ok=True)
    picture(shown, PICTURES / "worst.png")
    PAGE.write_text(page(result))
    print(page(result))


if __name__ == "__main__":
    main()

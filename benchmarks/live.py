"""Compares `live` with full simulations: `python -m benchmarks.live TAKES...`.

TAKES are datasets of one garment each on the mean body (`hemline simulate skirt-light -m walk kick -o TAKES`). First,
500 to 1,500 simulated vertices carry the fine garment, which gives the error of the embedding. Then the proxy mesh is
simulated at each quality and carries the fine mesh, before whole cloth and projection. Baselines are the settled drape
moved rigidly with the key joint, and skinned with the weights of the nearest skin. Times are those of the animator
alone, the smaller one of two runs. Writes one JSON line per clip to benchmarks/results/live_claims.jsonl, and prints a
table of the means of each garment.
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.live import Live, LiveConfig
from hemline.animators.live.config import QUALITY_LEVELS
from hemline.bench.machine import commit, machine
from hemline.bodies import ShapedBody, skin_points
from hemline.compiled import threads
from hemline.datasets import Take, open_dataset
from hemline.garments import Garment
from hemline.garments.proxy.embedding import Embedding
from hemline.garments.proxy.proxy import ProxySize, proxy_of
from hemline.motions import JOINT_NAMES

RESULTS = Path(__file__).parent / "results" / "live_claims.jsonl"
QUALITIES = (*QUALITY_LEVELS, "exact")
SIZES = (500, 1000, 1500)
RUNS = 2


def distance_mm(one: np.ndarray, other: np.ndarray) -> float:
    """Returns the mean distance of equal vertices [mm]."""
    return 1e3 * float(np.linalg.norm(one.astype(np.float64) - other, axis=-1).mean())


def embedding_error_mm(garment: Garment, take: Take) -> dict[int, float]:
    """Returns the error of a take whose own vertices carry the fine mesh, by number of carriers [mm]."""
    results = {}
    for size in SIZES:
        coarse, kept = proxy_of(garment, ProxySize(fewest=size, most=size))
        embedding = Embedding.of(garment, coarse, kept)
        fine = [take.vertices[frame] for frame in take.clip_frames]
        results[size] = float(
            np.mean([distance_mm(embedding.fine_vertices(each[kept].astype(np.float64)), each) for each in fine])
        )
    return results


def simulation_figures(garment: Garment, body: ShapedBody, take: Take) -> dict[str, dict[str, float]]:
    """Returns errors [mm] and times [ms] of each quality."""
    results = {}
    for quality in QUALITIES:
        animator = Live(LiveConfig(quality=quality)).animator_for(garment, body)
        spans, errors = [], []
        for _ in range(RUNS):
            state = animator.start(body.posed(take.motion[0]))
            spans.append([])
            errors.clear()
            for frame in range(1, len(take.motion)):
                posed = body.posed(take.motion[frame])
                began = time.perf_counter()
                state, vertices = animator.step(state, posed, 1 / take.motion.fps)
                spans[-1].append((time.perf_counter() - began) * 1e3)
                if not take.lead_in[frame]:
                    errors.append(distance_mm(vertices, take.vertices[frame]))
        fastest = np.min(spans, axis=0)
        results[quality] = {
            "error_mm": float(np.mean(errors)),
            "ms": float(np.median(fastest)),
            "ms_p95": float(np.percentile(fastest, 95)),
            "ms_worst": float(fastest.max()),
        }
    return results


def baselines_mm(garment: Garment, body: ShapedBody, take: Take) -> dict[str, float]:
    """Returns the errors of the settled drape moved rigidly, and skinned [mm]."""
    from scipy.spatial import KDTree

    drape = take.vertices[0].astype(np.float64)
    first = body.posed(take.motion[0])
    key, nearest = JOINT_NAMES.index(garment.key_joint), KDTree(first.vertices).query(drape)[1]
    indices, weights = body.body.weight_indices[nearest], body.body.weights[nearest]
    rest, rigid, skinned = _rest_positions(first.transforms, indices, weights, drape), [], []
    at_key = (drape - first.transforms[key, :, 3]) @ first.transforms[key, :, :3]
    for frame in take.clip_frames:
        transforms, truth = body.posed(take.motion[int(frame)]).transforms, take.vertices[frame]
        rigid.append(distance_mm(at_key @ transforms[key, :, :3].T + transforms[key, :, 3], truth))
        skinned.append(distance_mm(skin_points(transforms, indices, weights, rest.astype(np.float32)), truth))
    return {"drape carried rigidly": float(np.mean(rigid)), "drape skinned": float(np.mean(skinned))}


def _rest_positions(transforms: np.ndarray, indices: np.ndarray, weights: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Returns the rest positions that skinning takes to these points."""
    blended = np.einsum("vk,vkij->vij", weights, transforms[indices]).astype(np.float64)
    return np.linalg.solve(blended[:, :, :3], (points - blended[:, :, 3])[:, :, None])[:, :, 0]


def table(lines: list[dict]) -> str:
    """Returns the means of each garment over its clips as Markdown: errors [mm] and times [ms] of each quality."""
    heads = [f"`{quality}` {unit}" for unit in ("[mm]", "[ms]", "p95 [ms]") for quality in QUALITIES]
    rows = [["garment", "clips", *heads, "skinned [mm]"]]
    for name in dict.fromkeys(line["garment"] for line in lines):
        own = [line for line in lines if line["garment"] == name]
        figures = [
            float(np.mean([line["simulated"][quality][key] for line in own]))
            for key in ("error_mm", "ms", "ms_p95")
            for quality in QUALITIES
        ]
        skinned = float(np.mean([line["baselines_mm"]["drape skinned"] for line in own]))
        rows.append([name, str(len(own)), *(f"{figure:.1f}" for figure in [*figures, skinned])])
    rows.insert(1, ["---"] * len(rows[0]))
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main() -> None:
    """Measures, prints and records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("takes", type=Path, nargs="+", help="Datasets of one garment each.")
    lines = []
    for folder in parser.parse_args().takes:
        dataset = open_dataset(folder)
        garment, body = dataset.garment, bodies.load(dataset.garment.body_name).shaped()
        for row in dataset.clips():
            take = dataset.take(row)
            take = replace(take, end_state={})
            line = {
                "garment": garment.name,
                "clip": row.clip,
                "frames": len(take.clip_frames),
                "carried_mm": embedding_error_mm(garment, take),
                "simulated": simulation_figures(garment, body, take),
                "baselines_mm": baselines_mm(garment, body, take),
                "threads": threads(),
                "machine": machine(),
                "commit": commit(),
            }
            print(json.dumps(line), flush=True)
            with RESULTS.open("a") as stream:
                stream.write(json.dumps(line) + "\n")
            lines.append(line)
    print(table(lines))


if __name__ == "__main__":
    main()

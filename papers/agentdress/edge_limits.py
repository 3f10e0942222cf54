"""What edge limits are worth: `python -m papers.agentdress.edge_limits MODEL DATA`.

DATA is what `hemline drape GARMENT --anchors ...` made, or the test set of `errors.py`. Prints, for limits of several
stretches and none: the mean distance of the vertices to the settled garment, the 99th percentile of stretch beside the
pattern and the garment at rest on the same body, and the shares of edges that are longer by 15 and by 30 %. The
simulation stands beside them.
"""

import argparse
from pathlib import Path

import numpy as np

import hemline
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bench.machine import commit, machine
from hemline.collide import EdgeLimits
from hemline.datasets import Dataset, Row, open_dataset
from hemline.meshes import rest_lengths

STRETCHES = (None, 1.3, 1.2, 1.15, 1.1, 1.05)


def lengths_of(vertices: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Of edges [m]."""
    return np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)


def figures(dataset: Dataset, rows: list[Row], model: AnimatorAgentDress) -> dict[str, np.ndarray]:
    """Error [mm], p99, shares above 15 and 30 % [%], each the mean over rows, by name."""
    garment, body = model.garment, hemline.bodies.load(model.body_name)
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    found: dict[str, list[list[float]]] = {}
    for row in rows:
        take = dataset.take(row)
        posed, truth = body.shaped(row.betas).posed(take.motion[0]), take.vertices[0]
        rest, blended = model.at_rest(model.start(posed)), model.settled(posed)
        longest = np.maximum(lengths, lengths_of(rest, edges))
        shown = {"simulation": truth}
        for stretch in STRETCHES:
            name = "no limits" if stretch is None else f"{stretch:g}"
            shown[name] = blended
            if stretch is not None:
                shown[name] = EdgeLimits.of(garment, stretch=stretch).shorten(blended, rest)
        for name, vertices in shown.items():
            strain = lengths_of(vertices, edges) / longest - 1
            error = 1e3 * float(np.linalg.norm(vertices - truth, axis=1).mean())
            long = [100 * float((strain > share).mean()) for share in (0.15, 0.3)]
            found.setdefault(name, []).append([error, 100 * float(np.percentile(strain, 99)), *long])
    return {name: np.mean(each, axis=0) for name, each in found.items()}


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", help="a model file, or the name of a shipped model")
    parser.add_argument("data", type=Path)
    parser.add_argument("--most", type=int, default=200, help="garments at most, drawn by chance")
    asked = parser.parse_args()
    dataset, model = open_dataset(asked.data), hemline.load(asked.model)
    assert isinstance(model, AnimatorAgentDress)
    rows = [row for row in dataset.rows() if row.kind == "anchor" and not row.failed]
    rows = [rows[index] for index in np.random.default_rng(0).permutation(len(rows))[: asked.most]]
    print(f"{model.garment.name}: {len(rows)} settled garments, {machine()}, {commit()}")
    print(f"{'stretch':<12}{'error, mm':>10}{'p99, %':>8}{'> 15 %':>8}{'> 30 %':>8}")
    for name, (error, *stretched) in figures(dataset, rows, model).items():
        print(f"{name:<12}{error:>10.3f}" + "".join(f"{each:>8.2f}" for each in stretched))


if __name__ == "__main__":
    main()

"""The effect of edge limits: `python -m papers.agentdress.edge_limits MODEL DATA`.

DATA is a dataset made by `hemline drape GARMENT --anchors ...`, or the test set of `errors.py`. Prints, for several
limits and none, and for the simulation: the mean distance of vertices from the settled garment, the 99th percentile of
stretch relative to the pattern and to the garment at rest on the same body, and the fractions of edges longer by 15 and
30 %.
"""

import numpy as np

import hemline
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bench.machine import commit, machine
from hemline.collide import EdgeLimits
from hemline.datasets import Dataset, Row, open_dataset
from hemline.meshes import rest_lengths
from papers.agentdress.settled.pairs import mean_distance_mm
from papers.report import parse_options

STRETCHES = (None, 1.3, 1.2, 1.15, 1.1, 1.05)


def edge_lengths(vertices: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Returns the length of each edge [m]."""
    return np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)


def measure(dataset: Dataset, rows: list[Row], model: AnimatorAgentDress) -> dict[str, np.ndarray]:
    """Returns error [mm], p99 [%] and edges above 15 and 30 % [%], means over rows, by name."""
    garment, body = model.garment, hemline.bodies.load(model.body_name)
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    figures: dict[str, list[list[float]]] = {}
    for row in rows:
        take = dataset.take(row)
        posed, truth = body.shaped(row.betas).posed(take.motion[0]), take.vertices[0]
        rest, prediction = model.at_rest(model.start(posed)), model.drape(posed)
        longest = np.maximum(lengths, edge_lengths(rest, edges))
        garments = {"simulation": truth}
        for stretch in STRETCHES:
            name = "no limits" if stretch is None else f"{stretch:g}"
            garments[name] = prediction
            if stretch is not None:
                garments[name] = EdgeLimits.of(garment, stretch=stretch).shorten(prediction, rest)
        for name, vertices in garments.items():
            strain = edge_lengths(vertices, edges) / longest - 1
            error = mean_distance_mm(vertices, truth)
            long = [100 * float((strain > limit).mean()) for limit in (0.15, 0.3)]
            figures.setdefault(name, []).append([error, 100 * float(np.percentile(strain, 99)), *long])
    return {name: np.mean(each, axis=0) for name, each in figures.items()}


def main() -> None:
    """Measures and prints."""
    options = parse_options(__doc__, "model", "data", most=(200, "largest number of garments, drawn at random"))
    dataset, model = open_dataset(options.data), hemline.load(options.model)
    assert isinstance(model, AnimatorAgentDress)
    rows = [row for row in dataset.rows() if row.kind == "anchor" and not row.failed]
    rows = [rows[index] for index in np.random.default_rng(0).permutation(len(rows))[: options.most]]
    print(f"{model.garment.name}: {len(rows)} settled garments, {machine()}, {commit()}")
    print(f"{'stretch':<12}{'error, mm':>10}{'p99, %':>8}{'> 15 %':>8}{'> 30 %':>8}")
    for name, (error, *stretches) in measure(dataset, rows, model).items():
        print(f"{name:<12}{error:>10.3f}" + "".join(f"{each:>8.2f}" for each in stretches))


if __name__ == "__main__":
    main()

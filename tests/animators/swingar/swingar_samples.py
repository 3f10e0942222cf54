"""Small meshes and random input for the tests of SwinGar's network."""

import numpy as np

from hemline.animators.swingar.estimator_config import EstimatorConfig
from hemline.animators.swingar.graph import Graph

SMALL = {"descriptor": 16, "graph": 8, "motion": 12, "state": 10, "blend": 9, "blend_last": 7, "corrective": 6}


def sheet(rows: int = 6, columns: int = 7, size: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a bent sheet."""
    ids = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (each.ravel() for each in (ids[:-1, :-1], ids[:-1, 1:], ids[1:, :-1], ids[1:, 1:]))
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)]).astype(np.int32)
    u, v = np.meshgrid(np.linspace(0, size, rows), np.linspace(0, 1.3 * size, columns), indexing="ij")
    points = np.stack([u, v, 0.1 * np.sin(5 * u + v) + 0.3 * u * v], -1).reshape(-1, 3)
    return points.astype(np.float32), faces


def graph_of(rows: int = 6, columns: int = 7) -> Graph:
    """The graph of such a sheet."""
    return Graph.of(sheet(rows, columns)[1], rows * columns)


def inputs(config: EstimatorConfig, vertex_count: int, frames: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Random input of an estimator, float32."""
    random = np.random.default_rng(seed)

    def drawn(*shape: int) -> np.ndarray:
        return (0.4 * random.normal(size=shape)).astype(np.float32)

    turns = drawn(frames, vertex_count, 4) + np.float32([1, 0, 0, 0])
    weights = random.dirichlet(np.full(24, 0.3), vertex_count) + 1e-3
    return {
        "features": drawn(vertex_count, 7),
        "descriptor": np.abs(drawn(config.descriptor)),
        "skin_logits": np.log(weights).astype(np.float32),
        "motion": drawn(frames, 65, 75),
        "told": drawn(frames, vertex_count, config.told),
        "turns": turns / np.linalg.norm(turns, axis=-1, keepdims=True),
        "transforms": drawn(frames, 24, 3, 4),
        "meshes": drawn(frames, 3, vertex_count, 3),
        "joints": drawn(frames, 3, 24, 3),
        "body": drawn(frames, config.body),
    }

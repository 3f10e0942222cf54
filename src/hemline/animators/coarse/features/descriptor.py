"""The spectral descriptor, which describes a whole garment by a few hundred numbers."""

import warnings
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np

from hemline.arrays import Faces, Float, Int, Vertices
from hemline.errors import BadMesh, HemlineWarning
from hemline.meshes.edges import edges

AFFINITY_RADIUS = 0.6
"""Distance at which the affinity of two points has fallen to 0.61 [m]."""
COMPRESSION = 10.0
"""Factor of eigenvalues before the inverse hyperbolic sine that compresses them for comparison and for networks."""
SAME_DISTANCE = 1e-5
"""Distances that differ by less count as equal [m]."""
MAX_SEARCHES = 400
"""Largest number of searches for the most eccentric vertex of a part."""


@dataclass(frozen=True, eq=False)
class Descriptor:
    r"""Eigenvalues of the affinities $e^{-d^2 / 2\sigma^2}$ of points spread over a garment.

    Neither moving the garment rigidly nor bending it changes them, nor does the order of its vertices.
    """

    eigenvalues: Float[np.ndarray, " descriptor"]
    """Eigenvalues in descending order [1], float32. Their sum is the number of points. Some are negative, since paths
    along edges are not straight. Zeros fill up the array if the garment has fewer vertices."""
    samples: Int[np.ndarray, " samples"]
    """Vertex ids of the points in the order in which they were chosen."""

    def pad_to(self, size: int) -> Float[np.ndarray, " size"]:
        """Returns the eigenvalues, filled up with zeros to a size [1], float32."""
        return np.pad(self.eigenvalues, (0, max(0, size - len(self.eigenvalues))))

    @classmethod
    def of(
        cls,
        vertices: Vertices,
        faces: Faces,
        *,
        size: int = 256,
        distance: Literal["geodesic", "euclidean"] = "geodesic",
    ) -> Self:
        """Computes the descriptor of a garment at rest.

        The first point is the most eccentric vertex, each next one the vertex that is farthest along edges from all
        points before it; of several equally distant vertices, the one with the largest sum of distances. Parts without
        a connection have no affinity; the part of the largest extent comes first.

        Args:
            vertices: Positions [m].
            faces: Triangles.
            size: Number of eigenvalues.
            distance: Distance along edges, as in the paper, or straight through the air (the ablation of Table I).

        Raises:
            BadMesh: The mesh is empty.

        Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Section III-B; Dijkstra, "A note on two problems in connexion
            with graphs", 1959; Takes, Kosters, "Determining the diameter of small world networks", 2011 (bounds that
            save the searches from most vertices). Differs: they begin with a random vertex.
        """
        samples, between = sample_points(vertices, faces, size)
        if len(samples) < size:
            what, got = f"a spectral descriptor of {size} numbers is filled up with zeros", f"{len(samples)} vertices"
            warnings.warn(HemlineWarning(what, got, "use a finer mesh"), stacklevel=2)
        if distance == "euclidean":
            points = np.asarray(vertices, np.float64)[samples]
            between = np.linalg.norm(points[:, None] - points[None], axis=2)
        found = np.linalg.eigvalsh(affinity(between))
        filled = np.concatenate([found, np.zeros(size - len(found))])
        return cls(np.sort(filled)[::-1].astype(np.float32), samples)

    def distance(self, other: "Descriptor") -> float:
        """Returns the difference of two garments [1]: the distance of their sorted, compressed eigenvalues.

        Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Section V-A; Hoffman, Wielandt, "The variation of the spectrum of
            a normal matrix", 1953 (sorted, the distance of eigenvalues is the least norm of the difference of the
            affinities over all rotations). Differs: eigenvalues are compared, as points of two garments do not
            correspond; compressed, as the first few of 256 would count alone.
        """
        return float(np.linalg.norm(compress_eigenvalues(self.eigenvalues) - compress_eigenvalues(other.eigenvalues)))


def compress_eigenvalues(eigenvalues: Float[np.ndarray, "... descriptor"]) -> Float[np.ndarray, "... descriptor"]:
    """Compresses eigenvalues, so that differences of large ones count relative to their size; float64."""
    return np.arcsinh(COMPRESSION * np.asarray(eigenvalues, np.float64))


def sample_points(
    vertices: Vertices, faces: Faces, size: int
) -> tuple[Int[np.ndarray, " samples"], Float[np.ndarray, "samples samples"]]:
    """Chooses points spread over a garment; returns them and their distances along edges [m], inf between two parts.

    Args:
        vertices: Positions [m].
        faces: Triangles.
        size: Number of points; all vertices are chosen if there are fewer.

    Raises:
        BadMesh: The mesh is empty.
    """
    if len(vertices) == 0 or len(faces) == 0:
        raise BadMesh("a spectral descriptor needs a mesh", "no triangles", "check the file")
    samples, distances = _farthest_points(_edge_lengths(vertices, faces), min(size, len(vertices)))
    between = distances[:, samples]
    return samples, 0.5 * (between + between.T)


def affinity(distances: np.ndarray) -> np.ndarray:
    r"""Returns $e^{-d^2 / 2\sigma^2}$ of distances [m], where $\sigma$ is `AFFINITY_RADIUS`."""
    return np.exp(-((distances / AFFINITY_RADIUS) ** 2) / 2)


def eigenvectors(
    vertices: Vertices, faces: Faces, descriptor: Descriptor, count: int = 6
) -> Float[np.ndarray, "verts count"]:
    r"""Estimates the first eigenvectors of the affinities of all vertices from those of the points (Fig. 4).

    $\hat Q = \sqrt{z / N}\, A_{Nz} U \Lambda^{-1}$: the Nystroem extension.

    Args:
        vertices: Positions [m].
        faces: Triangles.
        descriptor: The descriptor of the mesh.
        count: Number of eigenvectors.

    Returns:
        Eigenvectors as columns [1], about unit length; the sum of each is positive.

    Source: Fowlkes, Belongie, Chung, Malik, "Spectral grouping using the Nyström method", 2004, Eq. 7; Li, Shi, Zhu,
        Kanai, "SwinGar", 2023, Section III-B.
    """
    samples = descriptor.samples
    distances = _from(_edge_lengths(vertices, faces), samples)
    values, vectors = np.linalg.eigh(affinity(distances[:, samples]))
    values, vectors = values[::-1][:count], vectors[:, ::-1][:, :count]
    found = np.sqrt(len(samples) / len(vertices)) * affinity(distances).T @ vectors / values
    return found * np.where(found.sum(0) < 0, -1.0, 1.0)


def _edge_lengths(vertices: np.ndarray, faces: np.ndarray) -> Any:
    from scipy.sparse import csr_matrix

    pairs = edges(faces)
    points = np.asarray(vertices, np.float64)
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1).clip(1e-9)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    return csr_matrix((np.tile(length, 2), both.T), (len(points), len(points)))


def _from(lengths: Any, sources: np.ndarray) -> np.ndarray:
    from scipy.sparse.csgraph import dijkstra

    return dijkstra(lengths, indices=sources)


def _farthest_points(lengths: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Chooses points by farthest point sampling; returns them and the distances of all vertices from each."""
    firsts = _first_points(lengths)[:count]
    samples = [firsts.pop(0)]
    rows = [_from(lengths, np.array(samples))[0]]
    nearest = rows[0].copy()
    total = np.where(np.isfinite(rows[0]), rows[0], 0.0)
    while len(samples) < count:
        if firsts:
            chosen = firsts.pop(0)
        else:
            far = np.flatnonzero(nearest >= nearest.max() - SAME_DISTANCE)
            chosen = int(far[np.argmax(np.round(total[far] / SAME_DISTANCE))])
        samples.append(chosen)
        rows.append(_from(lengths, np.array([chosen]))[0])
        nearest = np.minimum(nearest, rows[-1])
        total += np.where(np.isfinite(rows[-1]), rows[-1], 0.0)
    return np.array(samples), np.stack(rows)


def _first_points(lengths: Any) -> list[int]:
    """Returns the most eccentric vertex of each part, that of the part of the largest extent first."""
    from scipy.sparse.csgraph import connected_components

    count, part = connected_components(lengths, directed=False)
    found = [_most_eccentric(lengths, np.flatnonzero(part == i)) for i in range(count)]
    return [vertex for _, _, vertex in sorted(found, key=lambda each: (-round(each[0] / SAME_DISTANCE), -each[1]))]


def _most_eccentric(lengths: Any, members: np.ndarray) -> tuple[float, float, int]:
    """Finds the most eccentric vertex of a part; each search bounds the eccentricity of all other vertices.

    Returns:
        Eccentricity [m], sum of distances [m] and vertex id.
    """
    if len(members) == 1:
        return 0.0, 0.0, int(members[0])
    within = lengths[members][:, members]
    upper, best = np.full(len(members), np.inf), (0.0, 0.0, 0)
    for _ in range(MAX_SEARCHES):
        chosen = int(np.argmax(upper))
        row = _from(within, np.array([chosen]))[0]
        extent, total = row.max(), row.sum()
        upper = np.minimum(upper, row + extent)
        upper[chosen] = -np.inf
        if (round(extent / SAME_DISTANCE), round(total / SAME_DISTANCE)) > (
            round(best[0] / SAME_DISTANCE),
            round(best[1] / SAME_DISTANCE),
        ):
            best = extent, total, chosen
        if upper.max() < best[0] - SAME_DISTANCE:
            break
    return best[0], best[1], int(members[best[2]])

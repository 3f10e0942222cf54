"""The rim that a garment hangs from, as a line, and the point of that line which is nearest to each vertex."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadGarment
from hemline.garments.upper_rim import upper_rim

if TYPE_CHECKING:
    from hemline.garments.garment import Garment


@dataclass(frozen=True, eq=False)
class PinnedRim:
    """Vertices along the lower edge of the pinned part, in order."""

    vertices: Int[np.ndarray, " rim"]
    """Garment vertex ids."""
    fractions: Float[np.ndarray, " rim"]
    """Arc length up to each vertex, as a fraction of the rim's length."""
    length: float
    """Length of the rim [m]."""
    closed: bool
    """Whether the rim is a loop, as on a skirt."""

    @property
    def widest_gap(self) -> float:
        """Largest distance between two neighbours on the rim, as a fraction of the length."""
        fractions = np.append(self.fractions, 1.0) if self.closed else self.fractions
        return float(np.diff(fractions).max())

    def point(self, fraction: float) -> tuple[Int[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Returns the point at a fraction of the length: corners and weights of a (degenerate) triangle."""
        following = int(np.searchsorted(self.fractions, fraction, side="right"))
        first = max(following - 1, 0)
        second = following % len(self.vertices) if self.closed else min(following, len(self.vertices) - 1)
        end = 1.0 if second == 0 and self.closed else self.fractions[second]
        width = end - self.fractions[first]
        part = float(np.clip((fraction - self.fractions[first]) / width, 0, 1)) if width > 0 else 0.0
        one, two = self.vertices[first], self.vertices[second]
        return np.array([one, two, two]), np.array([1 - part, part, 0.0])

    def difference(
        self, places: Float[np.ndarray, "*some"], fraction: float | Float[np.ndarray, "*some"]
    ) -> Float[np.ndarray, "*some"]:
        """Returns the signed distance of places from `fraction` along the rim; the shorter way around a closed one."""
        difference = places - fraction
        return (difference + 0.5) % 1 - 0.5 if self.closed else difference


def suspension_vertices(garment: "Garment") -> Int[np.ndarray, " pinned"]:
    """Returns the vertices that chains hang from: the pinned ones, or the upper rim if nothing is pinned."""
    return garment.pins.vertices if len(garment.pins) else upper_rim(garment.vertices, garment.faces)


def rim_of(garment: "Garment") -> PinnedRim:
    """Returns the pinned vertices with a free neighbour, in order along the mesh.

    If their edges do not form a single line, they are ordered along the upper rim if they are that rim, and otherwise
    by their angle around the vertical axis.

    Raises:
        BadGarment: There are fewer than two such vertices, or all are in one place.
    """
    pinned = np.zeros(len(garment.vertices), np.bool_)
    pinned[suspension_vertices(garment)] = True
    edges = np.unique(np.sort(garment.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    mixed = edges[pinned[edges[:, 0]] != pinned[edges[:, 1]]]
    border = np.unique(mixed[pinned[mixed]])
    inner = np.isin(edges, border).all(1)
    order, closed = _trace_border(border, edges[inner])
    if order is None:
        upper = upper_rim(garment.vertices, garment.faces)
        if np.array_equal(np.sort(upper), np.flatnonzero(pinned)):
            order, closed = upper, bool((edges == np.sort(upper[[0, -1]])).all(axis=1).any())
        else:
            order, closed = _order_around_vertical(garment, border)
    points = np.asarray(garment.vertices, np.float64)[order]
    if closed:
        points = np.concatenate([points, points[:1]])
    path = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if len(order) < 2 or path[-1] < 1e-6:
        raise BadGarment(
            f"garment '{garment.name}': chains hang from a pinned or an open rim",
            f"{len(order)} vertices there",
            "pin an edge of the cloth, or give chains",
        )
    return PinnedRim(order, path[: len(order)] / path[-1], float(path[-1]), closed)


def rim_coordinates(
    garment: "Garment", rim: PinnedRim, distance: Float[np.ndarray, " verts"]
) -> Float[np.ndarray, " verts"]:
    """Returns the fraction of the rim where the shortest path to each vertex starts.

    Vertices are processed in the order of their distance from the rim. The shortest path to a vertex arrives through
    one of its triangles, across the edge opposite the vertex. The fraction is interpolated between the ends of that
    edge, at the point where the path crosses it.
    """
    angle = (2 * np.pi if rim.closed else np.pi) * rim.fractions
    turn = np.zeros(len(distance), np.complex128)
    pinned = suspension_vertices(garment)
    turn[pinned] = _nearest_turns(garment, rim, pinned, np.exp(1j * angle))
    turn[rim.vertices] = np.exp(1j * angle)
    corner = np.concatenate([garment.faces[:, [k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)])
    flat = _flat_corners(garment)
    flat = np.concatenate([flat[:, [k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)])
    value, fraction = _fronts(flat, distance[corner[:, 1]], distance[corner[:, 2]])
    one, two, here = distance[corner[:, 1]], distance[corner[:, 2]], distance[corner[:, 0]]
    # an edge with one end farther away than the vertex itself: look back along the side to the other end
    alone = np.maximum(one, two) >= here
    side = np.linalg.norm(np.where((one < two)[:, None], flat[:, 1], flat[:, 2]) - flat[:, 0], axis=1)
    value = np.where(alone, np.minimum(one, two) + side, value)
    fraction = np.where(alone, (two < one) * 1.0, fraction)
    value = np.where(np.minimum(one, two) < here, value, np.inf)
    best = np.lexsort((value, corner[:, 0]))
    first = best[np.unique(corner[best, 0], return_index=True)[1]]
    source = np.zeros((len(distance), 2), np.int64)
    mix = np.zeros(len(distance))
    source[corner[first, 0]], mix[corner[first, 0]] = corner[first, 1:], fraction[first]
    for vertex in np.argsort(distance, kind="stable"):
        if turn[vertex] == 0 and np.isfinite(distance[vertex]):
            mixed = (1 - mix[vertex]) * turn[source[vertex, 0]] + mix[vertex] * turn[source[vertex, 1]]
            turn[vertex] = mixed / max(abs(mixed), 1e-12)
    angle = np.angle(turn)
    return (angle / (2 * np.pi)) % 1 if rim.closed else np.clip(angle / np.pi, 0, 1)


def _fronts(flat: np.ndarray, one: np.ndarray, two: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Extends distances `one` and `two` at the ends of an edge to the corner opposite, as for a straight wave front.

    Returns the distance at the first corner, and where the path crosses the edge, as a fraction of the edge.
    """
    base = flat[:, 2] - flat[:, 1]
    edge = np.maximum(np.linalg.norm(base, axis=1), 1e-12)
    along = ((flat[:, 0] - flat[:, 1]) * base).sum(1) / edge
    height = np.sqrt(np.maximum(((flat[:, 0] - flat[:, 1]) ** 2).sum(1) - along**2, 0))
    with np.errstate(invalid="ignore"):
        slope = np.clip(np.nan_to_num((two - one) / edge, nan=1.0), -0.999999, 0.999999)
    rise = np.sqrt(1 - slope**2)
    foot = np.clip((along - height * slope / rise) / edge, 0, 1)
    reach = np.hypot(along - foot * edge, height)
    start = np.where(foot <= 0, one, np.where(foot >= 1, two, one + slope * foot * edge))
    return start + reach, foot


def _flat_corners(garment: "Garment") -> np.ndarray:
    """Returns the corners of the flat rest triangles (faces, 3, 2)."""
    edges = np.asarray(garment.rest_edges, np.float64)
    return np.stack([np.zeros(edges.shape[:2]), edges[:, :, 0], edges[:, :, 1]], 1)


def _nearest_turns(garment: "Garment", rim: PinnedRim, pinned: np.ndarray, turns: np.ndarray) -> np.ndarray:
    from scipy.spatial import KDTree

    nearest = KDTree(garment.vertices[rim.vertices]).query(garment.vertices[pinned])[1]
    return turns[nearest]


def _trace_border(border: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray | None, bool]:
    """Returns the border in the order of its edges, and whether it closes; None where it is not a single line."""
    neighbours: dict[int, list[int]] = {int(vertex): [] for vertex in border}
    for one, two in edges.tolist():
        neighbours[one].append(two)
        neighbours[two].append(one)
    degrees = np.array([len(each) for each in neighbours.values()])
    ends = [vertex for vertex, each in neighbours.items() if len(each) == 1]
    if len(border) < 2 or degrees.max(initial=0) > 2 or degrees.min(initial=0) < 1 or len(ends) not in (0, 2):
        return None, False
    walk = [ends[0] if ends else int(border[0])]
    while True:
        ahead = [each for each in neighbours[walk[-1]] if len(walk) < 2 or each != walk[-2]]
        if not ahead or ahead[0] == walk[0]:
            break
        walk.append(ahead[0])
    return (np.array(walk), not ends) if len(walk) == len(border) else (None, False)


def _order_around_vertical(garment: "Garment", border: np.ndarray) -> tuple[np.ndarray, bool]:
    """Orders the border by angle around the vertical axis; it is open if one gap is far wider than the others."""
    points = np.asarray(garment.vertices, np.float64)[border]
    if len(border) < 2:
        return border, False
    middle = (points.min(0) + points.max(0)) / 2
    angle = np.arctan2(points[:, 0] - middle[0], points[:, 2] - middle[2])
    order = np.argsort(angle)
    gaps = np.linalg.norm(np.diff(points[np.append(order, order[0])], axis=0), axis=1)
    widest = int(gaps.argmax())
    closed = bool(gaps[widest] <= 3 * np.median(gaps))
    return border[order if closed else np.roll(order, -(widest + 1))], closed

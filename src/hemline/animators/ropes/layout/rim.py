"""The rim that a garment hangs from as a line, and where on it the shortest way from each vertex ends."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadGarment
from hemline.meshes import boundary_loops

if TYPE_CHECKING:
    from hemline.garments.garment import Garment


@dataclass(frozen=True, eq=False)
class Rim:
    """Vertices along the lower edge of the held part, in order."""

    vertices: Int[np.ndarray, " rim"]
    """Garment vertex ids."""
    shares: Float[np.ndarray, " rim"]
    """Arc length up to each, as a share of the whole."""
    length: float
    """The whole [m]."""
    closed: bool
    """Whether it comes back to its beginning."""

    @property
    def widest_gap(self) -> float:
        """Between two neighbours on it, as a share of the whole."""
        shares = np.append(self.shares, 1.0) if self.closed else self.shares
        return float(np.diff(shares).max())

    def point(self, share: float) -> tuple[Int[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """The point at a share of the way: corners and weights of a (degenerate) triangle."""
        following = int(np.searchsorted(self.shares, share, side="right"))
        first = max(following - 1, 0)
        second = following % len(self.vertices) if self.closed else min(following, len(self.vertices) - 1)
        end = 1.0 if second == 0 and self.closed else self.shares[second]
        width = end - self.shares[first]
        part = float(np.clip((share - self.shares[first]) / width, 0, 1)) if width > 0 else 0.0
        one, two = self.vertices[first], self.vertices[second]
        return np.array([one, two, two]), np.array([1 - part, part, 0.0])

    def difference(
        self, places: Float[np.ndarray, "*some"], share: float | Float[np.ndarray, "*some"]
    ) -> Float[np.ndarray, "*some"]:
        """How far along the rim places are beyond `share`, the shorter way round where it is closed."""
        difference = places - share
        return (difference + 0.5) % 1 - 0.5 if self.closed else difference


def hung_from(garment: "Garment") -> Int[np.ndarray, " held"]:
    """The vertices that chains hang from: the pinned ones; the highest open rim where the shoulders carry it all."""
    if len(garment.pins):
        return garment.pins.vertices
    loops = boundary_loops(garment.faces)
    return max(loops, key=lambda loop: garment.vertices[loop, 1].mean()) if loops else garment.pins.vertices


def rim_of(garment: "Garment") -> Rim:
    """The held vertices that have a free neighbour, ordered along the mesh, or around the vertical where that fails.

    Raises:
        BadGarment: Fewer than two of them, or all in one place.
    """
    pinned = np.zeros(len(garment.vertices), np.bool_)
    pinned[hung_from(garment)] = True
    edges = np.unique(np.sort(garment.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    mixed = edges[pinned[edges[:, 0]] != pinned[edges[:, 1]]]
    border = np.unique(mixed[pinned[mixed]])
    inner = np.isin(edges, border).all(1)
    order, closed = _walked(border, edges[inner])
    if order is None:
        order, closed = _around(garment, border)
    points = np.asarray(garment.vertices, np.float64)[order]
    if closed:
        points = np.concatenate([points, points[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if len(order) < 2 or way[-1] < 1e-6:
        raise BadGarment(
            f"garment '{garment.name}': chains hang from a pinned or an open rim",
            f"{len(order)} vertices there",
            "pin an edge of the cloth, or give chains",
        )
    return Rim(order, way[: len(order)] / way[-1], float(way[-1]), closed)


def rim_coordinates(garment: "Garment", rim: Rim, distance: Float[np.ndarray, " verts"]) -> Float[np.ndarray, " verts"]:
    """The share of the rim from which the shortest way to each vertex comes, carried outward from triangle to triangle.

    Vertices are taken in the order of their distance; each looks back through the opposite edge of the triangle whose
    straight front gives the smallest distance, and mixes the places of that edge's ends at the point it looks through.
    """
    angle = (2 * np.pi if rim.closed else np.pi) * rim.shares
    turn = np.zeros(len(distance), np.complex128)
    held = hung_from(garment)
    turn[held] = _nearest_turns(garment, rim, held, np.exp(1j * angle))
    turn[rim.vertices] = np.exp(1j * angle)
    corner = np.concatenate([garment.faces[:, [k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)])
    flat = _flat_corners(garment)
    flat = np.concatenate([flat[:, [k, (k + 1) % 3, (k + 2) % 3]] for k in range(3)])
    value, share = _fronts(flat, distance[corner[:, 1]], distance[corner[:, 2]])
    one, two, here = distance[corner[:, 1]], distance[corner[:, 2]], distance[corner[:, 0]]
    # an edge with one end farther away than the vertex itself: look back along the side to the other end
    alone = np.maximum(one, two) >= here
    side = np.linalg.norm(np.where((one < two)[:, None], flat[:, 1], flat[:, 2]) - flat[:, 0], axis=1)
    value = np.where(alone, np.minimum(one, two) + side, value)
    share = np.where(alone, (two < one) * 1.0, share)
    value = np.where(np.minimum(one, two) < here, value, np.inf)
    best = np.lexsort((value, corner[:, 0]))
    first = best[np.unique(corner[best, 0], return_index=True)[1]]
    source = np.zeros((len(distance), 2), np.int64)
    mix = np.zeros(len(distance))
    source[corner[first, 0]], mix[corner[first, 0]] = corner[first, 1:], share[first]
    for vertex in np.argsort(distance, kind="stable"):
        if turn[vertex] == 0 and np.isfinite(distance[vertex]):
            mixed = (1 - mix[vertex]) * turn[source[vertex, 0]] + mix[vertex] * turn[source[vertex, 1]]
            turn[vertex] = mixed / max(abs(mixed), 1e-12)
    angle = np.angle(turn)
    return (angle / (2 * np.pi)) % 1 if rim.closed else np.clip(angle / np.pi, 0, 1)


def _fronts(flat: np.ndarray, one: np.ndarray, two: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance at the first corner by a straight front over the opposite edge, and where on that edge it comes from."""
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
    """Corners of the flat rest triangles (faces, 3, 2)."""
    edges = np.asarray(garment.rest_edges, np.float64)
    return np.stack([np.zeros(edges.shape[:2]), edges[:, :, 0], edges[:, :, 1]], 1)


def _nearest_turns(garment: "Garment", rim: Rim, held: np.ndarray, turns: np.ndarray) -> np.ndarray:
    from scipy.spatial import KDTree

    nearest = KDTree(garment.vertices[rim.vertices]).query(garment.vertices[held])[1]
    return turns[nearest]


def _walked(border: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray | None, bool]:
    """The border in the order in which its edges run, and whether it closes; None where it is no single line."""
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


def _around(garment: "Garment", border: np.ndarray) -> tuple[np.ndarray, bool]:
    """The border ordered around the vertical through its middle; open where one gap is far wider than the others."""
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

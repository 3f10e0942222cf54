"""A sheet of cloth, laid out for the solver: shape functions, lumped masses, incidences, constant bending matrix."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt

from hemline.arrays import Faces
from hemline.errors import BadMesh

from .rows import Rows, incidence

Positions = Float[np.ndarray, "verts 3"]
"""Positions, velocities or forces of the vertices in float64."""


@dataclass(frozen=True)
class Elastic:
    """Constants of a fabric; extensive ones are per unit of area.

    Attributes:
        density: Area density [kg/m^2].
        young: Young's modulus of the membrane [N/m].
        poisson: Poisson's ratio of the membrane, plane stress.
        bending: Flexural rigidity [N m].
        damping: Time constant of stiffness-proportional damping [s].
        drag: Drag coefficient of a triangle face-on to the wind.
        lift: Lift coefficient.
        friction: Coulomb's coefficient against the body.
    """

    density: float = 0.1
    young: float = 30.0
    poisson: float = 0.3
    bending: float = 1e-5
    damping: float = 0.0
    drag: float = 0.0
    lift: float = 0.0
    friction: float = 0.3


@dataclass(frozen=True)
class Sheet:
    """Topology, rest metric and materials of a cloth mesh, laid out for gathers.

    A sheet may hold several pieces of cloth that share no vertex, see `join.join_sheets`.

    Attributes:
        faces: Triangles, uint32.
        shape: Gradients of the three linear shape functions in the flat rest triangle [1/m].
        area: Rest areas of the triangles [m^2].
        vertex_area: A third of the areas around each vertex [m^2].
        mass: Lumped masses [kg].
        corners: Corners of each vertex, numbered 3 face + corner.
        edges: Vertex pairs i < j.
        edge_length: Rest lengths [m], averaged over the triangles that share the edge.
        edge_corners: Corner pairs of each edge (row), numbered 9 face + 3 corner_i + corner_j.
        edge_slots: Entries (i, j) and (j, i) of each edge in `ring`.
        ring: Neighbours of each vertex, joined to it by an edge.
        ring_bending: Entry of the bending matrix for each entry of `ring` [N/m].
        far: Vertices that only a bending stencil joins to each vertex.
        far_bending: Entry of the bending matrix for each entry of `far` [N/m].
        hinges: Interior edges with the two vertices opposite: i, j, k, l.
        hinge_weight: bending length^2 / (area + area) of each hinge [N m].
        hinge_rest: Rest angle of each hinge [rad]; empty if the rest shape is flat.
        density: Area density of each face [kg/m^2].
        lame: Lame's first constant of each face, plane stress [N/m].
        shear: Shear modulus of each face [N/m].
        damping: Time constant of stiffness-proportional damping of each face [s].
        drag: Drag coefficient of each face.
        lift: Lift coefficient of each face.
        friction: Coulomb's coefficient of each vertex against the body.
        piece: Number of the piece of cloth that each vertex belongs to, uint32, counted from the skin outwards.
    """

    faces: UInt[np.ndarray, "faces 3"]
    shape: Float[np.ndarray, "faces 3 2"]
    area: Float[np.ndarray, " faces"]
    vertex_area: Float[np.ndarray, " verts"]
    mass: Float[np.ndarray, " verts"]
    corners: Rows
    edges: Int[np.ndarray, "edges 2"]
    edge_length: Float[np.ndarray, " edges"]
    edge_corners: Rows
    edge_slots: UInt[np.ndarray, "edges 2"]
    ring: Rows
    ring_bending: Float[np.ndarray, " ring"]
    far: Rows
    far_bending: Float[np.ndarray, " far"]
    hinges: Int[np.ndarray, "hinges 4"]
    hinge_weight: Float[np.ndarray, " hinges"]
    hinge_rest: Float[np.ndarray, " hinges_or_none"]
    density: Float[np.ndarray, " faces"]
    lame: Float[np.ndarray, " faces"]
    shear: Float[np.ndarray, " faces"]
    damping: Float[np.ndarray, " faces"]
    drag: Float[np.ndarray, " faces"]
    lift: Float[np.ndarray, " faces"]
    friction: Float[np.ndarray, " verts"]
    piece: UInt[np.ndarray, " verts"]

    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
        return len(self.mass)


def make_sheet(
    faces: Faces,
    rest_edges: Float[np.ndarray, "faces 2 2"],
    elastic: Elastic,
    *,
    rest_vertices: Float[np.ndarray, "verts 3"] | None = None,
) -> Sheet:
    """Lays out a cloth mesh for the solver.

    Args:
        faces: Triangles; every vertex from 0 to the largest must be used.
        rest_edges: For each triangle the 2 x 2 matrix whose columns are its edges 0-1 and 0-2 in the flat rest state
            [m].
        elastic: The material.
        rest_vertices: The shape whose dihedral angles are at rest [m]; None for a flat rest shape.

    Raises:
        BadMesh: A triangle has no area at rest, or a vertex belongs to no triangle.
    """
    faces = np.ascontiguousarray(faces, np.int32)
    count = int(faces.max()) + 1
    determinant = np.linalg.det(rest_edges)
    if (bad := np.flatnonzero(~(np.abs(determinant) > 1e-12))).size:
        cure = "remove degenerate triangles, check the unit"
        raise BadMesh(f"rest triangle {bad[0]} must have an area", f"{bad.size} without one", cure)
    area = 0.5 * np.abs(determinant)
    inverse = np.linalg.inv(rest_edges)
    shape = np.stack([-inverse.sum(axis=1), inverse[:, 0], inverse[:, 1]], axis=1)
    vertex_area = np.bincount(faces.ravel(), np.repeat(area / 3, 3), minlength=count)
    if (alone := np.flatnonzero(vertex_area == 0)).size:
        raise BadMesh(f"vertex {alone[0]} must belong to a triangle", "none", "drop unreferenced vertices")
    edges, edge_corners, edge_length = _edges(faces, rest_edges)
    ring, edge_slots = _ring(edges, count)
    hinges, weights, stencil = _hinges(faces, edges, edge_corners, rest_edges, area, elastic.bending)
    ring_bending, far, far_bending = _bending_matrix(hinges, weights, stencil, ring, count)
    length = np.zeros(0) if not len(hinges) else edge_length[_edge_ids(edges, hinges[:, :2], count)]
    return Sheet(
        faces=faces.astype(np.uint32),
        shape=np.ascontiguousarray(shape),
        area=area,
        vertex_area=vertex_area,
        mass=vertex_area * elastic.density,
        corners=incidence(faces.ravel(), np.arange(faces.size), count),
        edges=edges,
        edge_length=edge_length,
        edge_corners=edge_corners,
        edge_slots=edge_slots.astype(np.uint32),
        ring=ring,
        ring_bending=ring_bending,
        far=far,
        far_bending=far_bending,
        hinges=hinges,
        hinge_weight=weights * length**2,
        hinge_rest=np.zeros(0) if rest_vertices is None else hinge_angles(np.asarray(rest_vertices, float), hinges),
        density=np.full(len(faces), elastic.density),
        lame=np.full(len(faces), elastic.young * elastic.poisson / (1 - elastic.poisson**2)),
        shear=np.full(len(faces), elastic.young / (2 * (1 + elastic.poisson))),
        damping=np.full(len(faces), elastic.damping),
        drag=np.full(len(faces), elastic.drag),
        lift=np.full(len(faces), elastic.lift),
        friction=np.full(count, elastic.friction),
        piece=np.zeros(count, np.uint32),
    )


def hinge_angles(
    vertices: Float[np.ndarray, "verts 3"], hinges: Int[np.ndarray, "hinges 4"]
) -> Float[np.ndarray, " hinges"]:
    """Returns the signed dihedral angles [rad], 0 where the two triangles are coplanar."""
    i, j, k, l = (vertices[hinges[:, c]] for c in range(4))
    first, second = np.cross(j - i, k - i), np.cross(l - i, j - i)
    axis = (j - i) / np.linalg.norm(j - i, axis=1, keepdims=True)
    return np.arctan2((np.cross(first, second) * axis).sum(1), (first * second).sum(1))


def _edges(faces: np.ndarray, rest_edges: np.ndarray) -> tuple[np.ndarray, Rows, np.ndarray]:
    """Returns the edges, the corner pairs of each edge, and their rest lengths."""
    flat = np.zeros((len(faces), 3, 2))
    flat[:, 1:] = rest_edges.transpose(0, 2, 1)
    pairs, codes, lengths = [], [], []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        i, j = faces[:, a], faces[:, b]
        corner_i, corner_j = np.where(i < j, a, b), np.where(i < j, b, a)
        pairs.append(np.stack([np.minimum(i, j), np.maximum(i, j)], 1))
        codes.append(9 * np.arange(len(faces)) + 3 * corner_i + corner_j)
        lengths.append(np.linalg.norm(flat[:, a] - flat[:, b], axis=1))
    edges, which = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    which = which.ravel()
    length = np.bincount(which, np.concatenate(lengths)) / np.bincount(which)
    return edges.astype(np.int32), incidence(which, np.concatenate(codes), len(edges)), length


def _ring(edges: np.ndarray, count: int) -> tuple[Rows, np.ndarray]:
    """Returns the neighbours of each vertex, and the two entries of each edge among them."""
    rows, columns = edges.T.ravel(), edges[:, ::-1].T.ravel()
    order = np.lexsort((columns, rows))
    slots = np.empty(len(order), np.int32)
    slots[order] = np.arange(len(order))
    ring = incidence(rows[order], columns[order], count)
    return ring, np.ascontiguousarray(slots.reshape(2, -1).T)


def _edge_ids(edges: np.ndarray, pairs: np.ndarray, count: int) -> np.ndarray:
    """Returns the numbers of the edges between pairs of vertices."""
    keys = edges[:, 0].astype(np.int64) * count + edges[:, 1]
    return np.searchsorted(keys, pairs[:, 0].astype(np.int64) * count + pairs[:, 1])


def _hinges(
    faces: np.ndarray, edges: np.ndarray, edge_corners: Rows, rest_edges: np.ndarray, area: np.ndarray, bending: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interior edges: their four vertices, the weight w, and the row K of the energy w / 2 |K x|^2.

    Source: Bergou et al., "A quadratic bending model for inextensible surfaces", SGP 2006, section 3.
    Differs: w = bending / (area + area), without their factor 3: on meshes of equilateral triangles a cylinder then
    costs 1/2 D area / R^2, as plate theory has it (Seung and Nelson 1988), and not three times that.
    """
    inner = np.flatnonzero(np.diff(edge_corners.starts) == 2)
    codes = np.stack([edge_corners.columns[edge_corners.starts[inner] + side] for side in (0, 1)])
    face, corner_i, corner_j = codes // 9, codes % 9 // 3, codes % 3
    opposite = 3 - corner_i - corner_j
    flat = np.zeros((len(faces), 3, 2))
    flat[:, 1:] = rest_edges.transpose(0, 2, 1)
    at_i = _cotangents(flat, face, corner_i, corner_j, opposite)
    at_j = _cotangents(flat, face, corner_j, corner_i, opposite)
    stencil = np.stack([at_j.sum(0), at_i.sum(0), -at_i[0] - at_j[0], -at_i[1] - at_j[1]], axis=1)
    hinges = np.stack([edges[inner, 0], edges[inner, 1], faces[face[0], opposite[0]], faces[face[1], opposite[1]]], 1)
    # one orientation for all: the first face runs i -> j, so that the sign of the angle means the same everywhere
    turned = (corner_j[0] - corner_i[0]) % 3 != 1
    hinges[turned], stencil[turned] = hinges[turned][:, [0, 1, 3, 2]], stencil[turned][:, [0, 1, 3, 2]]
    return hinges.astype(np.int32), bending / area[face].sum(0), stencil


def _cotangents(flat: np.ndarray, face: np.ndarray, at: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Returns the cotangent of the angle of a triangle at a corner."""
    a, b = flat[face, one] - flat[face, at], flat[face, two] - flat[face, at]
    return (a * b).sum(-1) / np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _bending_matrix(
    hinges: np.ndarray, weights: np.ndarray, stencil: np.ndarray, ring: Rows, count: int
) -> tuple[np.ndarray, Rows, np.ndarray]:
    """Returns Q = sum of w K^T K, split into the entries on the ring and those beyond it; the diagonal is minus their
    sum.
    """
    from scipy.sparse import csr_array

    values = weights[:, None, None] * stencil[:, :, None] * stencil[:, None, :]
    rows, columns = np.repeat(hinges, 4, axis=1).ravel(), np.tile(hinges, (1, 4)).ravel()
    matrix = csr_array((values.ravel(), (rows, columns)), shape=(count, count)).tocoo()
    row, column = matrix.coords
    ring_rows = np.repeat(np.arange(count), np.diff(ring.starts))
    ring_keys, keys = ring_rows * count + ring.columns, row.astype(np.int64) * count + column
    place = np.minimum(np.searchsorted(ring_keys, keys), max(len(ring_keys) - 1, 0))
    near = ring_keys[place] == keys
    ring_bending = np.zeros(len(ring_keys))
    ring_bending[place[near]] = matrix.data[near]
    beyond = ~near & (row != column)
    order = np.lexsort((column[beyond], row[beyond]))
    far = incidence(row[beyond][order], column[beyond][order], count)
    return ring_bending, far, matrix.data[beyond][order]

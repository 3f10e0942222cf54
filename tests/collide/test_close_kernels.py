"""The kernels of the close-cloth loop, compared with plain NumPy."""

import numpy as np

from hemline.collide.close.close_kernels import HELD_BACK, TORN, give_up_torn
from hemline.collide.close.skin_plane_kernels import SkinPlanes


def random_planes(random: np.random.Generator, count: int) -> SkinPlanes:
    """Half-spaces with normals and offsets at random, a third of them unlisted."""
    normals = random.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    planes = np.column_stack([normals, random.normal(scale=0.01, size=count)]).astype(np.float32)
    listed = np.sort(random.permutation(count)[: 2 * count // 3])
    return SkinPlanes(
        planes,
        np.zeros(count, np.int64),
        np.zeros(count, np.float32),
        np.zeros((count, 3), np.float32),
        np.zeros(count, np.bool_),
        np.concatenate([listed, np.zeros(count - len(listed), np.int64)]),
    )


def test_vertices_are_given_up_at_the_ends_of_torn_edges_where_a_half_space_holds_them_back():
    random = np.random.default_rng(5)
    for _ in range(20):
        points = random.normal(scale=0.02, size=(30, 3)).astype(np.float32)
        moved = points + random.normal(scale=0.01, size=points.shape).astype(np.float32)
        edges = random.integers(30, size=(50, 2)).astype(np.int32)
        longest = random.uniform(0.005, 0.05, 50).astype(np.float32)
        found, before = random_planes(random, 30), moved.copy()
        listed = found.listed[:20].copy()
        lengths = np.linalg.norm(before[edges[:, 1]] - before[edges[:, 0]], axis=1)
        torn = np.unique(edges[lengths > TORN * longest])
        lack = found.planes[:, 3] - np.einsum("ij,ij->i", found.planes[:, :3], points)
        expected = np.intersect1d(np.intersect1d(torn, listed), np.flatnonzero(lack > HELD_BACK))
        left = give_up_torn(edges, longest, points, found, 20, moved)
        assert 0 < len(expected) < 20
        np.testing.assert_array_equal(np.flatnonzero(found.pinched), expected)
        np.testing.assert_array_equal(found.listed[:left], np.setdiff1d(listed, expected))
        np.testing.assert_array_equal(moved[expected], points[expected])
        others = np.setdiff1d(np.arange(30), expected)
        np.testing.assert_array_equal(moved[others], before[others])


def test_nothing_is_given_up_where_no_edge_is_torn():
    random = np.random.default_rng(6)
    points = random.normal(scale=0.02, size=(30, 3)).astype(np.float32)
    found, moved = random_planes(random, 30), points.copy()
    edges = random.integers(30, size=(50, 2)).astype(np.int32)
    longest = np.full(50, 1.0, np.float32)
    assert give_up_torn(edges, longest, points, found, 20, moved) == 20
    assert not found.pinched.any()

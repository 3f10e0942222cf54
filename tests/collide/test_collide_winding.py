"""Winding numbers against closed forms and libigl's solid angles."""

import igl
import numpy as np
import pytest

from hemline.collide.winding.numbers import inside, winding_numbers
from hemline.errors import BadMesh
from tests.collide.projection_samples import clip, spheres


def test_balls_that_overlap_count_twice_and_inverted_ones_negatively():
    vertices, faces = spheres((0, 0, 0), (0.1, 0, 0))
    points = np.array([[-0.05, 0, 0], [0.05, 0, 0], [0.15, 0, 0], [0.3, 0, 0], [0, 5, 0]], np.float32)
    assert winding_numbers(vertices, faces, points).tolist() == [1, 2, 1, 0, 0]
    assert winding_numbers(vertices, faces[:, ::-1], points).tolist() == [-1, -2, -1, 0, 0]
    assert inside(vertices, faces, points).tolist() == [True, True, True, False, False]
    assert not inside(vertices, faces[:, ::-1], points).any()  # turned inside out: nothing above one half


def test_rays_through_vertices_and_edges_slip_through_nowhere():
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T.astype(np.float32)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)], np.int32)
    # every ray along z from these points meets the diagonal of a face, and at the corners of the grid a vertex or edge
    line = np.linspace(-0.5, 1.5, 17, dtype=np.float32)
    points = np.array(np.meshgrid(line, line, [-0.25, 0.25, 0.75, 1.25])).reshape(3, -1).T.astype(np.float32)
    off = (np.abs(points) > 0).all(1) & (points != 1).all(1)
    within = ((points > 0) & (points < 1)).all(axis=1)
    assert (winding_numbers(corners, faces, points)[off] == within[off]).all()
    # beside the box the answer is exact even where the ray grazes an edge
    beside = np.array([[0, 0, -1], [1, 1, -1], [0, 0.5, 2], [0.5, 0, 2], [2, 0, 0.5]], np.float32)
    assert (winding_numbers(corners, faces, beside) == 0).all()


@pytest.mark.parametrize("name", ["run", "dance"])
def test_agrees_with_solid_angles_on_a_body_that_cuts_itself(name):
    _, poses, _ = clip(name, frames=3, step=17)
    random = np.random.default_rng(5)
    for posed in poses:
        near = posed.vertices[random.integers(0, len(posed.vertices), 1500)]
        low, high = posed.vertices.min(0), posed.vertices.max(0)
        points = np.concatenate(
            [
                near + random.normal(0, 0.004, near.shape),
                random.uniform(low - 0.05, high + 0.05, (1000, 3)),
            ]
        ).astype(np.float32)
        ours = winding_numbers(posed.vertices, posed.faces, points)
        theirs = igl.winding_number(
            posed.vertices.astype(float), np.ascontiguousarray(posed.faces), points.astype(float)
        )
        clear = np.abs(theirs - np.round(theirs)) < 1e-3
        assert clear.mean() > 0.999
        assert (ours[clear] == np.round(theirs[clear])).all()


def test_nothing_to_test():
    vertices, faces = spheres((0, 0, 0))
    assert winding_numbers(vertices, faces, np.empty((0, 3), np.float32)).shape == (0,)
    assert winding_numbers(vertices, faces[:0], vertices[:2]).tolist() == [0, 0]


def test_positions_must_be_finite():
    vertices, faces = spheres((0, 0, 0))
    with pytest.raises(BadMesh, match=r"finite positions; got NaN or infinity; repair"):
        winding_numbers(vertices, faces, np.array([[np.nan, 0, 0]], np.float32))

"""Which vertices lie inside another part: against libigl's winding numbers, and where the answer is known."""

import igl
import numpy as np
import pytest
import trimesh

from hemline import bodies
from hemline.bodies import overlapping
from hemline.bodies.untangling.overlap_kernels import mark_inside
from hemline.bodies.untangling.parts import PART_ROOTS, closed_parts, part_of_vertex
from hemline.motions import JOINT_NAMES
from tests.bodies.body_samples import arms_down, random_pose, t_pose


@pytest.fixture(scope="module")
def shaped():
    return bodies.load().shaped()


def closed_vertices(posed):
    vertices, parts = posed.vertices.astype(np.float64), closed_parts(posed.shaped.body)
    return np.vstack([vertices, *[vertices[rim].mean(axis=0) for part in parts for rim in part.rims]])


def test_parts_are_closed_and_make_up_the_body(shaped):
    closed = closed_vertices(shaped.posed(shaped.rest_pose))
    volumes = []
    for part in closed_parts(shaped.body):
        mesh = trimesh.Trimesh(closed, part.faces, process=False)
        assert mesh.is_watertight and mesh.is_winding_consistent
        volumes.append(mesh.volume)
    whole = trimesh.Trimesh(shaped.vertices, shaped.body.faces, process=False)
    assert min(volumes) > 0 and sum(volumes) == pytest.approx(whole.volume, rel=1e-6)


def test_parts_hold_the_vertices_of_their_limbs(shaped):
    owner, body = part_of_vertex(shaped.body), shaped.body
    for root, joint in (("left_elbow", "left_hand"), ("pelvis", "head"), ("right_knee", "right_foot")):
        held = (body.weight_indices[:, 0] == JOINT_NAMES.index(joint)) & (body.weights[:, 0] > 0.9)
        assert (owner[held] == PART_ROOTS.index(root)).all()


def test_nothing_overlaps_at_rest_or_in_the_t_pose(shaped):
    assert not overlapping(shaped.posed(shaped.rest_pose)).any()
    assert not overlapping(shaped.posed(t_pose())).any()


@pytest.mark.parametrize("pose", [arms_down(), random_pose(11, 0.5), random_pose(12, 0.5)])
def test_as_many_as_libigl_counts(shaped, pose):
    posed = shaped.posed(pose)
    closed, expected = closed_vertices(posed), np.zeros(len(posed.vertices), dtype=bool)
    for part in closed_parts(shaped.body):
        corners, points = closed[part.faces.ravel()], closed[part.tested]
        boxed = ((points >= corners.min(axis=0)) & (points <= corners.max(axis=0))).all(axis=1)
        tested = part.tested[boxed]
        windings = igl.winding_number(closed, part.faces.astype(np.int64), np.ascontiguousarray(closed[tested]))
        expected[tested[np.asarray(windings) > 0.5]] = True
    assert expected.any()
    assert np.array_equal(overlapping(posed), expected)


def test_rays_through_vertices_and_edges_count_once():
    """A cube, and points whose rays pass exactly through its corners, edges and diagonals."""
    cube = trimesh.creation.box((2, 2, 2))
    steps = np.array([-1.5, -1, -0.5, 0, 0.5, 1, 1.5])
    points = np.stack(np.meshgrid([-3, -0.5, 0.25, 3], steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    vertices = np.vstack([cube.vertices, points])
    inside = np.zeros(len(vertices), dtype=bool)
    tested = np.arange(len(cube.vertices), len(vertices), dtype=np.int32)
    mark_inside(vertices, cube.faces.astype(np.int32), tested, 5, inside)
    strictly_in, strictly_out = (np.abs(points) < 1).all(axis=1), (np.abs(points) > 1).any(axis=1)
    assert inside[tested][strictly_in].all() and not inside[tested][strictly_out].any()


def test_arms_overlap_where_they_run_into_the_torso(shaped):
    apart, into = (overlapping(shaped.posed(pose)).mean() for pose in (t_pose(), arms_down(lift=0.05)))
    assert apart == 0 and 0.005 < into < 0.1

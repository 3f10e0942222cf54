"""Skeleton, openings, thin bodies, poses that garments are put on in."""

import igl
import numpy as np
import pytest
import trimesh

from hemline import garments
from hemline.meshes import boundary_loops
from hemline.meshes.segment_crossing_kernels import crossings_of_segments
from hemline.motions.motion import JOINT_NAMES
from hemline.tryon.alignment import pose_from_angles
from hemline.tryon.openings import empty_openings, joints_through_cloth
from hemline.tryon.rims import SHORTEST_RIM, rims_of
from hemline.tryon.skeleton import Skeleton
from hemline.tryon.thin_body import ThinBody


def joint(shaped, name):
    return shaped.joints[JOINT_NAMES.index(name)].astype(float)


def volumes(a, b, c, d):
    return np.linalg.det(np.stack(np.broadcast_arrays(b - a, c - a, d - a), axis=-2))


def within(points, vertices, faces):
    """Whether points are inside, by libigl's winding numbers."""
    return igl.fast_winding_number(vertices.astype(float), faces.astype(np.int64), points.astype(float)) > 0.5


def test_a_segment_crosses_a_triangle_where_volumes_change_their_sign():
    generator = np.random.default_rng(2)
    x, faces = generator.normal(size=(40, 3)), generator.permutation(40)[:39].reshape(-1, 3).astype(np.int32)
    points, segments = generator.normal(size=(200, 3)), np.arange(200).reshape(-1, 2)
    count = np.empty(100, np.int64)
    crossings_of_segments(points, segments, x, faces, count)
    p, q = points[::2, None], points[1::2, None]
    a, b, c = (x[faces[:, k]][None] for k in range(3))
    across = volumes(a, b, c, p) * volumes(a, b, c, q) < 0
    signs = np.stack([volumes(p, q, *pair) > 0 for pair in ((a, b), (b, c), (c, a))])
    assert np.array_equal(count, (across & (signs.all(axis=0) | ~signs.any(axis=0))).sum(axis=1))
    assert count.sum() > 20


def test_the_skeleton_is_inside_the_body(shaped):
    skeleton = Skeleton.of(shaped.joints)
    share = np.linspace(0.02, 0.98, 9)[:, None, None]
    ends = skeleton.points[skeleton.inner]
    inside = within((ends[:, 0] + share * (ends[:, 1] - ends[:, 0])).reshape(-1, 3), shaped.vertices, shaped.body.faces)
    names = np.tile([skeleton.name(s) for s in range(len(skeleton.inner))], 9)
    # tips of fingers and heels are guessed from the limb before
    sure = ~np.isin(names, [f"{side}_{end}" for side in ("left", "right") for end in ("wrist", "ankle")])
    assert inside[sure].mean() > 0.97


def test_nearest_points_of_limbs(shaped):
    skeleton = Skeleton.of(shaped.joints)
    middle = 0.5 * (joint(shaped, "left_knee") + joint(shaped, "left_ankle"))
    assert skeleton.nearest((middle + (0.03, 0, 0))[None])[0] == pytest.approx(middle, abs=0.004)
    assert skeleton.nearest(joint(shaped, "neck")[None])[0] == pytest.approx(joint(shaped, "neck"), abs=1e-9)


def test_openings_of_a_shirt_are_all_used_and_a_hole_is_none(shaped, worn):
    garment = worn["tshirt"]
    rims = rims_of(garment.vertices.astype(float), garment.faces)
    assert len(rims) == 4
    assert (
        empty_openings(garment.vertices, garment.faces, shaped)
        == ()
        == joints_through_cloth(garment.vertices, garment.faces, shaped)
    )
    # one triangle taken out: a hole of 5 cm, not an opening
    holed = np.delete(garment.faces, 3000, axis=0)
    lengths = [rim.length for rim in rims_of(garment.vertices.astype(float), holed)]
    assert len(boundary_loops(holed)) == 5 and len(lengths) == 4 and min(lengths) > SHORTEST_RIM


def test_a_cape_has_no_opening(shaped):
    cape = garments.load("cape-light")
    assert len(boundary_loops(cape.faces)) == 1 and rims_of(cape.vertices.astype(float), cape.faces) == []


def test_trousers_may_be_too_long_but_not_too_low(shaped, worn):
    trousers = worn["trousers"]
    legs = np.where(trousers.vertices[:, [1]] < 0, np.float32([1, 1.25, 1]), np.float32(1))
    assert empty_openings(trousers.vertices * legs, trousers.faces, shaped) == ()
    beside = trousers.vertices - np.float32([0, 0, 0.6])
    assert len(empty_openings(beside, trousers.faces, shaped)) > 0


def test_a_shirt_that_hangs_beside_the_body_is_used_by_no_limb(shaped, worn):
    garment = worn["tshirt"]
    assert {"neck", "spine1"} & set(empty_openings(garment.vertices - np.float32([0, 0, 0.6]), garment.faces, shaped))


def test_a_shirt_too_high_is_pierced_by_the_shoulders(shaped, worn):
    garment = worn["tshirt"]
    found = joints_through_cloth(garment.vertices + np.float32([0, 0.1, 0]), garment.faces, shaped)
    assert {"left_collar", "right_collar", "neck"} <= set(found)


def test_a_thin_body_lies_within_the_body_and_keeps_its_joints(shaped):
    thin = ThinBody(shaped)
    assert thin.at(1.0) is shaped
    slim = thin.at(0.3)
    assert np.array_equal(slim.joints, shaped.joints)
    # hands and head go to a joint and to a short line, which the jaw and the fingers are not straight around
    limbs = (shaped.vertices[:, 1] < 0.4) & (np.abs(shaped.vertices[:, 0]) < 0.4)
    assert within(slim.vertices[limbs], shaped.vertices, shaped.body.faces).mean() > 0.97
    wide, narrow = (trimesh.Trimesh(each.vertices, shaped.body.faces, process=False) for each in (shaped, slim))
    # limbs lose girth in two of three directions: 0.3^2; at their ends, and in head and hands, in all
    assert 0.3**3 < narrow.volume / wide.volume < 0.3
    calf = (np.abs(shaped.vertices[:, 1] - joint(shaped, "left_knee")[1] + 0.15) < 0.05) & (shaped.vertices[:, 0] > 0)
    centre = shaped.vertices[calf][:, [0, 2]].mean(axis=0)
    spread = [np.linalg.norm(each.vertices[calf][:, [0, 2]] - centre, axis=1).mean() for each in (shaped, slim)]
    assert spread[1] / spread[0] == pytest.approx(0.3, abs=0.1)
    assert np.median(np.einsum("vi,vi->v", slim.normals, narrow.vertex_normals)) > 0.98


@pytest.mark.parametrize(
    ("angles", "moves"),
    [
        ((0.5, 0, 0, 0), ("left_elbow", (None, +1, None))),
        ((0, 0.5, 0, 0), ("left_elbow", (None, None, +1))),
        ((0, 0, 0, 0.3), ("left_knee", (+1, None, None))),
    ],
)
def test_angles_turn_both_sides_alike(shaped, angles, moves):
    before, after = shaped.joints, shaped.joints_at(pose_from_angles(shaped, angles))
    name, signs = moves
    way = after[JOINT_NAMES.index(name)] - before[JOINT_NAMES.index(name)]
    mirrored = after[JOINT_NAMES.index(name.replace("left", "right"))] * (-1, 1, 1)
    assert mirrored == pytest.approx(after[JOINT_NAMES.index(name)], abs=2e-3)
    for value, sign in zip(way, signs, strict=True):
        assert sign is None or value * sign > 0.03


def test_elbows_bend_by_the_angle_between_upper_arm_and_forearm(shaped):
    def bend(angles):
        joints = shaped.joints_at(pose_from_angles(shaped, angles)).astype(float)
        shoulder, elbow, wrist = (joints[JOINT_NAMES.index(f"left_{each}")] for each in ("shoulder", "elbow", "wrist"))
        upper, fore = elbow - shoulder, wrist - elbow
        return np.arccos(upper @ fore / np.linalg.norm(upper) / np.linalg.norm(fore))

    rest = bend((0, 0, 0, 0))
    assert bend((0, 0, 0.7, 0)) - rest == pytest.approx(0.7, abs=1e-3)
    assert bend((0.4, -0.3, -rest, 0)) == pytest.approx(0, abs=2e-2)

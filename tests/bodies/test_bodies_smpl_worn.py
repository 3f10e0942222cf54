"""What the rest of hemline does with a body of the SMPL family: place, untangle, find overlap, dress, simulate."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import bodies, garments, motions
from hemline.bodies.place import sole_heights, sole_vertices
from hemline.bodies.pose_offsets import pose_offsets
from hemline.bodies.untangling.balls import fill_with_balls
from hemline.bodies.untangling.parts import closed_parts
from hemline.bodies.velocities import turning_velocity
from hemline.motions import JOINT_NAMES, Pose
from hemline.playback.record import record_take
from hemline.sim import SimSettings, simulate
from tests.bodies.body_samples import arms_down, clip_of, random_pose, t_pose, turned
from tests.bodies.smpl_samples import anny_arrays, smpl_vertices, write_published


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_published(tmp_path_factory.mktemp("smpl") / "basic_f.pkl", anny_arrays())


@pytest.fixture(scope="module")
def body(path):
    return bodies.read(path)


def test_it_moves_as_the_formula_says(body):
    arrays, random = anny_arrays(), np.random.default_rng(1)
    pose, betas = random_pose(2, 0.4), random.normal(size=10)
    turns = Rotation.from_quat(pose.rotations[:, [1, 2, 3, 0]]).as_rotvec()
    pelvis = arrays["J_regressor"][0] @ (arrays["v_template"] + arrays["shapedirs"] @ betas)
    truth = smpl_vertices(arrays, betas, turns, pose.translation - pelvis)
    assert np.abs(body.shaped(betas).posed(pose).vertices - truth).max() < 1e-5


def test_offsets_follow_both_ways_of_blending_and_vanish_where_they_are_none(body):
    pose, plain = random_pose(4, 0.4), replace(body, posedirs=None)
    baked = replace(plain, template=body.template + pose_offsets(body.posedirs, pose.rotations))
    for blending in ("linear", "dual"):
        one, other, bare = (each.shaped().posed(pose, blending=blending).vertices for each in (body, baked, plain))
        assert np.array_equal(one, other) and np.abs(one - bare).max() > 1e-3
    posed = plain.shaped().posed(pose)
    assert posed.rest_vertices is posed.shaped.vertices


def test_a_turning_joint_moves_the_offsets_too(body):
    body = replace(body, posedirs=5 * body.posedirs)
    shaped, pose, step = body.shaped(), random_pose(5, 0.3), 1e-3
    for name, axis in (("pelvis", [0.3, 1, 0]), ("left_shoulder", [0, 0.5, 1]), ("right_knee", [1, 0, 0.2])):
        joint, ends = JOINT_NAMES.index(name), []
        for sign in (1, -1):
            turn = Rotation.from_quat(pose.rotations[joint, [1, 2, 3, 0]]) * Rotation.from_rotvec(
                sign * step * np.array(axis)
            )
            rotations = pose.rotations.astype(np.float64)
            rotations[joint] = turn.as_quat()[[3, 0, 1, 2]]
            ends.append(shaped.posed(Pose(rotations, pose.translation)).vertices.astype(np.float64))
        difference = (ends[0] - ends[1]) / (2 * step)
        velocity = turning_velocity(shaped.posed(pose), joint, np.array(axis))
        without = turning_velocity(replace(body, posedirs=None).shaped().posed(pose), joint, np.array(axis))
        assert np.abs(velocity - difference).max() < 1e-3
        assert joint == 0 or np.abs(without - difference).max() > 3e-3


def test_soles_stand_on_the_floor_where_the_posed_mesh_has_them(body):
    bent = turned(random_pose(6, 0.2), left_ankle=(0.6, 0, 0), right_ankle=(-0.4, 0, 0.3))
    clip, shaped = clip_of([bent, t_pose()]), body.shaped()
    lowest = [shaped.posed(clip[frame]).vertices[sole_vertices(shaped), 1].min() for frame in range(2)]
    assert np.abs(sole_heights(shaped, clip) - lowest).max() < 1e-6


def test_parts_balls_overlap_and_untangling_are_for_any_body(body):
    shaped = body.shaped()
    parts = closed_parts(body)
    assert [len(part.rims) for part in parts] == [4, 2, 1, 2, 1, 2, 1, 2, 1]
    assert len(fill_with_balls(shaped).pairs) > 1000
    assert bodies.overlapping(shaped.posed(t_pose())).mean() < 0.01
    tangled, apart = shaped.posed(arms_down()), shaped.posed(shaped.untangle(arms_down()))
    assert bodies.overlapping(tangled).sum() > 2 * bodies.overlapping(apart).sum()


def test_a_cape_is_made_and_simulated(body):
    shaped = body.shaped([0.5])
    cape = garments.make_cape(shaped, vertex_count=500)
    assert cape.body_name == "basic_f"
    run = shaped.placed(motions.load("run").resample(30))[:3]
    take = simulate(cape, shaped, shaped.untangle_motion(run), SimSettings(lead_in=0.2, settle=1.0))
    assert take.failed is None and np.isfinite(take.vertices).all()
    assert take.lead_in.sum() == 6 and len(take.vertices) == 9
    assert take.figures["edge_strain_p99"] < 0.2
    clip = record_take(take, cape, shaped)
    assert clip.skeleton is None  # by which it would lose its offsets
    assert np.array_equal(clip.body_vertices[2], shaped.posed(take.motion[8]).vertices)

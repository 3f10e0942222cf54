"""Tours through poses, and the poses and sections of many people that ship."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hemline import bodies, motions
from hemline.models.make.varied import SECTION_S, liveliest_section, skin_weights
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, Motion
from hemline.motions.pose_clusters import square_distances
from hemline.motions.pose_tour import order_poses, pose_tour
from hemline.motions.quaternions import angle, from_axis_angle, inverse, multiply
from hemline.motions.terms import CMU_TERMS

LEFT_ELBOW = JOINT_NAMES.index("left_elbow")


@pytest.fixture(scope="module")
def poses():
    random = np.random.default_rng(0)
    return from_axis_angle(0.7 * random.normal(size=(12, JOINT_COUNT, 3)))


def make_tour(poses, frames=5):
    return pose_tour(poses, np.array([0.0, 1.0, 0.0]), frames, fps=30.0, leg_length=0.9, name="tour")


def test_each_pose_of_a_tour_is_one_of_its_frames(poses):
    tour = make_tour(poses)
    assert len(tour) == 5 * (len(poses) - 1) + 1
    dots = np.abs((tour.rotations[::5] * poses).sum(axis=2))
    np.testing.assert_allclose(dots, 1, atol=1e-6)
    np.testing.assert_array_equal(tour.translations, np.tile(np.float32([0, 1, 0]), (len(tour), 1)))


def test_the_body_is_slow_at_each_pose(poses):
    rotations = make_tour(poses, frames=10).rotations.astype(np.float64)
    speed = angle(multiply(inverse(rotations[:-1]), rotations[1:])).mean(axis=1).reshape(-1, 10)
    assert (speed[:, [0, -1]].max(axis=1) < 0.25 * speed.max(axis=1)).all()
    np.testing.assert_allclose(speed, speed[:, ::-1], atol=1e-5)


def test_a_tour_goes_on_to_the_nearest_pose_that_is_left(poses):
    weights = np.linspace(0.2, 1.0, JOINT_COUNT)
    order = order_poses(poses, weights)
    assert sorted(order) == list(range(len(poses)))
    apart = square_distances(poses, poses, weights)
    for place, (here, following) in enumerate(pairwise(order)):
        assert apart[here, following] == min(apart[here, other] for other in order[place + 1 :])
    assert order_poses(poses[:1], weights).tolist() == [0]


def test_shipped_poses_differ_and_their_arms_are_off_the_torso():
    found = motions.varied_poses()
    assert len(found) == 400 and found.licence == CMU_TERMS
    apart = square_distances(found.rotations, found.rotations, np.ones(JOINT_COUNT))
    assert np.sqrt(apart[~np.eye(len(found), dtype=bool)].min()) > 0.1
    knees, shoulders = (JOINT_NAMES.index(name) for name in ("left_knee", "left_shoulder"))
    still = np.array([1.0, 0.0, 0.0, 0.0])
    for joint in (knees, shoulders, LEFT_ELBOW):
        assert angle(multiply(inverse(still), found.rotations[:, joint].astype(np.float64))).max() > 1.2


def test_shipped_sections_are_of_other_people_than_the_shipped_clips():
    sections = motions.varied_clips()
    people = {motions.subject_of(section) for section in sections}
    assert len(sections) == 24 and len(people) >= 12
    assert people & {motions.subject_of(name) for name in motions.names() if name != "turn"} == set()
    listed = (Path(motions.__file__).parents[1] / "models" / "fit.clips").read_text().split()
    assert {section.source.split(", ")[-1] for section in sections} <= {Path(name).name for name in listed}
    assert all(section.licence == CMU_TERMS and section.seconds >= SECTION_S - 0.1 for section in sections)


def test_the_liveliest_section_is_where_the_body_moves():
    """Six seconds of rest in which an elbow swings from 3.0 to 5.5 s."""
    count = 180
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (count, JOINT_COUNT, 1))
    swing = np.zeros((count, 3))
    seconds = np.arange(count) / 30
    moving = (seconds >= 3.0) & (seconds < 5.5)
    swing[moving, 1] = 0.8 * np.sin(2 * np.pi * (seconds[moving] - 3.0) / 1.25)
    rotations[:, LEFT_ELBOW] = from_axis_angle(swing)
    motion = Motion(rotations, np.zeros((count, 3)), fps=30.0, leg_length=0.9, name="swing")
    section, speed = liveliest_section(motion, np.ones(JOINT_COUNT))
    steps = angle(multiply(inverse(rotations[:-1]), rotations[1:]))
    assert len(section) == 75
    assert speed == pytest.approx(30 * steps[90:165].mean(), rel=0.05)
    np.testing.assert_allclose(section.rotations[:, LEFT_ELBOW], rotations[90:165, LEFT_ELBOW], atol=0.1)


def test_joints_that_carry_more_skin_farther_weigh_more():
    weights = dict(zip(JOINT_NAMES, skin_weights(bodies.load("anny24").shaped()), strict=True))
    assert weights["left_shoulder"] > weights["left_elbow"] > weights["left_wrist"] > 0
    assert weights["spine1"] > weights["spine2"] > weights["neck"]
    assert max(weights.values()) == 1.0 and weights["pelvis"] <= weights["spine1"]
    np.testing.assert_allclose(weights["left_knee"], weights["right_knee"], rtol=0.02)

"""Garments that a body wears into a pose: the protocol of anchors."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.bodies.lifted_arms import lift_pose_arms
from hemline.datasets import open_dataset
from hemline.errors import BadInput, SimulationFailed
from hemline.garments import coarser_garment
from hemline.motions.motion import JOINT_NAMES, Pose
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix
from hemline.sim import SimSettings, produce_posed, settle
from hemline.sim.rest.settle import rest_state
from hemline.sim.rest.walk import WALK, accept
from hemline.sim.step.state import ClothState
from hemline.sim.takes.anchor_jobs import WalkRules

SHOULDERS = JOINT_NAMES.index("left_shoulder"), JOINT_NAMES.index("right_shoulder")


@cache
def shirt():
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    return garment, bodies.load("anny24").shaped()


@cache
def drape():
    return rest_state(*shirt())


def turn_pose(*turns, root=(0.0, 0.0, 0.0), shift=(0.0, 0.0, 0.0)) -> Pose:
    """The rest pose with joints turned in their own frames, and the root about the world's axes [rad]."""
    pose = shirt()[1].rest_pose
    rotations = pose.rotations.astype(np.float64)
    for joint, vector in turns:
        rotations[joint] = multiply(rotations[joint], from_axis_angle(np.asarray(vector)))
    rotations[0] = multiply(from_axis_angle(np.asarray(root)), rotations[0])
    return Pose(rotations, pose.translation + np.asarray(shift, np.float32))


def arms_down(angle: float) -> Pose:
    return turn_pose((SHOULDERS[0], (0.0, 0.0, -angle)), (SHOULDERS[1], (0.0, 0.0, angle)))


@cache
def raised():
    """Arms raised: reached from the drape."""
    return settle(*shirt(), arms_down(-0.5), start=drape(), method="walked")


def test_standing_still_is_a_walk_that_changes_little():
    there = settle(*shirt(), shirt()[1].rest_pose, start=drape(), method="walked")
    away = np.linalg.norm(there.positions - drape().positions, axis=1)
    assert away.mean() < 0.003 and there.method == "walked"
    assert there.figures["speed_mm_s"] < 20 and there.figures["inside"] == 0


def test_the_way_is_the_same_wherever_the_body_heads_and_stands():
    turn, shift = np.array([0.0, 1.3, 0.0]), np.array([0.4, 0.1, -2.0])
    garment, shaped = shirt()
    pose = turn_pose((SHOULDERS[0], (0.0, 0.0, 0.5)), (SHOULDERS[1], (0.0, 0.0, -0.5)), root=turn, shift=shift)
    there = settle(garment, shaped, pose, start=drape(), method="walked")
    origin = shaped.rest_pose.translation
    wanted = (raised().positions - origin) @ to_matrix(from_axis_angle(turn)).T + origin + shift
    away = np.linalg.norm(there.positions - wanted, axis=1)
    assert away.mean() < 1e-3
    assert np.linalg.norm(raised().positions - drape().positions, axis=1).mean() > 0.005


def test_the_drape_is_found_where_it_is_not_given_and_nothing_is_left_to_chance():
    again = settle(*shirt(), arms_down(-0.5), method="walked")
    np.testing.assert_array_equal(again.positions, raised().positions)


def test_lifted_arms_leave_cloth_a_place():
    """What hangs in an armpit is pinched, and can be refused; with arms lifted, as in anchors, none of it is."""
    with pytest.raises(SimulationFailed, match="pinched share"):
        settle(*shirt(), arms_down(0.75), start=drape(), method="walked", most_pinched=0.01)
    lifted = settle(*shirt(), lift_pose_arms(arms_down(0.75), 20.0), start=drape(), method="walked")
    assert lifted.pinched.sum() == 0 and lifted.figures["self_crossing_percent"] == 0


def test_cloth_that_moves_or_has_no_place_is_refused():
    garment, _ = shirt()
    count = len(garment.vertices)
    still = ClothState(*(np.zeros((count, 3)) for _ in range(3)), np.zeros(count), np.zeros(count, bool), None)
    kept = accept(raised(), still)
    assert kept.figures["speed_mm_s"] == 0
    moving = replace(still, velocities=np.full((count, 3), 0.05))
    with pytest.raises(SimulationFailed, match=r"did not come to rest in this pose: mean speed \[mm/s\] 86.6"):
        accept(raised(), moving)
    pinched = np.arange(count) < 0.1 * count
    with pytest.raises(SimulationFailed, match="pinched share 0.1, accepted up to 0.05"):
        accept(replace(raised(), pinched=pinched), still)
    crossed = raised().figures | {"self_crossing_percent": 5.0}
    with pytest.raises(SimulationFailed, match=r"edges through the cloth \[%\] 5, accepted up to 3"):
        accept(replace(raised(), figures=crossed), still)


def test_a_walk_begins_with_the_rest_drape_of_the_shape():
    with pytest.raises(BadInput, match="must be the rest drape of this shape for method 'walked'"):
        settle(*shirt(), arms_down(-0.5), start=raised(), method="walked")
    other = shirt()[1].body.shaped((1.0,))
    with pytest.raises(BadInput, match="must be the rest drape of this shape for method 'walked'"):
        settle(shirt()[0], other, arms_down(-0.5), start=drape(), method="walked")


STRICT = WalkRules(most_pinched=0.01)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Two anchors on two shapes; the first candidate of the second one presses the arms into the torso."""
    folder = tmp_path_factory.mktemp("posed") / "data"
    candidates = [[arms_down(-0.5)], [arms_down(0.75), arms_down(-0.3)]]
    return folder, candidates, produce_posed(folder, shirt()[0], candidates, [(), (1.0,)], rules=STRICT)


def test_a_pose_without_rest_gives_way_to_the_next_and_says_why(made):
    folder, candidates, found = made
    assert [each.pose is pose for each, pose in zip(found, (candidates[0][0], candidates[1][1]), strict=True)] == [
        True
    ] * 2
    dataset = open_dataset(folder)
    assert [len(each.names) for each in found] == [2, 2] and len(dataset.anchors()) == 4
    failed = [row for row in dataset.rows() if row.failed]
    assert len(failed) == 1 and "pinched share" in failed[0].failed
    take = dataset.take(found[0].names[0])
    np.testing.assert_array_equal(take.vertices[0], raised().vertices)
    assert take.inputs["protocol"] == WALK.name


@pytest.mark.slow
def test_what_is_there_is_not_walked_again_and_processes_change_no_bit(made, tmp_path):
    folder, candidates, found = made
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()}
    told = []
    again = produce_posed(
        folder, shirt()[0], candidates, [(), (1.0,)], rules=STRICT, report=lambda *each: told.append(each)
    )
    assert [each.names for each in again] == [each.names for each in found]
    assert {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()} == stamps
    assert told == [("0", 1, 2), ("0", 2, 2), ("1", 1, 2), ("1", 2, 2)]
    shared = produce_posed(tmp_path / "shared", shirt()[0], candidates[:1] * 2, rules=STRICT, jobs=2)
    assert shared[0].names == shared[1].names == found[0].names[:1]
    name = found[0].names[0]
    for each in (folder, tmp_path / "shared"):
        np.testing.assert_array_equal(open_dataset(each).take(name).vertices[0], raised().vertices)


def test_where_no_candidate_comes_to_rest_there_is_none(tmp_path):
    hostile = SimSettings(gravity=(0.0, -1e7, 0.0), halvings=0)
    assert produce_posed(tmp_path / "data", shirt()[0], [[arms_down(-0.5)]], settings=hostile) == [None]

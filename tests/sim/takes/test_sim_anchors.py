"""Garments settled in given poses, with their derivatives, in a dataset."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments, sim
from hemline.bodies import limb_bones
from hemline.datasets import open_dataset
from hemline.errors import BadBody, BadInput
from hemline.meshes import segment_crossings
from hemline.motions.motion import Pose
from hemline.motions.pose_clusters import PoseClusters
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim.takes.anchors import PosedTakes, produce_posed
from hemline.sim.takes.database import Database


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def napkin(shaped):
    return garments.make_cape(shaped, rows=10, columns=20, name="napkin")


def turn_pose(shaped, angle: float) -> Pose:
    """The rest pose with the pelvis turned about the vertical."""
    rotations = shaped.rest_pose.rotations.astype(np.float64).copy()
    rotations[0] = multiply(from_axis_angle(np.array([0.0, angle, 0.0])), rotations[0])
    return Pose(rotations.astype(np.float32), shaped.rest_pose.translation)


@pytest.fixture(scope="module")
def made(napkin, shaped, tmp_path_factory):
    folder = tmp_path_factory.mktemp("anchors") / "data"
    anchors = [sim.Anchor(shaped.rest_pose), sim.Anchor(turn_pose(shaped, 0.3)), sim.Anchor(shaped.rest_pose, (1.0,))]
    return folder, anchors, sim.produce_anchors(folder, napkin, anchors, turns=[0], betas=[0])


def test_each_anchor_is_settled_in_its_pose_on_its_shape(made):
    folder, anchors, rows = made
    dataset = open_dataset(folder)
    assert len(dataset.anchors()) == 3 and not dataset.clips()
    for anchor, row in zip(anchors, rows, strict=True):
        take = dataset.take(row)
        assert (take.kind, row.failed, take.figures["inside"]) == ("anchor", None, 0)
        assert take.figures["residual_share"] < 0.01
        np.testing.assert_array_equal(take.motion[0].rotations, anchor.pose.rotations)
        assert np.trim_zeros(take.betas, "b").tolist() == list(anchor.betas)


def test_derivatives_are_those_of_the_settled_garment(made, napkin, shaped):
    """Pins turn rigidly with the pelvis, omega x (x - pelvis); all is what `Sensitivities` says of `settle`."""
    folder, anchors, rows = made
    take = open_dataset(folder).take(rows[0])
    pins = napkin.pins.vertices
    arm = take.vertices[0, pins] - anchors[0].pose.translation
    np.testing.assert_allclose(take.derivatives["turn.0.1"][pins], np.cross([0, 1, 0], arm), atol=1e-4)
    assert set(take.derivatives) == {"turn.0.0", "turn.0.1", "turn.0.2", "beta.0"}
    alone = sim.Sensitivities(sim.settle(napkin, shaped))
    np.testing.assert_array_equal(take.derivatives["beta.0"], alone.beta(0).astype(np.float32))


def test_what_is_there_is_not_made_again_and_other_derivatives_are_another_anchor(made, napkin):
    folder, anchors, rows = made
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()}
    done = []
    again = sim.produce_anchors(folder, napkin, anchors, turns=[0], betas=[0], report=lambda *n: done.append(n))
    assert [row.name for row in again] == [row.name for row in rows]
    assert {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()} == stamps
    assert done == [("0", 1, 1), ("1", 1, 1), ("2", 1, 1)]
    plain = sim.produce_anchors(folder, napkin, anchors[:1])
    assert plain[0].name != rows[0].name


def test_what_cannot_be_settled_is_a_row_that_says_why(napkin, shaped, tmp_path):
    hostile = sim.SimSettings(gravity=(0.0, -1e7, 0.0), halvings=0)
    (row,) = sim.produce_anchors(tmp_path / "data", napkin, [sim.Anchor(shaped.rest_pose)], settings=hostile)
    assert row.failed and open_dataset(tmp_path / "data").anchors() == []


def test_wrong_joints_and_betas_are_refused(napkin, shaped, tmp_path):
    with pytest.raises(BadInput, match="no such joint; got 99"):
        sim.produce_anchors(tmp_path / "data", napkin, [sim.Anchor(shaped.rest_pose)], turns=[99])
    with pytest.raises(BadBody, match="has 16 betas"):
        sim.produce_anchors(tmp_path / "data", napkin, [sim.Anchor(shaped.rest_pose, (0.0,) * 17)])


def test_an_anchor_takes_the_next_pose_or_does_without_a_body(napkin, shaped, tmp_path):
    folder, poses, shapes = tmp_path / "data", [turn_pose(shaped, 0.1), turn_pose(shaped, 0.2)], [(), (1.0,)]
    (first,) = produce_posed(folder, napkin, [poses[:1]], shapes)
    assert first == PosedTakes(poses[0], first.names, 0) and len(first.names) == 2
    dataset = open_dataset(folder)

    def fail(name):
        dataset.add(replace(dataset.take(name), failed="it did not come to rest"))

    fail(first.names[1])
    (second,) = produce_posed(folder, napkin, [poses], shapes)
    assert second.pose is poses[1] and second.candidate == 1 and len(second.names) == 2
    fail(second.names[0])
    (third,) = produce_posed(folder, napkin, [poses], shapes)
    assert third.pose is poses[0] and third.names == first.names[:1]  # the other body is left out
    fail(first.names[0])
    assert produce_posed(folder, napkin, [poses], shapes) == [None]


def test_an_anchor_with_a_limb_through_the_cloth_is_left_out(napkin, shaped, tmp_path):
    folder, poses = tmp_path / "data", [turn_pose(shaped, 0.1), turn_pose(shaped, 0.2)]
    (first,) = produce_posed(folder, napkin, [poses[:1]])
    dataset = open_dataset(folder)
    take = dataset.take(first.names[0])
    bones = limb_bones(shaped.posed(poses[0]).joints)
    # the cape, carried forward until an upper arm is in it
    for step in np.linspace(0, 0.5, 101):
        vertices = take.vertices + np.array([0, 0, step], np.float32)
        if (segment_crossings(bones, vertices[0], napkin.faces) > 0).any():
            break
    dataset.add(replace(take, vertices=vertices))
    (second,) = produce_posed(folder, napkin, [poses])
    assert second.candidate == 1 and second.names != first.names


def test_what_a_database_lacks_is_said_in_one_line(shaped):
    pose, shapes = shaped.rest_pose, [(), (-1.0,), (1.0,)]
    full, other = PosedTakes(pose, ("a", "b", "c")), PosedTakes(pose, ("d", "e", "f"), 2)
    partial = PosedTakes(pose, ("g", "h"), 1)
    empty = PoseClusters(np.zeros((0, 24, 4)), (), 0.0)
    weights = np.ones(24)
    assert Database(empty, weights, [full], [full], [], [], [], shapes).shortfall() is None
    line = Database(
        empty, weights, [full, other, partial, None], [full, None], [None, None], [full, None, None], [None], shapes
    ).shortfall()
    assert line == (
        "of 4 anchors 2 in another pose of their cluster, 1 without some bodies (1 of 3), 1 left out, as no pose of "
        "their cluster came to rest; 1 of 2 poses on one body left out; 2 of 2 far poses left out; "
        "2 of 3 poses with hanging arms left out; 1 of 1 random bodies left out"
    )

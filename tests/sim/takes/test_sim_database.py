"""The database of AgentDress, from clips to anchors on disk."""

import json
from functools import cache

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.bodies.lifted_arms import LIFT_DEG, lift_pose_arms
from hemline.cli.main import main
from hemline.datasets import create, open_dataset
from hemline.datasets.arm_lift import arm_lifts_deg
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.errors import BadDataset, BadInput
from hemline.garments import coarser_garment
from hemline.motions.motion import JOINT_NAMES, Motion
from hemline.motions.pose_clusters import square_distances
from hemline.sim import make_database
from hemline.sim.takes import database
from hemline.sim.takes.database import hanging_poses, sample_poses


@cache
def shirt():
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    return garment


@pytest.fixture(scope="module")
def few_shapes():
    """Five shapes instead of seventeen."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(database, "SHAPE_BETAS", 1)
        yield


@pytest.fixture(scope="module")
def made(few_shapes, tmp_path_factory):
    folder = tmp_path_factory.mktemp("database") / "data"
    told = []
    clips = [motions.load("walk")[:60], motions.load("dance")[:90]]
    return (
        folder,
        make_database(folder, shirt(), clips, 3, beside=2, hanging=1, random=3, progress=lambda *e: told.append(e)),
        told,
    )


@pytest.mark.slow
def test_anchors_are_poses_of_the_clips_on_all_shapes(made):
    folder, found, told = made
    assert len(found.shapes) == 5 and len(found.anchors) == 3 and all(found.anchors)
    dataset = open_dataset(folder)
    poses = sample_poses([motions.load("walk")[:60], motions.load("dance")[:90]])
    for anchor, members in zip(found.anchors, found.clusters.members, strict=True):
        assert len(anchor.names) == 5
        away = np.abs(poses[members] - anchor.pose.rotations).max(axis=(1, 2))
        assert away.min() < 1e-6
        betas = {dataset.take(name).betas[0] for name in anchor.names}
        assert betas == {-2.0, -1.0, 0.0, 1.0, 2.0}
    assert [len(each.names) for each in found.beside if each] == [1, 1]
    for each, pose in zip(found.random, [*found.beside, *found.hanging], strict=True):
        take = dataset.take(each.names[0])
        assert take.motion[0].hash == pose.pose.hash and np.abs(take.betas[5:]).min() > 0
    stages = [("clusters", 1, 1), ("anchors", 15, 15), ("poses", 2, 2), ("hanging arms", 1, 1), ("random bodies", 2, 2)]
    assert [told.index(each) for each in stages] == sorted(told.index(each) for each in stages)
    assert told[-1] == ("random bodies", 1, 1) and arm_lifts_deg(dataset) == {0.0, LIFT_DEG}
    hanging = dataset.take(found.hanging[0].names[0]).motion.rotations[0]
    low = sample_poses([motions.load("walk")[:60], motions.load("dance")[:90]], lift_deg=0.0)
    assert np.abs(low - hanging).max(axis=(1, 2)).min() < 1e-6 < np.abs(poses - hanging).max(axis=(1, 2)).min()


def test_poses_with_hanging_arms_are_those_that_a_lift_would_change():
    walk = motions.load("walk")[:60]
    low, lifted = hanging_poses([walk]), sample_poses([walk])
    plain = sample_poses([walk], lift_deg=0.0)
    assert 0 < len(low) <= len(plain)
    chosen = [np.abs(plain - each).max(axis=(1, 2)).argmin() for each in low]
    assert (np.abs(plain - lifted)[chosen].max(axis=(1, 2)) > 0.02).all()
    raised = Motion(np.tile([1.0, 0, 0, 0], (5, 24, 1)), np.zeros((5, 3)), fps=30.0, leg_length=0.9)
    with pytest.raises(BadInput, match="no arm hangs in any pose of the clips"):
        hanging_poses([raised])


@pytest.mark.slow
def test_a_far_pose_is_unlike_the_anchors_and_random_bodies_take_it_in_turn(few_shapes, tmp_path):
    clips = [motions.load("walk")[:60], motions.load("dance")[:90]]
    found, poses = make_database(tmp_path / "far", shirt(), clips, 2, far=1, random=1), sample_poses(clips)
    (far,), (scattered,) = found.far, found.random
    anchors = np.array([each.pose.rotations for each in found.anchors if each])
    away = square_distances(poses, anchors, found.weights).min(axis=1)
    own = square_distances(far.pose.rotations[None], anchors, found.weights).min()
    assert far.candidate == 0 and own > np.percentile(away, 95)
    assert scattered.pose.hash == far.pose.hash and found.beside == found.hanging == []


@pytest.mark.slow
def test_the_joints_that_move_a_shirt_count(made):
    weights = dict(zip(JOINT_NAMES, made[1].weights, strict=True))
    assert weights["left_shoulder"] > 0.03 and weights["spine2"] > 0.02
    assert max(weights[name] for name in ("left_knee", "right_ankle", "left_hand")) < 1e-2 * weights["left_shoulder"]


def test_poses_are_every_fourth_frame_with_arms_lifted():
    walk = motions.load("walk")[:60]
    poses = sample_poses([walk])
    thirty = walk.resample(30.0)
    assert len(poses) == -(-len(thirty) // 4)
    lifted = lift_pose_arms(thirty[4]).rotations
    np.testing.assert_allclose(poses[1, 1:], lifted[1:], atol=1e-6)
    assert np.abs(poses[1, 16] - thirty[4].rotations[16]).max() > 0.05


@pytest.mark.slow
def test_the_command_continues_what_is_there_and_a_fit_plays_it(made, few_shapes, tmp_path, capsys):
    folder = made[0]
    model = tmp_path / "shirt.safetensors"
    assert main(["fit", str(folder), "--animator", "agentdress", "-o", str(model), "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)["figures"]
    assert figures["anchors"] == 3 and figures["shapes"] == 5 and 3 < figures["poses"] <= 5  # one may stand for both
    assert figures["shape_left_out_mm"] < figures["shape_left_out_mean_mm"]
    assert main(["evaluate", str(model), "--motion", "walk", "--json", "--betas", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["inside_percent"]["after"] == 0 and told["stretch_percent"]["p99_mean"] < 60


@pytest.mark.slow
def test_another_material_in_the_same_poses_is_fitted_and_played(made, tmp_path, capsys, monkeypatch):
    folder, found, _ = made
    monkeypatch.chdir(tmp_path)
    shirt().save("shirt.safetensors")
    asked = ["drape", "shirt.safetensors", "--material", "denim", "--poses-of", str(folder), "--poses", "3"]
    assert main([*asked, "-o", "denim", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["poses"]
    assert len(rows) == 3 and all(len(row["takes"]) == 1 for row in rows)
    dataset = open_dataset("denim")
    assert dataset.garment.material.name == "denim"
    known = {each.pose.hash for each in (*found.anchors, *found.beside)}
    assert {dataset.take(row).motion[0].hash for row in dataset.anchors()} <= known
    before = sorted(path.stat().st_mtime_ns for path in (tmp_path / "denim" / "takes").iterdir())
    assert main([*asked, "-o", "denim"]) == 0  # what is there is kept
    assert before == sorted(path.stat().st_mtime_ns for path in (tmp_path / "denim" / "takes").iterdir())
    assert main(["fit", str(folder), "denim", "--animator", "agentdress", "-o", "both.safetensors", "--json"]) == 0
    assert (
        main(["animate", "both.safetensors", "-m", "walk", "--seconds", "0.1", "--material", "denim", "-o", "d.npz"])
        == 0
    )
    assert main(["animate", "both.safetensors", "-m", "walk", "--seconds", "0.1", "-o", "own.npz"]) == 0
    worn, own = (np.load(name)["vertices"] for name in ("d.npz", "own.npz"))
    assert np.linalg.norm(worn - own, axis=2).mean() > 1e-3


def test_poses_of_another_dataset_are_asked_for_as_they_can_be(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shirt().save("shirt.safetensors")
    create("data", shirt())
    for words, complaint in (
        (["shirt.safetensors", "--material", "velvet"], "unknown material; got 'velvet'"),
        (["shirt.safetensors", "--material", "denim", "--random", "3"], "settles on the mean body alone"),
        (["shirt.safetensors"], "of that material; got jersey; name another material"),
        (["shirt.safetensors", "--material", "denim"], "no anchor in the T-pose with derivatives"),
        (["cape-light", "--material", "denim"], "the poses of a dataset are for its own garment"),
    ):
        assert main(["drape", *words, "--poses-of", "data", "--poses", "3", "-o", "x"]) == 2
        assert complaint in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
    assert main(["animate", "cape", "-m", "walk", "--material", "silk", "-o", "x.glb"]) == 2
    assert "ropes plays garments of the material that it learned" in capsys.readouterr().err
    assert main(["animate", "tshirt-light", "-m", "walk", "--material", "velvet", "-o", "x.glb"]) == 2
    assert "unknown material; got 'velvet'" in capsys.readouterr().err


def test_bad_questions_are_refused(tmp_path, capsys):
    walk = motions.load("walk")[:9]
    with pytest.raises(BadInput, match="number of anchors must be positive; got 0"):
        make_database(tmp_path / "none", shirt(), [walk], 0)
    with pytest.raises(BadInput, match="beside the anchors must not be negative; got -1"):
        make_database(tmp_path / "none", shirt(), [walk], 1, beside=-1)
    with pytest.raises(BadInput, match="number of far poses must not be negative; got -1"):
        make_database(tmp_path / "none", shirt(), [walk], 1, far=-1)
    with pytest.raises(BadInput, match="number of poses with hanging arms must not be negative; got -1"):
        make_database(tmp_path / "none", shirt(), [walk], 1, hanging=-1)
    with pytest.raises(BadInput, match="number of random bodies must not be negative; got -1"):
        make_database(tmp_path / "none", shirt(), [walk], 1, random=-1)
    with pytest.raises(BadDataset, match="no anchor in the T-pose with derivatives"):
        mean_sensitivity([], bodies.load("anny24"))
    other = garments.make_cape(bodies.load("anny24").shaped(), rows=9, columns=12)
    create(tmp_path / "other", other)
    with pytest.raises(BadDataset, match="made for|holds|another"):
        make_database(tmp_path / "other", shirt(), [walk], 1)
    for words, complaint in (
        (["--anchors", "5"], "--anchors and --motion belong together"),
        (["--motion", "walk"], "--anchors and --motion belong together"),
        (["--poses", "5"], "--poses stand beside --anchors"),
        (["--derivatives"], "--derivatives are those at the anchors"),
        (["--anchors", "5", "--motion", "walk", "--jobs", "0"], "--jobs must be at least 1"),
        (["--anchors", "-1", "--motion", "walk"], "--anchors must not be negative"),
    ):
        assert main(["drape", "tshirt-light", "-o", str(tmp_path / "x"), *words]) == 2
        assert complaint in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_weights_are_sums_of_norms_and_the_pelvis_counts_as_the_spine():
    sensitivity = np.random.default_rng(0).uniform(size=(50, 24, 3))
    sensitivity[:, 0] = 9.0
    weights = joint_weights(sensitivity)
    sums = sensitivity.sum(axis=(0, 2))
    np.testing.assert_allclose(weights[1:] / weights[1], sums[1:] / sums[1])
    assert weights[0] == weights[3] and weights.max() == 1

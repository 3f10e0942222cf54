"""Sensitivity-optimised rigging as pose model: fit, quantization, playback and files, on a shirt with a formula."""

from dataclasses import replace

import numpy as np
import pytest

import hemline
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import anchor_weights
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit
from hemline.animators.agentdress.fit.rigged_anchors import RiggedAnchors, rows_with_derivatives
from hemline.animators.agentdress.fit.rigged_model import with_rigging
from hemline.animators.agentdress.sor.rigged_tables import WEIGHT_SUM, quantize_weights
from hemline.animators.agentdress.sor.rigging import MOST_BONES, Rigging
from hemline.cli.main import main
from hemline.datasets import open_dataset
from hemline.errors import BadDataset, BadModel
from hemline.files import read_tensors, write_tensors
from hemline.motions import Pose
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix
from tests.animators import formula_garment as made

ANCHORS = 6
STILL = AgentDressConfig(pose_model="sor", decay_seconds=0.0)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return made.make_dataset(tmp_path_factory.mktemp("anchors") / "data", ANCHORS, singles=8, rigged=ANCHORS)


@pytest.fixture(scope="module")
def model(dataset):
    return fit(dataset, STILL)


def posed(pose, betas=()):
    return made.body().body.shaped(np.asarray(betas, np.float32)).posed(pose)


def play_pose(model, pose, betas=()):
    body = posed(pose, betas)
    return model.step(model.start(body), body, 1 / 30)[1]


def rigged(model):
    assert model.tables.rigged is not None
    return model.tables.rigged


def unpack(model) -> Rigging:
    """Returns the quantized rigging of a model in double precision."""
    held = rigged(model)
    weights = np.zeros((*held.worn.shape[:2], JOINT_COUNT))
    np.put_along_axis(weights, held.indices.astype(int), held.weights / WEIGHT_SUM, axis=2)
    return Rigging(held.transforms.astype(np.float64), held.worn * np.float64(held.step[0]), weights)


def blend(model, pose):
    distances = model._distances(model._axes(pose.rotations))[:, rigged(model).poses]
    return anchor_weights(distances, **model.config.blending)


def test_in_the_pose_of_an_anchor_the_garment_is_that_of_the_anchor(dataset):
    alone = fit(dataset, replace(STILL, neighbours=1, floor=1e-9))
    for number in range(ANCHORS):
        pose = made.anchor_pose(made.random_pose(number))
        np.testing.assert_allclose(alone.drape(posed(pose)), made.garment_in_pose(pose), atol=5e-5)


def test_playback_equals_plain_numpy(model):
    """The offsets are those of `Rigging.at` from the skinned garment, in rotated vertex frames."""
    for number in (1, 100, 101):
        pose = made.random_pose(number)
        transforms, shares = posed(pose).transforms, blend(model, pose)
        tables = model.tables
        there = unpack(model).at(transforms, tables.regions.astype(np.float64) @ shares)
        wanted = model._binding.offsets(transforms, tables.rest, there)
        found = rigged(model).offset(transforms, shares, tables.regions, model._binding, tables.rest)
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, wanted, atol=2e-5)


def test_packing_keeps_the_rigging(dataset, model):
    """Coordinates are exact to 0.01 mm, weights to 1/255, with few bytes."""
    anchors = AnchorSet.of(dataset)
    fitted = RiggedAnchors.rig(
        dataset, rows_with_derivatives(dataset), model, anchors, model.figures["rigging_stiffness"]
    )
    held, found = rigged(with_rigging(fitted)), unpack(with_rigging(fitted))
    moved = found.transforms[:, 0, :, 3] - fitted.rigging.transforms[:, 0, :, 3]
    np.testing.assert_allclose(found.vertices - moved[:, None], fitted.rigging.vertices, atol=1e-5)
    np.testing.assert_allclose(found.weights, fitted.rigging.weights, atol=1 / WEIGHT_SUM)
    assert sum(array.nbytes for array in held.arrays().values()) < ANCHORS * (22 * held.worn.shape[1] + 1200) + 100


def test_quantized_weights_keep_their_sum():
    weights = np.random.default_rng(0).dirichlet(np.full(MOST_BONES, 0.3), 1000)
    parts = quantize_weights(weights)
    assert parts.dtype == np.uint8 and (parts.sum(axis=1, dtype=int) == WEIGHT_SUM).all()
    assert np.abs(parts - WEIGHT_SUM * weights).max() < 1
    assert quantize_weights(np.eye(MOST_BONES)).tolist() == (WEIGHT_SUM * np.eye(MOST_BONES)).tolist()


def test_the_garment_moves_rigidly_with_the_root(model):
    pose = made.random_pose(101)
    turn, shift = from_axis_angle(np.array([0.0, 1.1, 0.0])), np.array([0.3, 0.2, -1.0])
    rotations = pose.rotations.astype(np.float64)
    rotations[0] = multiply(turn, rotations[0])
    wanted = (play_pose(model, pose) - pose.translation) @ to_matrix(turn).T + pose.translation + shift
    np.testing.assert_allclose(play_pose(model, Pose(rotations, pose.translation + shift)), wanted, atol=2e-5)


def test_new_poses_err_less_than_skinning_on_any_shape(model):
    for betas in ((), (1.5, -0.8)):
        ours, theirs = [], []
        for number in range(100, 108):
            pose = made.random_pose(number)
            truth, rest = made.lifted_garment(pose, betas), made.formula(made.body().rest_pose, ())
            skinned = made.binding().skin(posed(pose, betas).transforms, made.rest_garment(), rest)
            ours.append(np.linalg.norm(play_pose(model, pose, betas) - truth, axis=1).mean())
            theirs.append(np.linalg.norm(skinned - truth, axis=1).mean())
        assert np.mean(ours) < 0.8 * np.mean(theirs)


def test_figures_are_those_of_rigging(dataset, model):
    figures = model.figures
    assert figures["rigged"] == figures["anchors"] == figures["poses"] == ANCHORS
    assert figures["error_to_expect_mm"] == figures["pose_left_out_mm"] + figures["shape_left_out_mm"]
    assert not any(name.startswith("kernel") for name in figures)
    anchors, rows = AnchorSet.of(dataset), rows_with_derivatives(dataset)
    by_stiffness = [RiggedAnchors.rig(dataset, rows, model, anchors, each).validation_mm for each in (1e-6, 1e-2, 1.0)]
    assert figures["pose_left_out_mm"] <= min(by_stiffness) + 1e-9


def test_without_single_poses_anchors_are_left_out(dataset, model):
    anchors, rows = AnchorSet.of(dataset), rows_with_derivatives(dataset)
    beside = anchors.subset(np.arange(ANCHORS), np.empty(0, int))
    found = RiggedAnchors.rig(dataset, rows, model, beside, 1e-2)
    pose = made.anchor_pose(made.random_pose(2))
    (number,) = np.flatnonzero((found.rotations == pose.rotations).all(axis=(1, 2)))
    others = found.subset(np.delete(np.arange(ANCHORS), number))
    lies = model._binding.offsets(posed(pose).transforms, model.tables.rest, made.garment_in_pose(pose))
    missed = 1e3 * np.linalg.norm(others(pose) - lies, axis=1).mean()
    assert found._leave_one_out_mm()[number] == pytest.approx(missed, rel=1e-3)
    assert found.validation_mm == np.mean(found._leave_one_out_mm())


def test_anchors_and_other_poses_may_have_derivatives(tmp_path, model):
    data = made.make_dataset(tmp_path / "data", 4, rigged=2)
    pose = made.anchor_pose(made.random_pose(9))
    data.add(made.anchor(pose, (), made.derivatives(pose)))
    found = fit(data, replace(STILL, neighbours=1, floor=1e-9))
    assert len(set(rigged(found).poses)) == 3 and max(rigged(found).poses) == 4
    assert len(found.tables.rotations) == found.figures["poses"] == 5 and found.figures["anchors"] == 4
    np.testing.assert_allclose(found.drape(posed(pose)), made.garment_in_pose(pose), atol=5e-5)


def test_redress_with_its_own_garment_changes_nothing(model):
    pose, betas = made.random_pose(51), (1.5, -0.8)
    there = posed(pose, betas)
    told = model.redress(model.start(there), there, 1 / 30, play_pose(model, pose), posed(pose))[1]
    np.testing.assert_allclose(told, play_pose(model, pose, betas), atol=3e-5)


def test_a_model_file_changes_no_bit_of_playback(model, tmp_path):
    model.save(tmp_path / "shirt.safetensors")
    once = hemline.load(tmp_path / "shirt.safetensors")
    once.save(tmp_path / "again.safetensors")
    assert (tmp_path / "shirt.safetensors").read_bytes() == (tmp_path / "again.safetensors").read_bytes()
    again = hemline.load(tmp_path / "again.safetensors")
    pose, betas = made.random_pose(100), (0.5,)
    np.testing.assert_array_equal(play_pose(again, pose, betas), play_pose(once, pose, betas))
    np.testing.assert_array_equal(play_pose(once, pose), play_pose(model, pose))
    assert once.config.pose_model == "sor" and once.figures == model.figures


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda arrays: arrays.pop("tables.rigged.worn"), "lacks array 'worn'"),
        (lambda arrays: arrays["tables.rigged.poses"].fill(99), "names a pose that does not exist; got 99"),
        (lambda arrays: arrays["tables.rigged.indices"].fill(24), "names a bone that does not exist; got 24"),
        (lambda arrays: arrays["tables.rigged.weights"].fill(31), "sum to 255; got 248"),
        (lambda arrays: arrays.update({"tables.rigged.step": np.zeros(2, np.float32)}), "'step' of the model must be"),
    ],
)
def test_damaged_models_are_refused(model, tmp_path, change, complaint):
    model.save(tmp_path / "shirt.safetensors")
    arrays, metadata = read_tensors(tmp_path / "shirt.safetensors", "model", error=BadModel)
    change(arrays)
    write_tensors(tmp_path / "bad.safetensors", arrays, metadata)
    with pytest.raises(BadModel, match=complaint):
        hemline.load(tmp_path / "bad.safetensors")


def test_anchors_without_derivatives_are_refused_with_the_option_to_use(tmp_path, capsys):
    made.make_dataset(tmp_path / "data", 4, rigged=1)
    with pytest.raises(BadDataset, match="fewer than two anchors with derivatives.*; got 1; .* --derivatives, or fit"):
        fit(open_dataset(tmp_path / "data"), STILL)
    asked = ["fit", str(tmp_path / "data"), "--animator", "agentdress", "--pose-model", "sor"]
    assert main([*asked, "-o", str(tmp_path / "shirt.safetensors")]) == 2
    assert "--derivatives" in capsys.readouterr().err and not (tmp_path / "shirt.safetensors").exists()


def test_command_line_fits_and_plays(dataset, tmp_path):
    asked = ["fit", str(dataset.folder), "--animator", "agentdress", "--pose-model", "sor", "--neighbours", "4"]
    assert main([*asked, "-o", str(tmp_path / "shirt.safetensors")]) == 0
    found = hemline.load(tmp_path / "shirt.safetensors")
    assert found.config.pose_model == "sor" and found.tables.rigged is not None
    shown = ["animate", str(tmp_path / "shirt.safetensors"), "-m", "walk", "--seconds", "0.2", "--detail", "0.5"]
    assert main([*shown, "--betas", "1", "-o", str(tmp_path / "walk.npz")]) == 0
    assert np.isfinite(np.load(tmp_path / "walk.npz")["vertices"]).all()


def test_bodies_in_single_poses_count(tmp_path):
    """Without mirror images, the effect of the shape does not depend on the pose model."""
    data = made.make_dataset(tmp_path / "beside", ANCHORS, singles=6, rigged=ANCHORS)
    for number in range(12):
        data.add(made.anchor(made.anchor_pose(made.random_pose(ANCHORS + number % 6)), made.random_body(number)))
    betas = made.random_body(50)
    added = []
    for way in ("sor", "kernel"):
        model = fit(data, replace(STILL, pose_model=way, mirror=False))
        pose = made.anchor_pose(made.random_pose(70))
        mean, other = posed(pose), posed(pose, betas)
        added.append(model.drape(other) - model.drape(mean))
    assert np.abs(added[1]).max() > 0.01
    np.testing.assert_allclose(added[0], added[1], atol=2e-5)

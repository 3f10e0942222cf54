"""Garments on the body of the fit, put on bodies of other shapes (Eq. 4)."""

import numpy as np
import pytest

import hemline
from hemline import datasets
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.fit import fit
from hemline.cli.main import main
from hemline.errors import BadInput
from hemline.motions.motion import Motion
from hemline.playback import redress_take
from tests.animators import formula_garment as made

BETAS = (1.5, -0.8)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return fit(made.make_dataset(tmp_path_factory.mktemp("anchors") / "data", 12), AgentDressConfig())


def on(betas):
    return made.body().body.shaped(np.asarray(betas, np.float32))


def redress(model, pose, worn, betas=BETAS, nominal=None):
    state = model.start(on(betas).posed(pose))
    return model.redress(state, on(betas).posed(pose), 1 / 30, worn, nominal or made.body().posed(pose))[1]


def test_the_body_of_the_fit_changes_nothing(model):
    pose = made.random_pose(50)
    worn = made.lifted_garment(pose) + np.float32(0.01)
    np.testing.assert_allclose(redress(model, pose, worn, betas=()), worn, atol=2e-5)


def test_its_own_garment_on_the_mean_shape_gives_its_own_playback(model):
    pose = made.random_pose(51)
    _, own = model.step(model.start(made.body().posed(pose)), made.body().posed(pose), 1 / 30)
    _, played = model.step(model.start(on(BETAS).posed(pose)), on(BETAS).posed(pose), 1 / 30)
    np.testing.assert_allclose(redress(model, pose, own), played, atol=3e-5)


def test_a_simulated_garment_is_nearer_to_the_truth_than_the_pose_model_and_than_skinning(model):
    missed = []
    for number in range(100, 108):
        pose = made.random_pose(number)
        truth, posed = made.lifted_garment(pose, BETAS), on(BETAS).posed(pose)
        _, played = model.step(model.start(posed), posed, 1 / 30)
        skinned = made.binding().skin(posed.transforms, made.rest_garment())
        given = redress(model, pose, made.lifted_garment(pose)), played, skinned
        missed.append([np.linalg.norm(each - truth, axis=1).mean() for each in given])
    simulated, played, skinned = np.mean(missed, axis=0)
    assert simulated < 0.8 * played and played < 0.1 * skinned


def test_the_place_of_the_other_body_does_not_matter(model):
    pose = made.random_pose(52)
    there = hemline.motions.Pose(pose.rotations, pose.translation + np.float32([0.4, 0.1, -2.0]))
    worn, state = made.lifted_garment(pose), model.start(on(BETAS).posed(pose))
    _, moved = model.redress(state, on(BETAS).posed(there), 1 / 30, worn, made.body().posed(pose))
    np.testing.assert_allclose(moved - (there.translation - pose.translation), redress(model, pose, worn), atol=2e-5)


def test_bad_input(model):
    pose = made.random_pose(53)
    with pytest.raises(BadInput, match="is put on other shapes from the one that it was made on; got betas 1 0"):
        redress(model, pose, made.lifted_garment(pose), nominal=on((1.0,)).posed(pose))
    with pytest.raises(BadInput, match="has vertices .*; got .*; give its own mesh"):
        redress(model, pose, made.lifted_garment(pose)[1:])
    player = hemline.Player.prepare(hemline.load("cape"), made.body())
    state = player.start(pose, pre_roll=0.1)
    with pytest.raises(BadInput, match="got animator 'ropes'; fit one with 'hemline fit --animator agentdress'"):
        player.redress(state, pose, 1 / 30, made.lifted_garment(pose), made.body().posed(pose))


@pytest.fixture
def taken(tmp_path):
    """Makes a dataset with one clip that follows the formula on the mean body; returns it with its take."""
    poses = [made.anchor_pose(made.random_pose(number)) for number in (60, 61, 61, 60)]
    motion = Motion(
        np.stack([pose.rotations for pose in poses]),
        np.stack([pose.translation for pose in poses]),
        fps=30.0,
        leg_length=made.body().leg_length,
        name="made",
    )
    inputs = {"clip": {"name": "made"}, "garment": made.shirt().hash}
    take = datasets.Take(
        "clip",
        np.stack([made.garment_in_pose(pose) for pose in poses]),
        motion,
        made.body().betas,
        np.array([True, False, False, False]),
        np.zeros(4, np.int32),
        {},
        inputs,
    )
    dataset = datasets.create(tmp_path / "takes", made.shirt())
    dataset.add(take)
    return tmp_path, take


def test_a_take_is_shown_on_another_body_without_its_lead_in(model, taken):
    _, take = taken
    body = on(BETAS)
    frames = list(redress_take(model, take, body))
    assert len(frames) == 3
    for frame, index in zip(frames, (1, 2, 3), strict=True):
        placed = body.placed(take.motion)[index]
        np.testing.assert_array_equal(frame.body.vertices, body.posed(placed).vertices)
        assert not frame.report.inside_before and frame.vertices.shape == take.vertices[0].shape
        free = np.setdiff1d(np.arange(len(frame.vertices)), frame.report.pinched)
        assert not hemline.collide.inside(frame.body.vertices, frame.body.faces, frame.vertices[free]).any()


def test_export_shows_a_take_on_another_body(model, taken, capsys):
    folder, take = taken
    model.save(folder / "shirt.safetensors")
    asked = ["export", str(folder / "takes"), "--take", "0", "-o", str(folder / "out.npz")]
    assert main([*asked, "--model", str(folder / "shirt.safetensors"), "--betas", "1.5", "-0.8"]) == 0
    written = np.load(folder / "out.npz")
    wanted = np.stack([frame.vertices for frame in redress_take(model, take, on(BETAS))])
    np.testing.assert_allclose(written["vertices"], wanted, atol=1e-4)  # shapes in half precision
    capsys.readouterr()
    assert main([*asked, "--betas", "1"]) == 2
    assert "got --betas alone; name one with --model" in capsys.readouterr().err
    assert main([*asked, "--model", "tshirt-light"]) == 2
    assert "model and take must be of the same garment" in capsys.readouterr().err
    assert main([*asked, "--model", "tshirt-light", "--lead-in"]) == 2
    assert "leave --lead-in out" in capsys.readouterr().err

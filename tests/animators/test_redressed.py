"""One animator moves a garment on the body of its fit, another one puts it on other shapes."""

import numpy as np
import pytest

import hemline
from hemline import garments
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.fit import fit
from hemline.animators.redressed import AnimatorRedressed
from hemline.cli.main import main
from hemline.errors import BadInput
from hemline.garments import coarser_garment
from hemline.motions.motion import Pose
from tests.animators import formula_garment as made

BETAS = (1.5, -0.8)


class Swinging:
    """The shirt settled by the formula, drawn after the body by a spring: it has a past."""

    name, body_name, figures = "swinging", "anny24", {"error_mm": 1.0}

    def __init__(self):
        self.garment, self.body_hash = made.shirt(), made.body().body.hash

    def start(self, posed):
        return made.garment_in_pose(posed.pose)

    def step(self, state, posed, dt):
        state = state + np.float32(1 - np.exp(-5 * dt)) * (made.garment_in_pose(posed.pose) - state)
        return state, state

    def save(self, path):
        raise NotImplementedError


@pytest.fixture(scope="module")
def shapes(tmp_path_factory):
    return fit(made.make_dataset(tmp_path_factory.mktemp("anchors") / "data", 12), AgentDressConfig())


def on(betas):
    return made.body().body.shaped(np.asarray(betas, np.float32))


def walked(animator, body, poses):
    state, frames = animator.start(body.posed(poses[0])), []
    for pose in poses:
        state, vertices = animator.step(state, body.posed(pose), 1 / 30)
        frames.append(vertices)
    return np.array(frames)


def test_on_the_body_of_the_fit_it_is_what_moves_alone(shapes):
    poses = [made.anchor_pose(made.random_pose(number)) for number in (1, 2, 3)]
    alone = walked(Swinging(), made.body(), poses)
    np.testing.assert_allclose(walked(AnimatorRedressed(Swinging(), shapes), made.body(), poses), alone, atol=2e-5)


def test_on_another_shape_it_is_what_moves_redressed_frame_by_frame(shapes):
    poses, body = [made.anchor_pose(made.random_pose(number)) for number in (4, 5, 6)], on(BETAS)
    scale = np.float32(made.body().leg_length / body.leg_length)
    there = [Pose(pose.rotations, pose.translation * scale) for pose in poses]
    alone = walked(Swinging(), made.body(), there)
    state, expected = shapes.start(body.posed(poses[0])), []
    for pose, nominal, worn in zip(poses, there, alone, strict=True):
        state, vertices = shapes.redress(state, body.posed(pose), 1 / 30, worn, made.body().posed(nominal))
        expected.append(vertices)
    np.testing.assert_allclose(walked(AnimatorRedressed(Swinging(), shapes), body, poses), expected, atol=1e-6)


def test_the_state_is_a_rollback(shapes):
    animator, body = AnimatorRedressed(Swinging(), shapes), on(BETAS)
    one, other = (body.posed(made.anchor_pose(made.random_pose(number))) for number in (7, 8))
    before = animator.start(one)
    first = animator.step(before, other, 1 / 30)[1]
    animator.step(before, one, 1 / 30)
    np.testing.assert_array_equal(animator.step(before, other, 1 / 30)[1], first)


def test_a_player_shows_it(shapes):
    body, animator = on(BETAS), AnimatorRedressed(Swinging(), shapes)
    pose = made.anchor_pose(made.random_pose(9))
    player = hemline.Player.prepare(animator, body)
    state = player.start(pose, pre_roll=0.1)
    _, frame = player.step(state, pose, 1 / 30)
    free = np.setdiff1d(np.arange(len(frame.vertices)), frame.report.pinched)
    assert not hemline.collide.inside(frame.body.vertices, frame.body.faces, frame.vertices[free]).any()
    assert animator.figures["error_mm"] == 1.0 and "shapes_anchors" in animator.figures


class Skinned(Swinging):
    """The shirt with five times the vertices, skinned."""

    def __init__(self):
        super().__init__()
        self.garment = garments.load("tshirt-light")
        body = made.body()
        self.binding = Binding.of(self.garment.vertices, self.garment.faces, body.posed(body.rest_pose))

    def start(self, posed):
        return None

    def step(self, state, posed, dt):
        return None, self.binding.skin(posed.transforms, self.garment.vertices).astype(np.float32)


def test_a_finer_mesh_is_put_on_other_shapes_by_a_coarser_one(shapes):
    """Where the two share vertices it goes where the coarser one does, but for what lies between its vertices."""
    fine, pose = Skinned(), made.anchor_pose(made.random_pose(10))
    kept = coarser_garment(fine.garment, 0.2)[1]
    both = AnimatorRedressed(fine, shapes)
    alone = walked(fine, made.body(), [pose])[0]
    np.testing.assert_allclose(walked(both, made.body(), [pose])[0], alone, atol=2e-5)
    body = on(BETAS)
    nominal = Pose(pose.rotations, pose.translation * np.float32(made.body().leg_length / body.leg_length))
    worn = walked(fine, made.body(), [nominal])[0][kept]
    posed = body.posed(pose)
    coarse = shapes.redress(shapes.start(posed), posed, 1 / 30, worn, made.body().posed(nominal))[1]
    found = walked(both, body, [pose])[0]
    assert found.shape == fine.garment.vertices.shape
    changed = np.linalg.norm(coarse - worn, axis=1).mean()
    missed = np.linalg.norm(found[kept] - coarse, axis=1)
    assert missed.mean() < 0.02 * changed and missed.max() < 0.2 * changed


def test_animate_puts_a_model_on_another_shape_with_what_a_second_one_knows(shapes, tmp_path, capsys):
    shapes.save(tmp_path / "shirt.safetensors")
    model, out = str(tmp_path / "shirt.safetensors"), tmp_path / "out.npz"
    asked = ["animate", model, "-m", "walk", "--seconds", "0.2", "--betas", "1.5", "-0.8", "-o", str(out)]
    assert main([*asked, "--shapes", model]) == 0
    assert np.load(out)["vertices"].shape[1] == len(shapes.garment.vertices)
    capsys.readouterr()
    out.unlink()
    assert main([*asked, "--shapes", "tshirt-light"]) == 0 and out.exists()  # the same shirt, five times the vertices
    out.unlink()
    capsys.readouterr()
    assert main([*asked, "--shapes", "trousers-light"]) == 2
    assert "must be of one garment on the same body" in capsys.readouterr().err and not out.exists()


def test_bad_input(shapes, tmp_path):
    with pytest.raises(BadInput, match="got animator 'ropes'; fit one with 'hemline fit --animator agentdress'"):
        AnimatorRedressed(Swinging(), hemline.load("cape"))
    with pytest.raises(BadInput, match="must be of one garment on the same body; got 'cape' on anny24 and"):
        AnimatorRedressed(hemline.load("cape"), shapes)
    with pytest.raises(BadInput, match="two animators are saved one by one"):
        AnimatorRedressed(Swinging(), shapes).save(tmp_path / "both.safetensors")

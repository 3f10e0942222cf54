"""One animator moves a garment on the body of its fit, another one puts it on other shapes."""

import dressed_by_formula as made
import numpy as np
import pytest

import hemline
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit import fit
from hemline.animators.redressed import AnimatorRedressed
from hemline.errors import BadInput
from hemline.motions.motion import Pose

BETAS = (1.5, -0.8)


class Swinging:
    """The shirt settled by the formula, drawn after the body by a spring: it has a past."""

    name, body_name, figures = "swinging", "anny24", {"error_mm": 1.0}

    def __init__(self):
        self.garment, self.body_hash = made.shirt(), made.body().body.hash

    def start(self, posed):
        return made.laid(posed.pose)

    def step(self, state, posed, dt):
        state = state + np.float32(1 - np.exp(-5 * dt)) * (made.laid(posed.pose) - state)
        return state, state

    def save(self, path):
        raise NotImplementedError


@pytest.fixture(scope="module")
def shapes(tmp_path_factory):
    return fit(made.dataset(tmp_path_factory.mktemp("anchors") / "data", 12), AgentDressConfig())


def on(betas):
    return made.body().body.shaped(np.asarray(betas, np.float32))


def walked(animator, body, poses):
    state, frames = animator.start(body.posed(poses[0])), []
    for pose in poses:
        state, vertices = animator.step(state, body.posed(pose), 1 / 30)
        frames.append(vertices)
    return np.array(frames)


def test_on_the_body_of_the_fit_it_is_what_moves_alone(shapes):
    poses = [made.anchored(made.random_pose(number)) for number in (1, 2, 3)]
    alone = walked(Swinging(), made.body(), poses)
    np.testing.assert_allclose(walked(AnimatorRedressed(Swinging(), shapes), made.body(), poses), alone, atol=2e-5)


def test_on_another_shape_it_is_what_moves_redressed_frame_by_frame(shapes):
    poses, body = [made.anchored(made.random_pose(number)) for number in (4, 5, 6)], on(BETAS)
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
    one, other = (body.posed(made.anchored(made.random_pose(number))) for number in (7, 8))
    before = animator.start(one)
    first = animator.step(before, other, 1 / 30)[1]
    animator.step(before, one, 1 / 30)
    np.testing.assert_array_equal(animator.step(before, other, 1 / 30)[1], first)


def test_a_player_shows_it(shapes):
    body, animator = on(BETAS), AnimatorRedressed(Swinging(), shapes)
    pose = made.anchored(made.random_pose(9))
    player = hemline.Player.prepare(animator, body)
    state = player.start(pose, pre_roll=0.1)
    _, frame = player.step(state, pose, 1 / 30)
    free = np.setdiff1d(np.arange(len(frame.vertices)), frame.report.pinched)
    assert not hemline.collide.inside(frame.body.vertices, frame.body.faces, frame.vertices[free]).any()
    assert animator.figures["error_mm"] == 1.0 and "shapes_anchors" in animator.figures


def test_bad_input(shapes, tmp_path):
    with pytest.raises(BadInput, match="got animator 'ropes'; fit one with 'hemline fit --animator agentdress'"):
        AnimatorRedressed(Swinging(), hemline.load("cape"))
    with pytest.raises(BadInput, match="must be of the same mesh on the same body; got 'cape' on anny24 and"):
        AnimatorRedressed(hemline.load("cape"), shapes)
    with pytest.raises(BadInput, match="two animators are saved one by one"):
        AnimatorRedressed(Swinging(), shapes).save(tmp_path / "both.safetensors")

"""Every animator, every law of the contract."""

import copy

import numpy as np
import pytest

from hemline.animators import (
    Animator,
    AnimatorKind,
    CloseFitting,
    Driven,
    Settled,
    Windy,
    animator_kind,
    animator_names,
)
from hemline.errors import BadInput
from hemline.playback import Player
from tests.contract.made_models import ANIMATORS, body, turned_about_the_vertical, vertical, walk

DT = 1 / 30


@pytest.fixture(params=sorted(ANIMATORS))
def animator(request) -> Animator:
    return ANIMATORS[request.param]()


def run(animator, poses, dt=DT, state=None):
    """All frames (frames, verts, 3) and the last State."""
    posed = [body().posed(pose) for pose in poses]
    state = animator.start(posed[0]) if state is None else state
    frames = []
    for each in posed:
        state, vertices = animator.step(state, each, dt)
        frames.append(vertices)
    return np.stack(frames), state


def test_every_shipped_animator_is_in_the_matrix():
    assert set(animator_names()) <= set(ANIMATORS)


def test_it_keeps_the_protocol(animator):
    assert isinstance(animator, Animator)
    assert animator.body_hash == body().body.hash
    frames, _ = run(animator, [walk()[0]])
    assert frames.dtype == np.float32
    assert frames.shape == (1, len(animator.garment.vertices), 3)


def test_its_kind_is_known_by_its_name_and_has_options_with_defaults(animator):
    kind = animator_kind(animator.name)
    assert isinstance(kind, AnimatorKind)
    assert kind.name == animator.name
    assert kind.Config() == kind.Config()


def test_the_same_input_gives_the_same_bits(animator):
    motion = walk()
    one, two = (run(animator, [motion[i] for i in range(len(motion))])[0] for _ in range(2))
    np.testing.assert_array_equal(one, two)


def test_an_old_state_is_a_rollback_and_a_copy_goes_the_same_way(animator):
    motion = walk()
    poses = [motion[i] for i in range(len(motion))]
    _, half = run(animator, poses[:20])
    kept = copy.deepcopy(half)
    straight, _ = run(animator, poses[20:], state=half)
    again, _ = run(animator, poses[20:], state=half)
    copied, _ = run(animator, poses[20:], state=kept)
    np.testing.assert_array_equal(straight, again)
    np.testing.assert_array_equal(straight, copied)


def test_the_world_turned_about_the_vertical_and_moved_turns_and_moves_the_garment(animator):
    motion, angle, shift = walk(), 2.0, np.array([3.0, 0.5, -2.0])
    poses = [motion[i] for i in range(len(motion))]
    here, _ = run(animator, poses)
    there, _ = run(animator, [turned_about_the_vertical(pose, angle, shift) for pose in poses])
    if animator.name == "live" or (animator.name == "lag" and animator.weights.config.beginning):
        # cloth that is simulated is chaotic: what the solver leaves doubles every few frames
        apart = np.linalg.norm(here @ vertical(angle).T + shift - there, axis=2).mean(axis=1)
        assert apart[0] < 5e-4 and apart[:10].max() < 2e-3 and apart.max() < 0.03
        return
    # poses are float32 at metres from the origin: 1e-7 relative, amplified by collisions over 40 frames
    np.testing.assert_allclose(here @ vertical(angle).T + shift, there, atol=2e-4)


@pytest.mark.parametrize("dt", [1 / 240, 1 / 120, 1 / 90, 1 / 60, 1 / 24, 0.1])
def test_any_step_is_taken(animator, dt):
    motion = walk()
    frames, _ = run(animator, [motion.at(i * dt) for i in range(12)], dt)
    assert np.isfinite(frames).all()
    reach = np.linalg.norm(frames - motion.translations[0], axis=2).max()
    assert reach < 4


def test_the_result_depends_little_on_the_step(animator):
    motion = walk(30)
    ends = []
    for rate in (30, 60, 120):
        steps = round(29 / 30 * rate)
        frames, _ = run(animator, [motion.at(i / rate) for i in range(steps + 1)], 1 / rate)
        ends.append(frames[-1])
    # a second of swinging; the cape moves by some 0.3 m in it
    assert np.linalg.norm(ends[0] - ends[2], axis=1).mean() < 0.03
    assert np.linalg.norm(ends[1] - ends[2], axis=1).mean() < 0.02


def test_another_body_is_refused(animator):
    from dataclasses import replace

    other = replace(body().body, template=body().body.template * np.float32(1.01))
    shaped = other.shaped()
    with pytest.raises(BadInput, match=r"was fitted on body anny24 .* use that body, or fit the garment again"):
        animator.start(shaped.posed(shaped.rest_pose))


def test_another_shape_of_the_body_is_dressed(animator):
    shaped = body().body.shaped([1.5, -1.0])
    posed = shaped.posed(shaped.rest_pose)
    _, vertices = animator.step(animator.start(posed), posed, DT)
    mean, _ = run(animator, [body().rest_pose])
    taller = vertices[:, 1].max() - mean[0, :, 1].max()
    assert np.isfinite(vertices).all()
    assert taller == pytest.approx(shaped.joints[12, 1] - body().joints[12, 1], abs=0.03)


def test_following_the_truth_needs_no_history(animator):
    if not isinstance(animator, Driven):
        pytest.skip(f"{animator.name} is not driven by ground truth")
    motion = walk(10)
    truth = run(animator, [motion[i] for i in range(10)])[0]
    state = animator.start(body().posed(motion[0]))
    posed = body().posed(motion[7])
    _, late = animator.follow(state, posed, DT, truth[7])
    _, again = animator.follow(animator.start(posed), posed, DT, truth[7])
    np.testing.assert_array_equal(late, again)


def test_wind_moves_the_garment_and_states_go_on_in_it(animator):
    if not isinstance(animator, Windy):
        pytest.skip(f"{animator.name} takes no wind")
    posed, ends = body().posed(body().rest_pose), []
    start = animator.start(posed)
    for each in (animator, animator.in_wind((0.0, 0.0, 6.0)), animator):
        state = start
        for _ in range(10):
            state, vertices = each.step(state, posed, DT)
        ends.append(vertices)
    assert (ends[1] - ends[0])[:, 2].mean() > 1e-3
    np.testing.assert_array_equal(ends[0], ends[2])


def test_garments_that_lie_close_are_not_drawn_together(animator):
    """A garment that lies close may be stretched by a body; all others are held in one piece."""
    player = Player.prepare(animator, body())
    close = isinstance(animator, CloseFitting) and animator.stretch_limit > 0
    assert (player.whole is None) == close
    assert not isinstance(animator, Settled) or close
    if isinstance(animator, CloseFitting):
        rest = animator.at_rest(animator.start(body().posed(body().rest_pose)), body())
        assert np.linalg.norm(rest - animator.garment.vertices, axis=1).mean() < 0.01
    assert player.cover is not None
    if isinstance(animator, Settled):
        posed = body().posed(walk(3)[2])
        assert animator.drape(posed).shape == animator.garment.vertices.shape


def test_save_and_load_give_the_same_bits(animator, tmp_path):
    from hemline.animators import load

    animator.save(tmp_path / "model.safetensors")
    back = load(tmp_path / "model.safetensors")
    back.save(tmp_path / "again.safetensors")
    assert (tmp_path / "model.safetensors").read_bytes() == (tmp_path / "again.safetensors").read_bytes()
    assert type(back) is type(animator)
    assert back.figures == animator.figures
    motion = walk()
    poses = [motion[i] for i in range(20)]
    np.testing.assert_array_equal(run(animator, poses)[0], run(back, poses)[0])

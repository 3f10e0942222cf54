"""What is played and at which frame, without a browser: the laws of a stage."""

import numpy as np
import pytest

from hemline import play
from hemline.animators import Windy
from hemline.animators.live import AnimatorLive, LiveConfig
from hemline.animators.ropes import AnimatorRopes
from hemline.errors import BadInput
from hemline.playback import Player
from hemline.view import BodyShift, PlayedClip, SimulatedClip, Stage
from hemline.view.stage import stage as stage_module
from tests.view.view_samples import FPS, body, clip, shirt, stage, take

BETAS = (1.5, -1.0, 0.5)


def test_what_is_shown_is_what_play_yields_to_the_bit():
    shown, played = stage(), list(play(shirt(), body(), clip(), fps=FPS))
    assert shown.count == len(played)
    for index, frame in enumerate(played):
        shown.go(index)
        shown.arrive()
        assert np.array_equal(shown.frame.vertices, frame.vertices)
        assert np.array_equal(shown.frame.animated, frame.animated)
        assert np.array_equal(shown.frame.body.vertices, frame.body.vertices)


def test_a_frame_does_not_depend_on_how_one_came_there():
    straight, about = stage(), stage()
    straight.go(9)
    straight.arrive()
    for index in (14, 3, 12, 9):
        about.go(index)
        about.arrive()
    assert about.index == 9 and np.array_equal(straight.frame.vertices, about.frame.vertices)


def test_one_move_makes_one_frame_and_going_back_none():
    shown = stage()
    shown.go(5)
    shown.move()
    assert (shown.index, shown.at_goal) == (1, False)
    shown.arrive()
    frame = shown.stored_frame(2)
    shown.go(2)
    shown.move()
    assert shown.at_goal and shown.frame is frame


def test_after_the_last_frame_comes_the_first():
    shown = stage()
    first = shown.frame.vertices
    shown.go(shown.count - 1)
    shown.arrive()
    shown.next()
    shown.move()
    assert shown.index == 0 and np.array_equal(shown.frame.vertices, first)


def test_frames_that_are_no_longer_kept_start_anew(monkeypatch):
    monkeypatch.setattr(stage_module, "STORED_FRAMES", 3)
    shown = stage()
    shown.go(8)
    shown.arrive()
    assert shown.stored_frames == range(6, 9)
    shown.go(2)
    shown.move()
    assert shown.index == 2 and shown.stored_frames == range(2, 3)


@pytest.mark.parametrize("index", [-1, 20])
def test_a_frame_that_the_clip_has_not_is_refused(index):
    with pytest.raises(BadInput, match="the clip has frames 0 to 19"):
        stage().go(index)


def test_the_shape_changes_at_once_under_a_settled_garment():
    """As a player does it: reshaped, then stepped into the same pose."""
    shown = stage()
    shown.go(6)
    shown.arrive()
    other = body().body.shaped(BETAS)
    shown.reshape(other)
    assert shown.index == 6
    player = Player.prepare(shirt(), body(), placed=True)
    motion, dt = body().placed(clip()).resample(FPS), 1 / FPS
    state = player.start(motion[0], dt=dt)
    for index in range(6):
        state, _ = player.step(state, motion[index], dt)
    player, state = player.reshape(state, other)
    _, frame = player.step(state, other.placed(clip()).resample(FPS)[6], dt)
    assert np.array_equal(shown.frame.vertices, frame.vertices)
    shown.go(0)
    shown.arrive()
    assert np.array_equal(shown.frame.body.vertices, stage(BETAS).frame.body.vertices)
    assert np.array_equal(shown.frame.animated, stage(BETAS).frame.animated), "as a player prepared on that body"


def test_a_body_that_is_dragged_goes_there_at_the_speed_of_a_body_and_the_cloth_with_it():
    shown = stage()
    before, cloth = shown.frame.body.joints[0].copy(), shown.frame.vertices.mean(axis=0)
    hand = BodyShift().drag_handle(before.astype(np.float64), before + [0.4, 0.0, 0.0], np.array([1.0, 0, 0, 0]))
    shown.drag(hand)
    shown.hold()
    assert 0.1 < np.linalg.norm(shown.frame.body.joints[0] - before) < 0.2 and shown.index == 0
    while shown.following_drag:
        shown.hold()
    assert np.allclose(shown.frame.body.joints[0], before + [0.4, 0, 0], atol=1e-5)
    assert np.allclose(shown.frame.vertices.mean(axis=0) - cloth, [0.4, 0, 0], atol=0.01)
    shown.go(3)
    shown.arrive()
    away = shown.frame.body.joints[0] - shown.source.motion.translations[3]
    assert np.allclose(away, [0.4, 0, 0], atol=1e-5), "the clip goes on from there"


def test_a_handle_that_is_turned_turns_the_body_about_it():
    quarter = np.array([np.sqrt(0.5), 0, np.sqrt(0.5), 0])
    pose = body().placed(clip())[0]
    here = pose.translation.astype(np.float64)
    turned = BodyShift().drag_handle(here, here, quarter).apply_to(pose)
    assert np.allclose(turned.translation, here, atol=1e-6)
    one, two = body().posed(pose), body().posed(turned)
    out = one.vertices - here
    assert np.allclose(two.vertices - here, np.stack([out[:, 2], out[:, 1], -out[:, 0]], axis=1), atol=1e-4)
    assert BodyShift().apply_to(pose) is pose


def test_wind_is_for_those_that_take_it():
    still = PlayedClip.on(shirt(), body(), clip(), fps=FPS)
    assert not isinstance(shirt(), Windy) and still.with_wind((1.0, 0.0, 0.0)) is still
    live = AnimatorLive(shirt().garment, np.zeros((4, 3), np.float32), "anny24", body().body.hash, LiveConfig())
    assert isinstance(live, Windy) and live.in_wind((0.0, 0.0, 2.0)).config.wind == (0.0, 0.0, 2.0)


def test_the_wind_of_ropes_moves_the_cape_from_the_next_frame_on():
    from hemline import animators

    cape = animators.load("cape")
    assert isinstance(cape, AnimatorRopes) and isinstance(cape, Windy)
    windy = cape.in_wind((3.0, 0.0, 0.0))
    assert isinstance(windy, AnimatorRopes) and windy.ropes.constants.wind == (3.0, 0.0, 0.0)
    assert cape.ropes.constants.wind == (0.0, 0.0, 0.0)


def test_a_take_is_shown_as_it_was_simulated_and_keeps_its_body():
    shown = Stage(SimulatedClip(take(), shirt().garment, body()))
    shown.go(2)
    shown.arrive()
    assert np.array_equal(shown.frame.vertices, take().vertices[2]) and shown.truth is None
    with pytest.raises(BadInput, match="the body's shape changes where a model plays"):
        shown.reshape(body())
    with pytest.raises(BadInput, match="wind changes where a model plays"):
        shown.blow((1.0, 0.0, 0.0))


def test_a_model_on_a_take_has_the_truth_beside_it():
    shown = Stage(PlayedClip.on(shirt(), body(), take().motion, fps=FPS, take=take()))
    assert shown.truth is not None and np.array_equal(shown.truth, take().vertices[0])
    with pytest.raises(BadInput, match="the body of a take keeps its shape"):
        shown.reshape(body())
    shown.drag(BodyShift(translation=np.array([0.1, 0.0, 0.0])))
    shown.hold()
    assert shown.truth is None, "a body that was dragged is not where it was simulated"

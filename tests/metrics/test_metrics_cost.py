"""Figures of time and memory, and flicker."""

import subprocess
import sys

import numpy as np
import pytest

from hemline.errors import BadInput, BadModel
from hemline.metrics import JERK_FRAMES, frame_ms, jerk_figures, jerk_m_s3, model_mb


def jerks(frames, fps):
    """The jerk at each frame that has three before it."""
    return [jerk_m_s3(frames[i : i + JERK_FRAMES], fps) for i in range(len(frames) - JERK_FRAMES + 1)]


def test_jerk_of_a_cubic_is_six():
    t = np.arange(12) / 24
    frames = np.zeros((12, 5, 3))
    frames[..., 0] = (t**3)[:, None]
    assert jerks(frames, 24) == pytest.approx([6] * 9, rel=1e-9)


def test_constant_acceleration_has_no_jerk():
    t = np.arange(10) / 30
    frames = (t**2)[:, None, None] * np.array([0, -9.81, 0]) + t[:, None, None] + np.ones((10, 4, 3))
    assert jerks(frames, 30) == pytest.approx([0] * 7, abs=1e-9)


def test_the_ratio_says_how_much_more_we_flicker():
    truth = np.random.default_rng(0).normal(size=(20, 30, 3)).astype(np.float32)
    ours, theirs = jerks(3 * truth, 30), jerks(truth, 30)
    figures = jerk_figures(list(zip(ours, theirs, strict=True)))
    assert figures["ratio"] == pytest.approx(3, rel=1e-5)
    assert (figures["mean"], figures["truth"]) == pytest.approx((np.mean(ours), np.mean(theirs)))
    assert jerk_figures([(1.0, 0.0)])["ratio"] is None


def test_jerk_needs_four_frames():
    with pytest.raises(BadInput, match="jerk needs four frames in a row; got 3"):
        jerk_m_s3(np.zeros((3, 2, 3)), 30)
    with pytest.raises(BadInput, match="jerk needs at least four frames; got fewer"):
        jerk_figures([])


def test_frame_ms_adds_the_stages_of_each_frame():
    frames = [{"skin": 1.0, "ropes": 2.0}, {"skin": 1.0, "ropes": 4.0}, {"skin": 3.0, "ropes": 10.0}]
    figures = frame_ms(frames)
    assert (figures["median"], figures["worst"], figures["stages"]) == (5.0, 13.0, {"skin": 1.0, "ropes": 4.0})
    assert figures["p95"] == pytest.approx(np.percentile([3, 5, 13], 95))


def test_a_stage_that_ran_in_some_frames_only_took_no_time_in_the_others():
    assert frame_ms([{"skin": 1.0}, {"skin": 1.0}, {"skin": 1.0, "repair": 9.0}])["stages"] == {
        "skin": 1.0,
        "repair": 0.0,
    }


def test_frame_ms_needs_a_frame():
    with pytest.raises(BadInput, match="no frame was timed"):
        frame_ms([])


def test_model_mb_is_the_size_of_the_file(tmp_path):
    (tmp_path / "model").write_bytes(bytes(2_500_000))
    assert model_mb(tmp_path / "model") == 2.5
    with pytest.raises(BadModel, match="cannot read .*none"):
        model_mb(tmp_path / "none")


HELD = """
import numpy as np
from hemline.metrics import memory_mb

before = memory_mb()
held = np.ones(int((before or 0.0) + 100) * 125_000)  # more than the peak so far
print(before or 0.0, memory_mb() or 0.0, held[-1])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not say")
def test_memory_grows_with_what_is_held():
    """In a process of its own: the peak of one that has run many tests is gigabytes, and so would be what is held."""
    done = subprocess.run([sys.executable, "-c", HELD], capture_output=True, text=True, check=True)
    before, after, last = map(float, done.stdout.split())
    assert after > before + 50
    assert last == 1

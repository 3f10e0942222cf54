"""Cameras: closed forms of projection, and that what must be seen is seen."""

import numpy as np
import pytest

from hemline.errors import BadInput
from hemline.pictures import VIEWS_DEG, Camera, frame_clip, frame_points

SIZES = [(640, 640), (300, 500), (800, 200)]


def test_projection_of_known_points():
    camera = Camera((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), field_of_view=2 * np.arctan(0.5))
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    expected = [[50, 50, 2], [100, 50, 2], [50, 0, 2], [50, 50, 1]]
    np.testing.assert_allclose(camera.project(points, (100, 100)), expected, atol=1e-12)


def test_axes_are_a_right_handed_frame_even_straight_down():
    for eye in [(1.0, 2.0, 3.0), (0.0, 5.0, 0.0)]:
        axes = Camera(eye, (0.0, 0.0, 0.0)).axes
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("view", VIEWS_DEG)
def test_all_points_are_seen_and_one_pair_touches_the_margin(view, size):
    points = np.random.default_rng(3).normal(size=(200, 3)) * [0.4, 0.9, 0.3] + [5, 1, -2]
    seen = frame_points(points, view, size=size, margin=0.1).project(points, size)
    share = seen[:, :2] / size
    assert seen[:, 2].min() > 0
    assert share.min() > 0.1 - 1e-9
    assert share.max() < 0.9 + 1e-9
    touched = np.minimum(share.min(axis=0) - 0.1, 0.9 - share.max(axis=0))
    assert touched.min() < 1e-9


def test_front_looks_against_z_and_side_against_x():
    points = np.eye(3)
    assert frame_points(points, "front").axes[2] @ [0, 0, 1] > 0.98
    assert frame_points(points, "back").axes[2] @ [0, 0, -1] > 0.98
    assert frame_points(points, "side").axes[2] @ [1, 0, 0] > 0.98


def test_a_following_camera_keeps_its_direction_and_sees_all():
    rng = np.random.default_rng(1)
    path = np.stack([0.1 * np.arange(60), 0.2 * np.sin(np.arange(60)), np.zeros(60)], axis=1)
    frames = rng.normal(size=(1, 50, 3)) * 0.4 + path[:, None]
    cameras = frame_clip(frames, "side", size=(320, 240), fps=30)
    assert len(cameras) == 60
    for camera, points in zip(cameras, frames, strict=True):
        np.testing.assert_allclose(camera.axes, cameras[0].axes, atol=1e-12)
        share = camera.project(points, (320, 240))[:, :2] / (320, 240)
        assert share.min() > 0.05
        assert share.max() < 0.95
    steps = np.diff([camera.eye for camera in cameras], axis=0)
    np.testing.assert_allclose(steps, np.tile([[0.1, 0, 0]], (59, 1)), atol=1e-9)


def test_a_still_camera_sees_the_whole_clip():
    frames = np.random.default_rng(2).normal(size=(5, 20, 3)) + 3 * np.arange(5)[:, None, None]
    cameras = frame_clip(frames, "front", follow=False)
    assert len(set(cameras)) == 1
    share = cameras[0].project(frames.reshape(-1, 3), (640, 640))[:, :2] / 640
    assert share.min() > 0.05
    assert share.max() < 0.95


def test_refusals():
    with pytest.raises(BadInput, match="no such view; got 'top'; choose one of front"):
        frame_points(np.eye(3), "top")
    with pytest.raises(BadInput, match="nothing to look at; got no finite point"):
        frame_points(np.full((2, 3), np.nan))
    with pytest.raises(BadInput, match="a clip without frames"):
        frame_clip(np.zeros((0, 4, 3)))

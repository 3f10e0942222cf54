"""The body as rounded cones: how well it covers the skin, and that it moves with the joints."""

import numpy as np
import pytest

from hemline import bodies
from hemline.collide.primitives.distances import round_cone_shape
from hemline.collide.primitives.proxy import BodyProxy
from hemline.errors import BadModel

REST = np.tile(np.eye(4)[:3], (24, 1, 1))


@pytest.mark.parametrize("betas", [(), (1.5, -1.0, 0.5), (-2.0, 1.5)])
def test_cones_cover_the_skin_of_any_shape(betas):
    shaped = bodies.load("anny24").shaped(betas)
    proxy = BodyProxy.fit(shaped)
    assert 20 <= len(proxy.kinds) <= 30
    distances, _ = proxy.distances(shaped.vertices, REST)
    assert (np.abs(distances) <= 0.01).mean() > 0.7
    assert (np.abs(distances) <= 0.02).mean() > 0.93
    assert abs(distances.mean()) < 0.004
    assert np.percentile(distances, [1, 99]) == pytest.approx([0, 0], abs=0.035)


def test_no_cone_reaches_far_from_the_body():
    shaped = bodies.load("anny24").shaped()
    proxy = BodyProxy.fit(shaped)
    low, high = shaped.vertices.min(0) - 0.03, shaped.vertices.max(0) + 0.03
    for ends in (proxy.shapes[:, :3], proxy.shapes[:, 3:6]):
        assert (ends > low).all() and (ends < high).all()


def test_both_sides_are_mirror_images_and_the_fit_is_repeatable():
    proxy = BodyProxy.fit(bodies.load("anny24").shaped())
    left = [k for k, name in enumerate(proxy.names) if name.startswith("left")]
    right = [proxy.names.index(proxy.names[k].replace("left", "right")) for k in left]
    np.testing.assert_array_equal(proxy.shapes[left][:, [0, 3]], -proxy.shapes[right][:, [0, 3]])
    np.testing.assert_array_equal(proxy.shapes[left][:, [1, 2, 6, 7]], proxy.shapes[right][:, [1, 2, 6, 7]])
    assert BodyProxy.fit(bodies.load("anny24").shaped()) is proxy


def test_distances_move_rigidly_with_the_frames():
    shaped = bodies.load("anny24").shaped()
    proxy = BodyProxy.fit(shaped)
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (200, 3))
    angle = 0.7
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    frames = np.concatenate([np.tile(turn, (24, 1, 1)), np.full((24, 3, 1), 2.0)], axis=2)
    still, nearest = proxy.distances(points, REST)
    moved, same = proxy.distances(points @ turn.T + 2.0, frames)
    np.testing.assert_allclose(moved, still, atol=1e-12)
    np.testing.assert_array_equal(nearest, same)


def test_balls_hold_their_primitives():
    made = BodyProxy.from_primitives(
        [
            (0, round_cone_shape(np.zeros(3), np.array([0.5, 0, 0]), 0.1, 0.2)),
            (1, round_cone_shape(np.ones(3), np.array([1, 1.3, 1.1]), 0.2, 0.1)),
        ],
        np.zeros((2, 3)),
    )
    points = np.random.default_rng(0).uniform(-1, 2, (20_000, 3))
    for k in range(2):
        only = BodyProxy(made.kinds[k : k + 1], made.joints[k : k + 1], made.shapes[k : k + 1], made.pivots)
        inside = only.distances(points, REST)[0] < 0
        away = np.linalg.norm(points[inside] - made.centres[k, :3], axis=1)
        assert inside.any() and away.max() <= made.centres[k, 3]


def test_arrays_and_back():
    proxy = BodyProxy.fit(bodies.load("anny24").shaped())
    again = BodyProxy.of(proxy.arrays(), {"proxy_names": list(proxy.names)})
    assert again.names == proxy.names
    for name in ("kinds", "joints", "shapes", "pivots", "centres"):
        np.testing.assert_array_equal(getattr(again, name), getattr(proxy, name))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"proxy_kinds": None}, "all its arrays"),
        ({"proxy_shapes": np.zeros((3, 16))}, "do not fit together"),
        ({"proxy_kinds": np.ones(26, np.int32)}, "do not fit together"),
        ({"proxy_joints": np.full(26, 99, np.int32)}, "do not fit together"),
        ({"proxy_pivots": np.full((24, 3), np.nan)}, "cannot be used"),
    ],
)
def test_damaged_arrays_are_refused(change, match):
    arrays = BodyProxy.fit(bodies.load("anny24").shaped()).arrays() | change
    with pytest.raises(BadModel, match=match):
        BodyProxy.of({name: array for name, array in arrays.items() if array is not None}, {})

"""The body as rounded cones: how well it covers the skin, and that it moves with the joints."""

import numpy as np
import pytest

from hemline import bodies
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.collide.primitives.distances import round_cone_shape
from hemline.errors import BadModel

REST = np.tile(np.eye(4)[:3], (24, 1, 1))


@pytest.mark.parametrize("betas", [(), (1.5, -1.0, 0.5), (-2.0, 1.5)])
def test_cones_cover_the_skin_of_any_shape(betas):
    shaped = bodies.load("anny24").shaped(betas)
    primitives = BodyPrimitives.fit(shaped)
    assert 20 <= len(primitives.kinds) <= 30
    distances, _ = primitives.distances(shaped.vertices, REST)
    assert (np.abs(distances) <= 0.01).mean() > 0.7
    assert (np.abs(distances) <= 0.02).mean() > 0.93
    assert abs(distances.mean()) < 0.004
    assert np.percentile(distances, [1, 99]) == pytest.approx([0, 0], abs=0.035)


def test_no_cone_reaches_far_from_the_body():
    shaped = bodies.load("anny24").shaped()
    primitives = BodyPrimitives.fit(shaped)
    low, high = shaped.vertices.min(0) - 0.03, shaped.vertices.max(0) + 0.03
    for ends in (primitives.shapes[:, :3], primitives.shapes[:, 3:6]):
        assert (ends > low).all() and (ends < high).all()


def test_both_sides_are_mirror_images_and_the_fit_is_repeatable():
    primitives = BodyPrimitives.fit(bodies.load("anny24").shaped())
    left = [k for k, name in enumerate(primitives.names) if name.startswith("left")]
    right = [primitives.names.index(primitives.names[k].replace("left", "right")) for k in left]
    np.testing.assert_array_equal(primitives.shapes[left][:, [0, 3]], -primitives.shapes[right][:, [0, 3]])
    np.testing.assert_array_equal(primitives.shapes[left][:, [1, 2, 6, 7]], primitives.shapes[right][:, [1, 2, 6, 7]])
    assert BodyPrimitives.fit(bodies.load("anny24").shaped()) is primitives


def test_distances_move_rigidly_with_the_frames():
    shaped = bodies.load("anny24").shaped()
    primitives = BodyPrimitives.fit(shaped)
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (200, 3))
    angle = 0.7
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    frames = np.concatenate([np.tile(turn, (24, 1, 1)), np.full((24, 3, 1), 2.0)], axis=2)
    still, nearest = primitives.distances(points, REST)
    moved, same = primitives.distances(points @ turn.T + 2.0, frames)
    np.testing.assert_allclose(moved, still, atol=1e-12)
    np.testing.assert_array_equal(nearest, same)


def test_balls_hold_their_primitives():
    made = BodyPrimitives.from_primitives(
        [
            (0, round_cone_shape(np.zeros(3), np.array([0.5, 0, 0]), 0.1, 0.2)),
            (1, round_cone_shape(np.ones(3), np.array([1, 1.3, 1.1]), 0.2, 0.1)),
        ],
        np.zeros((2, 3)),
    )
    points = np.random.default_rng(0).uniform(-1, 2, (20_000, 3))
    for k in range(2):
        only = BodyPrimitives(made.kinds[k : k + 1], made.joints[k : k + 1], made.shapes[k : k + 1], made.pivots)
        inside = only.distances(points, REST)[0] < 0
        away = np.linalg.norm(points[inside] - made.centres[k, :3], axis=1)
        assert inside.any() and away.max() <= made.centres[k, 3]


def test_arrays_and_back():
    primitives = BodyPrimitives.fit(bodies.load("anny24").shaped())
    again = BodyPrimitives.of(primitives.arrays(), {"proxy_names": list(primitives.names)})
    assert again.names == primitives.names
    for name in ("kinds", "joints", "shapes", "pivots", "centres"):
        np.testing.assert_array_equal(getattr(again, name), getattr(primitives, name))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"proxy_kinds": None}, "all their arrays"),
        ({"proxy_shapes": np.zeros((3, 16))}, "do not match"),
        ({"proxy_kinds": np.ones(26, np.int32)}, "do not match"),
        ({"proxy_joints": np.full(26, 99, np.int32)}, "do not match"),
        ({"proxy_pivots": np.full((24, 3), np.nan)}, "cannot be used"),
    ],
)
def test_damaged_arrays_are_refused(change, match):
    arrays = BodyPrimitives.fit(bodies.load("anny24").shaped()).arrays() | change
    with pytest.raises(BadModel, match=match):
        BodyPrimitives.of({name: array for name, array in arrays.items() if array is not None}, {})

"""The collision term: closed forms on a ball."""

import numpy as np

from hemline.animators.ropes.collision import pushed_out

CENTRE, RADIUS = np.array([0.0, 0.0, 0.0]), 0.5


def ball(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points - CENTRE, axis=-1) - RADIUS


def pushed(points, truth, expansion=0.01):
    points, truth = np.array(points, float), np.array(truth, float)
    return pushed_out(points, truth, ball(points), ball(truth), expansion)


def test_radially_the_step_ends_on_the_expanded_surface():
    # truth straight outward: one iteration is exact
    np.testing.assert_allclose(pushed([[0.4, 0, 0]], [[0.7, 0, 0]]), [[0.51, 0, 0]], atol=1e-12)


def test_towards_the_truth_and_not_along_the_gradient():
    # the gradient points to -x here, the truth lies to +x
    target = pushed([[-0.1, 0, 0]], [[0.6, 0, 0]])
    np.testing.assert_allclose(target, [[-0.1 + 0.41, 0, 0]], atol=1e-12)


def test_it_never_goes_beyond_the_truth():
    # slanted: the distance still missing is longer than the way to the truth
    truth = [[0.0, 0.52, 0.0]]
    np.testing.assert_allclose(pushed([[0.0, 0.5, 0.0]], truth, expansion=0.019), [[0.0, 0.519, 0.0]], atol=1e-12)
    near = pushed([[0.3, 0.4, 0.0]], [[0.3, 0.43, 0.0]], expansion=0.02)
    assert near[0, 1] <= 0.43


def test_points_outside_and_points_whose_truth_is_inside_stay():
    points = [[0.6, 0, 0], [0.4, 0, 0], [0.4, 0, 0]]
    truth = [[0.9, 0, 0], [0.505, 0, 0], [0.4, 0, 0]]
    np.testing.assert_array_equal(pushed(points, truth), points)

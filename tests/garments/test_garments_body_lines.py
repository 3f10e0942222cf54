"""Lines that garments hang from."""

import numpy as np
import pytest

from hemline.garments.cut.body_lines import fit_to_skin, interpolate_along, lengths
from hemline.meshes import ClosestTree


def test_points_are_spread_evenly_along_a_bent_line():
    line = np.array([[0, 0, 0], [1, 0, 0], [1, 3, 0]], float)
    even = interpolate_along(line, line, np.linspace(0, 1, 9))
    np.testing.assert_allclose(np.linalg.norm(np.diff(even, axis=0), axis=1), 0.5)
    assert lengths(np.stack([line, 2 * line])).tolist() == [4, 8]


@pytest.mark.parametrize(("start", "height"), [(-0.2, 0.004), (0.004, 0.004), (0.008, 0.008), (0.3, 0.01)])
def test_a_line_lies_above_a_plane_at_its_height_or_a_little_higher(start, height):
    """A line that starts beneath is lifted to 4 mm, one far above comes down to 2.5 times that."""
    corners = np.array([[-5, 0, -5], [-5, 0, 5], [5, 0, 5], [5, 0, -5]], float)
    floor = ClosestTree(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    line = np.stack([np.linspace(0, 1, 20), np.full(20, start), np.zeros(20)], axis=1)
    laid = fit_to_skin(line, floor, 0.004, lambda points: points)
    np.testing.assert_allclose(laid[:, 1], height, atol=1e-12)
    np.testing.assert_allclose(laid[:, [0, 2]], line[:, [0, 2]], atol=1e-12)

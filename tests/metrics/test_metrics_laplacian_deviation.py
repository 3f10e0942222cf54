"""The local consistency of a corrected mesh: closed forms of the half-cotangent Laplacian."""

import numpy as np
import pytest

from hemline.metrics import laplacian_deviation


def fan(height: float = 0.0):
    """Six equilateral triangles around a vertex, which is lifted."""
    angles = np.arange(6) * np.pi / 3
    rim = np.stack([np.cos(angles), np.zeros(6), np.sin(angles)], 1)
    faces = np.array([[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)], np.int32)
    return np.concatenate([[[0, height, 0]], rim]), faces


def test_the_middle_of_a_flat_fan_has_six_times_the_cotangent_of_sixty_degrees():
    """12 angles opposite to its edges, halved: 6 / sqrt(3); lifted by h the rim's have cot 1 / sqrt(3 + 4 h^2)."""
    (flat, faces), (lifted, _) = fan(), fan(0.5)
    found = laplacian_deviation(flat, lifted, faces, np.arange(7) == 0)
    assert found == pytest.approx(6 / np.sqrt(3) - 6 / np.sqrt(3 + 4 * 0.25), rel=1e-9)


def test_it_is_zero_for_rigid_motion_and_scale_and_is_a_mean_over_what_moved():
    flat, faces = fan(0.2)
    turned = 3 * flat[:, [2, 0, 1]] + 1.0
    assert laplacian_deviation(flat, turned, faces, np.ones(7, bool)) == pytest.approx(0, abs=1e-12)
    lifted, _ = fan(0.6)
    one = [laplacian_deviation(flat, lifted, faces, np.arange(7) == i) for i in range(7)]
    assert laplacian_deviation(flat, lifted, faces, np.arange(7) < 3) == pytest.approx(np.mean(one[:3]))


def test_where_nothing_moved_there_is_no_figure_and_a_collapsed_triangle_gives_a_finite_one():
    flat, faces = fan()
    assert np.isnan(laplacian_deviation(flat, flat, faces, np.zeros(7, bool)))
    collapsed = flat.copy()
    collapsed[1] = collapsed[2]
    assert np.isfinite(laplacian_deviation(flat, collapsed, faces, np.ones(7, bool)))

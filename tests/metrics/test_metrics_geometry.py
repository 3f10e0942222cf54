"""Figures of shape: closed forms."""

import numpy as np
import pytest
import trimesh

from hemline.metrics import (
    area_change_percent,
    behind_nearest_percent,
    deepest_mm,
    edge_strain,
    edge_strains,
    inside_figures,
    inside_percent,
    mean_and_worst,
    neighbouring_faces,
    normal_error_deg,
    normal_errors_deg,
    pinched_percent,
    resolved_percent,
    ripple_deg,
    ripple_figures,
    stretch_figures,
    stretch_percent,
    vertex_error_mm,
    vertex_errors_mm,
)

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
TWO = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
REST = np.array([[[1, 1], [0, 1]], [[1, 0], [1, 1]]], np.float64)  # columns: 0->1, 0->2 and 0->2, 0->3


def ball():
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    return np.array(mesh.vertices, np.float32), np.array(mesh.faces, np.int32)


def test_vertex_error_of_known_shifts():
    truth = np.zeros((2, 10, 3), np.float32)
    ours = truth.copy()
    ours[0, :, 1] = 0.003
    ours[1, 0] = [0.03, 0.04, 0.0]
    figures = vertex_error_mm(np.stack([vertex_errors_mm(*pair) for pair in zip(ours, truth, strict=True)]))
    assert figures["mean"] == pytest.approx((10 * 3 + 50) / 20, rel=1e-5)
    assert figures["max"] == pytest.approx(50, rel=1e-5)
    assert figures["p95"] == pytest.approx(np.percentile([3] * 10 + [50] + [0] * 9, 95), rel=1e-5)


def test_vertex_error_is_unchanged_by_a_common_motion():
    rng = np.random.default_rng(0)
    ours, truth = rng.normal(size=(2, 20, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    before, after = vertex_errors_mm(ours, truth), vertex_errors_mm(ours @ turn.T + 5, truth @ turn.T + 5)
    assert vertex_error_mm(before) == pytest.approx(vertex_error_mm(after))


@pytest.mark.parametrize("degrees", [0.0, 1e-4, 30.0, 90.0, 179.0])
def test_normal_error_of_a_turned_square(degrees):
    angle = np.radians(degrees)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    figures = normal_error_deg(normal_errors_deg(SQUARE.astype(np.float64) @ turn.T, SQUARE, TWO))
    assert figures["mean"] == pytest.approx(degrees, abs=1e-6)
    assert figures["p95"] == pytest.approx(degrees, abs=1e-6)


def test_normal_error_leaves_out_triangles_without_area():
    flat = SQUARE.copy()
    flat[3] = 0.5
    flat[3, 2] = 0  # the second triangle has no area
    errors = normal_errors_deg(flat, SQUARE, TWO)
    assert np.isnan(errors).tolist() == [False, True]
    assert normal_error_deg(errors)["mean"] == pytest.approx(0, abs=1e-6)
    assert np.isnan(normal_error_deg(normal_errors_deg(SQUARE * 0, SQUARE, TWO))["mean"])


def test_inside_percent_leaves_pinched_vertices_out():
    inside = np.arange(10) < 3
    assert inside_percent(inside) == 30.0
    assert inside_percent(inside, np.array([0, 7, 8, 9])) == 20.0  # three of the pinched are outside
    assert pinched_percent(np.array([0, 7, 8, 9]), 10) == 40.0


def test_inside_figures_of_two_frames():
    figures = inside_figures(before=[10.0, 30.0], after=[0.0, 4.0], pinched=[1.0, 0.0])
    assert figures == {"before": 20.0, "after": 2.0, "worst_frame_after": 4.0, "pinched": 0.5}


def test_behind_nearest_percent_of_shells_around_a_ball():
    body, faces = ball()
    assert [behind_nearest_percent(body * size, body, faces) for size in (1.1, 0.9)] == [0.0, 100.0]


def test_deepest_in_a_ball():
    body, faces = ball()
    points = np.array([[0, 0.7, 0], [0, 0, 1.2], [0.95, 0, 0]], np.float32)
    inside = np.array([True, False, True])
    assert deepest_mm(body, faces, points, inside) == pytest.approx(300, abs=5)
    assert deepest_mm(body, faces, points, np.zeros(3, bool)) == 0.0


def test_strain_of_a_stretched_square():
    np.testing.assert_allclose(edge_strains(SQUARE, TWO, REST), 0, atol=1e-7)
    stretched = SQUARE * np.array([1.2, 0.5, 1], np.float32)
    diagonal = np.hypot(1.2, 0.5) / np.sqrt(2) - 1
    expected = [[0.2, -0.5, diagonal], [diagonal, 0.2, -0.5]]  # edges 01 12 20; 02 23 30
    np.testing.assert_allclose(edge_strains(stretched[None], TWO, REST)[0], expected, atol=1e-6)
    figures = edge_strain(edge_strains(stretched, TWO, REST))
    assert figures["max"] == pytest.approx(0.5, abs=1e-6)
    assert figures["p50"] == pytest.approx(np.median(np.abs(expected)), abs=1e-6)


def test_strain_knows_neither_place_nor_turn():
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    np.testing.assert_allclose(edge_strains(SQUARE @ turn.T + 3, TWO, REST), 0, atol=1e-12)


def test_area_change_of_scaled_squares():
    changes = [area_change_percent(SQUARE * size, TWO, REST) for size in (1.0, 1.1, 0.5)]
    assert changes == pytest.approx([0, 21, -75], abs=1e-3)
    figures = mean_and_worst(changes)
    assert figures["mean"] == pytest.approx((0 + 21 - 75) / 3, abs=1e-3)
    assert figures["worst_frame"] == pytest.approx(-75, abs=1e-3)


def test_stretch_counts_what_is_too_long_and_nothing_that_is_short():
    vertices = np.array([[0, 0, 0], [1.2, 0, 0], [0, 0.5, 0], [0, 0, 1.5]])
    edges, lengths = np.array([[0, 1], [0, 2], [0, 3]]), np.ones(3)
    p99, long = stretch_percent(vertices, edges, lengths)
    assert p99 == pytest.approx(np.percentile([20, 0, 50], 99))
    assert long == pytest.approx(100 / 3)
    figures = stretch_figures([(p99, long), (10.0, 0.0)])
    assert figures == {"p99_mean": (p99 + 10) / 2, "p99_worst": p99, "long": long / 2}


def test_resolved_counts_vertices_that_moved_more_than_a_millimetre():
    before = np.zeros((4, 3), np.float32)
    after = before + np.array([[0, 0, 0], [0.0009, 0, 0], [0.0011, 0, 0], [0, 0.5, 0]], np.float32)
    assert resolved_percent(before, after) == 50


@pytest.mark.parametrize("sides", [12, 40])
def test_ripples_of_a_prism_are_the_angle_between_its_sides(sides):
    """Two triangles a side: half of the inner edges are flat, the others bend by a turn over the sides."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    vertices, here = np.concatenate([ring, ring + [0, 1, 0]]), np.arange(sides)
    there = (here + 1) % sides
    faces = np.concatenate(
        [np.stack([here, here + sides, there], 1), np.stack([there, here + sides, there + sides], 1)]
    )
    pairs = neighbouring_faces(faces)
    assert len(pairs) == 2 * sides
    assert ripple_deg(vertices, faces, pairs) == pytest.approx(180 / sides)
    assert ripple_figures([(2.0, None), (4.0, None)]) == {"mean": 3.0, "truth": None}

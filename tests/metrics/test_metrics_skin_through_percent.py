"""Skin that looks out through cloth."""

import numpy as np
import pytest

from hemline.metrics import skin_through_percent, skin_under_cloth


def sheet(count: int = 11) -> tuple[np.ndarray, np.ndarray]:
    """A square of 20 cm in the plane z = 0, facing +z."""
    x, y = np.meshgrid(np.linspace(0, 0.2, count), np.linspace(0, 0.2, count))
    vertices = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).reshape(-1)
    one = np.stack([corner, corner + 1, corner + count], axis=1)
    two = np.stack([corner + 1, corner + count + 1, corner + count], axis=1)
    return vertices, np.concatenate([one, two]).astype(np.int32)


def skin(heights) -> tuple[np.ndarray, np.ndarray]:
    """Points at these heights below the middle of the sheet, facing +z."""
    points = np.column_stack([np.linspace(0.05, 0.15, len(heights)), np.full(len(heights), 0.093), heights])
    return points.astype(np.float32), np.tile(np.float32([0, 0, 1]), (len(heights), 1))


def test_skin_just_behind_the_cloth_is_covered():
    vertices, faces = sheet()
    points, normals = skin([-0.001, -0.015, -0.025, 0.001])
    assert skin_under_cloth(vertices, faces, points, normals).tolist() == [0, 1]
    # what faces away is the other side of an arm, and what is nearest to the rim lies beside
    assert len(skin_under_cloth(vertices, faces, points, -normals)) == 0
    beside = points - np.float32([0.3, 0, 0])
    assert len(skin_under_cloth(vertices, faces, beside, normals)) == 0


@pytest.mark.parametrize(
    ("heights", "share"), [([-0.002, -0.001], 0), ([0.001, -0.001], 50), ([0.0003, 0.002], 50), ([0.03, 0.01], 50)]
)
def test_what_is_in_front_counts_from_half_a_millimetre_to_two_centimetres(heights, share):
    vertices, faces = sheet()
    points, normals = skin(heights)
    assert skin_through_percent(vertices, faces, points, normals, np.arange(2)) == share


def test_nothing_covered_is_nothing_through():
    vertices, faces = sheet()
    points, normals = skin([0.001])
    assert skin_through_percent(vertices, faces, points, normals, np.arange(0)) == 0
    assert skin_through_percent(vertices, faces, points, -normals, np.arange(1)) == 0


def test_skin_inside_another_part_of_the_body_does_not_count():
    vertices, faces = sheet()
    points, normals = skin([0.001, 0.002])
    every = vertices, faces, points, normals, np.arange(2)
    assert skin_through_percent(*every) == 100
    assert skin_through_percent(*every, np.array([True, False])) == 50
    assert skin_through_percent(*every, np.array([True, True])) == 0

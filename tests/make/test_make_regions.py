"""Where a garment hangs, measured on takes whose motion is known."""

import numpy as np
import pytest

from hemline import bodies
from hemline.datasets import Take
from hemline.make.regions import CLOSE_SWING, FREE_SWING, Regions, _skin_weights, vertex_areas
from hemline.motions import load

RUN = load("run")[:40]


@pytest.fixture(scope="module")
def body():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def patch(body):
    """Skin of the trunk, lifted by a centimetre, as a piece of cloth."""
    height = body.vertices[:, 1] - body.vertices[:, 1].min()
    over = (height > 1.0) & (height < 1.3) & (np.abs(body.vertices[:, 0]) < 0.15)
    numbers = np.cumsum(over) - 1
    faces = body.body.faces[over[body.body.faces].all(axis=1)]
    return (body.vertices + 0.01 * body.normals)[over].astype(np.float32), numbers[faces].astype(np.int32)


def take_of(patch, body, motion):
    """The patch skinned with the body, and moved by `motion` (frames, 3) in the frame of the body at rest."""
    rest, _ = patch
    indices, weights = _skin_weights(rest, body)
    frames = []
    for pose, offset in zip(RUN, motion, strict=True):
        blended = np.einsum("vk,vkij->vij", weights, np.asarray(body.posed(pose).transforms, np.float64)[indices])
        frames.append(np.einsum("vij,vj->vi", blended[:, :, :3], rest + offset) + blended[:, :, 3])
    zeros = np.zeros(len(RUN), bool)
    return Take(
        "clip", np.array(frames, np.float32), RUN, np.zeros(0, np.float32), zeros, zeros.astype(np.int32), {}, {}
    )


def test_cloth_that_follows_the_skin_does_not_hang(patch, body):
    regions = Regions.of(take_of(patch, body, np.zeros((len(RUN), 3))), *patch, body)
    assert regions.swing.max() < 1e-5
    assert regions.hanging_fraction == 0
    np.testing.assert_allclose(np.median(regions.clearance), 0.01, atol=0.003)


@pytest.mark.parametrize("amplitude", [0.02, 0.08, 0.2])
def test_the_swing_of_a_sine_is_its_root_mean_square(patch, body, amplitude):
    phase = 2 * np.pi * np.arange(len(RUN)) / len(RUN)
    up = amplitude * np.sin(phase) + 0.01  # a constant is no swing
    motion = np.stack([0 * up, up, 0 * up], axis=1)
    regions = Regions.of(take_of(patch, body, motion), *patch, body)
    np.testing.assert_allclose(regions.swing, amplitude / np.sqrt(2), rtol=1e-3)
    expected = np.clip((amplitude / np.sqrt(2) - CLOSE_SWING) / (FREE_SWING - CLOSE_SWING), 0, 1)
    np.testing.assert_allclose(regions.hanging_fraction, expected**2 * (3 - 2 * expected), rtol=2e-2)


def test_areas_of_vertices_add_up_to_the_area_of_the_mesh():
    square = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]], np.float32)
    areas = vertex_areas(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    np.testing.assert_allclose(areas, [2, 1, 2, 1])

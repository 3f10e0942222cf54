"""The frame of the key joint."""

import numpy as np

from hemline.learning.key_frame import to_key_frame


def test_it_undoes_the_motion_of_the_key_joint():
    random = np.random.default_rng(0)
    rotation = np.linalg.qr(random.normal(size=(3, 3)))[0]
    transform = np.concatenate([rotation, random.normal(size=(3, 1))], axis=1)
    points = random.normal(size=(20, 3))
    np.testing.assert_allclose(to_key_frame(transform, points @ rotation.T + transform[:, 3]), points, atol=1e-12)


def test_moving_along_with_the_key_joint_changes_nothing():
    random = np.random.default_rng(1)
    points, here = random.normal(size=(20, 3)), np.eye(3, 4)
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    there = np.concatenate([turn, [[3.0], [1], [2]]], axis=1)
    np.testing.assert_allclose(to_key_frame(there, points @ turn.T + [3, 1, 2]), to_key_frame(here, points), atol=1e-12)

"""Skin weights of a garment: near to those of the skin beneath it, and of all limbs that are about as near."""

from functools import cache

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.animators.agentdress.binding import Binding
from hemline.garments import Garment
from hemline.meshes import edge_strains
from hemline.motions import JOINT_NAMES
from tests.animators.formula_garment import t_pose

BODY = bodies.load("anny24").shaped()


@cache
def bound(name: str) -> tuple[Garment, Binding]:
    """A garment, and its binding in the T-pose."""
    garment, upright = garments.load(name), BODY.posed(t_pose())
    followed = Binding.of(garment.vertices, garment.faces, BODY.posed(BODY.rest_pose))
    return garment, Binding.of(followed.skin(upright.transforms, garment.vertices), garment.faces, upright)


def closest(binding: Binding) -> Binding:
    """The weights of the closest vertex of the skin alone."""
    weights = BODY.body.weights[binding.nearest]
    return Binding(BODY.body.weight_indices[binding.nearest], weights, binding.nearest)


@pytest.mark.parametrize("clip, frame", [("kick", 30), ("dance", 40)])
def test_a_skirt_between_the_legs_is_not_torn_by_skinning(clip, frame):
    garment, binding = bound("skirt-light")
    posed = BODY.posed(motions.load(clip).resample(30.0)[frame])

    def stretch(which: Binding) -> float:
        skinned = which.skin(posed.transforms, garment.vertices)
        return float(np.percentile(edge_strains(skinned, garment.faces, garment.rest_edges), 99))

    assert stretch(binding) < 0.5 * stretch(closest(binding))


def test_the_hem_of_a_skirt_follows_both_legs_and_its_sides_one():
    garment, binding = bound("skirt-light")
    left, right = (
        binding.dense_weights()[:, [JOINT_NAMES.index(f"{side}_{joint}") for joint in ("hip", "knee")]].sum(axis=1)
        for side in ("left", "right")
    )
    x, low = garment.vertices[:, 0], garment.vertices[:, 1] < np.percentile(garment.vertices[:, 1], 10)
    middle, side = low & (np.abs(x) < 0.05), low & (np.abs(x) > 0.9 * np.abs(x[low]).max())
    assert middle.sum() > 10 and side.sum() > 10
    assert np.minimum(left, right)[middle].min() > 0.2
    assert np.maximum(left, right)[side].min() > 3 * np.minimum(left, right)[side].max()


def test_close_cloth_has_the_weights_of_the_skin_beneath_it():
    garment, binding = bound("tshirt-light")
    near = np.linalg.norm(garment.vertices - BODY.vertices[binding.nearest], axis=1) < 0.01
    difference = np.abs(binding.dense_weights() - closest(binding).dense_weights()).sum(axis=1)
    assert near.sum() > 500 and np.median(difference[near]) < 0.1
    np.testing.assert_allclose(binding.weights.sum(axis=1), 1, atol=1e-6)

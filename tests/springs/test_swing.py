"""Spring bones as players of VRM swing them; three-vrm itself is asked in `tests/export/test_export_vrm.py`."""

from dataclasses import replace

import numpy as np
import pytest

from hemline.springs import CapsuleColliders, SkeletonMotion, SpringConstants, swing
from tests.springs.spring_samples import BONES, kicking, leg, ring, swing_plainly

LIMITED = SpringConstants(
    stiffness=(4.0, 0.2), gravity=0.8, drag=(0.2, 0.5), radius=0.02, inward=0.3, sideways=0.2, leg_radius=0.15
)
FREE = replace(LIMITED, inward=np.pi, sideways=np.pi)
NOTHING = CapsuleColliders(*(each[:0] for each in (leg().joints, leg().starts, leg().ends, leg().radii, leg().chains)))


@pytest.mark.parametrize("constants", [LIMITED, FREE], ids=["with limits", "without"])
def test_the_kernel_does_what_the_specification_says_in_words(constants):
    chains, capsules = constants.apply(ring(), leg(), [1])
    skeleton = kicking(50)
    moved, _ = swing(chains, capsules, skeleton)
    np.testing.assert_allclose(moved, swing_plainly(chains, capsules, skeleton, 1 / 60), atol=1e-9)
    rest = np.abs(moved[-1] - moved[0] - skeleton.joints[-1, 0]).max()
    assert rest > 0.05, "nothing swings in the sample"


def test_bones_keep_their_lengths_and_rotations_are_rotations():
    chains, capsules = LIMITED.apply(ring(), leg(), [1])
    moved, turns = swing(chains, capsules, kicking())
    lengths = np.linalg.norm(np.diff(moved, axis=1), axis=-1)
    within = np.arange(1, len(chains.bones)) % BONES != 0
    at_rest = np.linalg.norm(np.diff(chains.bones, axis=0), axis=-1)
    assert np.abs(lengths - at_rest)[:, within].max() < 1e-12
    assert np.abs(turns @ np.swapaxes(turns, -1, -2) - np.eye(3)).max() < 1e-9


def test_a_rotation_takes_a_bone_from_rest_to_where_it_is():
    chains, capsules = FREE.apply(ring(), leg(), [1])
    moved, turns = swing(chains, capsules, kicking())
    for span in chains.spans:
        ways = np.diff(chains.bones[list(span)], axis=0)
        turned = np.einsum("fbij,bj->fbi", turns[:, list(span)[:-1]], ways)
        assert np.abs(turned - np.diff(moved[:, list(span)], axis=1)).max() < 1e-9


def test_chains_that_nothing_pulls_stay_where_the_body_carries_them():
    chains = replace(ring(), drag=np.ones(len(ring().bones)), stiffness=np.full(len(ring().bones), 1.0))
    still = SkeletonMotion(np.zeros((2, 3)), np.zeros((40, 2, 3)), np.tile(np.eye(3), (40, 2, 1, 1)))
    moved, turns = swing(chains, NOTHING, still)
    np.testing.assert_allclose(moved, np.broadcast_to(chains.bones, moved.shape), atol=1e-12)
    np.testing.assert_allclose(turns, np.broadcast_to(np.eye(3), turns.shape), atol=1e-12)


def test_a_heavy_chain_hangs_straight_down():
    chains = replace(ring(), drag=np.full(len(ring().bones), 0.3), gravity=np.full(len(ring().bones), 1.0))
    still = SkeletonMotion(np.zeros((2, 3)), np.zeros((600, 2, 3)), np.tile(np.eye(3), (600, 2, 1, 1)))
    moved, _ = swing(chains, NOTHING, still)
    ways = np.diff(moved[-1].reshape(-1, BONES, 3), axis=1)
    assert np.abs(ways[..., [0, 2]]).max() < 1e-3 and ways[..., 1].max() < 0


def test_limits_hold_whatever_pushes():
    chains, capsules = LIMITED.apply(ring(), leg(), [1])
    moved, turns = swing(chains, capsules, kicking(angle=1.4))
    for number, span in enumerate(chains.spans):
        for bone in list(span)[1:]:
            way = chains.bones[bone] - chains.bones[bone - 1]
            above = turns[:, span[-1]] if bone - 1 == span[0] else turns[:, bone - 2]
            seen = np.einsum("fji,fj->fi", above, moved[:, bone] - moved[:, bone - 1]) / np.linalg.norm(way)
            out, down, along = chains.outward[number], np.array([0, -1.0, 0]), chains.frames[number][:, 0]
            inward = np.arctan2(way @ out, way @ down) - np.arctan2(seen @ out, seen @ down)
            assert inward.max() < LIMITED.inward + 1e-6
            assert np.abs(np.arcsin(seen @ along)).max() < LIMITED.sideways + 1e-6


def test_wide_legs_keep_cloth_in_front_that_narrow_legs_slip_through():
    """Half-way between two chains the leg comes through the cloth where it pushes both aside."""
    skeleton = kicking(angle=1.2)
    through = {}
    for width in (0.05, 0.3):
        chains, capsules = replace(FREE, leg_radius=width).apply(ring(), leg(), [1])
        moved, _ = swing(chains, capsules, skeleton)
        front = [chain for chain in range(len(chains.joints)) if chains.outward[chain][2] > 0.5]
        cloth = moved.reshape(len(moved), -1, BONES, 3)[:, front].mean(axis=1)
        foot = np.einsum("fij,j->fi", skeleton.turns[:, 1], [0, -0.3, 0]) + skeleton.joints[:, 1]
        raised = foot[:, 2] - skeleton.joints[:, 1, 2] > 0.15
        nearest = np.abs(cloth[raised, :, 1] - foot[raised, None, 1]).argmin(axis=1)
        through[width] = (foot[raised, 2] - cloth[raised, nearest, 2]).mean()
    assert through[0.3] < through[0.05] - 0.02

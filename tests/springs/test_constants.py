"""Constants of spring bones, in model files and along chains."""

from dataclasses import replace

import numpy as np
import pytest

from hemline.errors import BadModel
from hemline.springs import SpringConstants, distances_to_axes
from tests.springs.spring_samples import BONES, COUNT, leg, ring

GOOD = SpringConstants(
    stiffness=(4.0, 0.2), gravity=0.8, drag=(0.2, 0.5), radius=0.02, inward=0.3, sideways=0.2, leg_radius=0.15
)


def test_constants_run_from_root_to_tip():
    chains, _ = GOOD.apply(ring(), leg(), [1])
    along = chains.stiffness.reshape(COUNT, BONES)
    np.testing.assert_allclose(along[:, 0], 4.0)
    np.testing.assert_allclose(along[:, -1], 0.2)
    np.testing.assert_allclose(along[:, 2], np.sqrt(4.0 * 0.2))
    np.testing.assert_allclose(chains.drag.reshape(COUNT, BONES)[0], np.linspace(0.2, 0.5, BONES))


def test_the_side_of_a_leg_towards_its_chain_stays_where_it_is():
    chains, capsules = replace(GOOD, leg_radius=0.4).apply(ring(), leg(), [1])
    assert capsules.chains.tolist() == [-1, *range(COUNT)]
    middle = (leg().starts[0] + leg().ends[0]) / 2
    for chain in range(COUNT):
        surface = middle + leg().radii[0] * chains.outward[chain]
        away = distances_to_axes(surface[None], capsules.starts[1 + chain][None], capsules.ends[1 + chain][None])[0]
        assert away[0, 0] == pytest.approx(capsules.radii[1 + chain]) == pytest.approx(0.4)


def test_nothing_is_pushed_away_at_rest():
    """However wide the legs and large the distances asked: each bone has at rest the distance that it keeps."""
    chains, capsules = replace(GOOD, radius=0.2, leg_radius=2.0).apply(ring(), leg(), [1])
    of = np.repeat(np.arange(COUNT), BONES)
    away = distances_to_axes(chains.bones, capsules.starts, capsules.ends)[0] - capsules.radii - chains.radii[:, None]
    away[(capsules.chains >= 0) & (capsules.chains != of[:, None])] = np.inf
    assert away[chains.depths > 0].min() > -1e-12
    assert chains.radii[chains.depths > 0].min() > 0


def test_constants_come_back_from_a_model_file():
    assert SpringConstants.of(GOOD.metadata()) == GOOD


@pytest.mark.parametrize(
    "wrong",
    [
        {"drag": [0.2, 1.5]},
        {"drag": [0.5]},
        {"gravity": -1.0},
        {"radius": float("nan")},
        {"stiffness": "stiff"},
        {"inward": float("inf")},
    ],
    ids=str,
)
def test_constants_that_cannot_be_used_are_refused(wrong):
    with pytest.raises(BadModel, match="constants of the model's spring bones cannot be used"):
        SpringConstants.of(GOOD.metadata() | wrong)
    with pytest.raises(BadModel):
        SpringConstants.of({name: value for name, value in GOOD.metadata().items() if name not in wrong})

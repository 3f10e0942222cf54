"""The search for constants: it finds its way back to a motion that spring bones made."""

from dataclasses import replace

import numpy as np
import pytest

from hemline.springs import SKIN_EVERY, SpringComparison, SpringConstants, SpringTarget, search, swing, tune
from tests.springs.spring_samples import kicking, leg, pairs, ring

TRUE = SpringConstants(
    stiffness=(6.0, 0.1), gravity=1.5, drag=(0.3, 0.6), radius=0.02, inward=3.0, sideways=3.0, leg_radius=0.2
)
FAR = replace(TRUE, stiffness=(0.5, 2.0), gravity=0.3, drag=(0.8, 0.1), leg_radius=0.06)


@pytest.fixture(scope="module")
def target():
    chains, capsules = replace(TRUE, inward=np.pi, sideways=np.pi).apply(ring(), leg(), [1])
    skeleton = kicking(241)
    moved, _ = swing(chains, capsules, skeleton)
    bones = moved[120::2]
    middle = skeleton.joints[120::2, 1][::SKIN_EVERY]
    turns = skeleton.turns[120::2, 1][::SKIN_EVERY]
    around = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    normals = np.stack([np.cos(around), 0 * around, np.sin(around)], axis=1)
    points = 0.05 * normals - [0, 0.2, 0]
    skin = np.concatenate(
        [np.einsum("fij,pj->fpi", turns, points) + middle[:, None], np.einsum("fij,pj->fpi", turns, normals)], axis=2
    )
    return SpringTarget(skeleton, bones, skin)


def test_a_motion_is_judged_as_itself_and_another_as_far(target):
    comparison = SpringComparison(ring(), leg(), [1], [target], pairs())
    assert comparison(replace(TRUE, inward=np.pi, sideways=np.pi))[0] < 1e-9
    assert comparison(FAR)[0] > 10


def test_skin_that_is_put_in_front_of_the_cloth_is_counted(target):
    comparison = SpringComparison(ring(), leg(), [1], [target], pairs())
    exact = replace(TRUE, inward=np.pi, sideways=np.pi)
    assert comparison(exact)[1] == 0
    comparison.targets = [target._replace(skin=target.skin + [0, 0, 0.3, 0, 0, 0])]
    assert comparison(exact)[1] > 20


def test_a_garment_that_should_keep_its_drape_hangs_nearer_to_it(target, monkeypatch):
    monkeypatch.setattr(search, "ROUNDS", 60)
    monkeypatch.setattr(search, "LIMIT_ROUNDS", 4)
    comparison, sags = SpringComparison(ring(), leg(), [1], [target], pairs()), []
    for weight in (0.0, 20.0):
        monkeypatch.setattr(search, "SAG_WEIGHT", weight)
        found, _ = tune(ring(), leg(), [1], [target], pairs(), TRUE)
        sags.append(comparison.sag_mm(found))
    assert sags[1] < sags[0] / 2


def test_the_search_finds_the_motion_again(target, monkeypatch):
    """The motion alone counts: the chains that made it hang away from their drape when they stand still."""
    monkeypatch.setattr(search, "SAG_WEIGHT", 0.0)
    monkeypatch.setattr(search, "ROUNDS", 120)
    monkeypatch.setattr(search, "LIMIT_ROUNDS", 6)
    seen = []
    comparison = SpringComparison(ring(), leg(), [1], [target], pairs())
    found, figures = tune(ring(), leg(), [1], [target], pairs(), FAR, lambda done, count: seen.append((done, count)))
    before = comparison(replace(FAR, inward=np.pi, sideways=np.pi))
    after = comparison(replace(found, inward=np.pi, sideways=np.pi))
    assert after[0] < before[0] / 3
    assert figures["springs_error_mm"] == pytest.approx(after[0])
    assert seen[-1][0] <= seen[-1][1] == 126

"""The same garment of fewer vertices."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import BadInput
from hemline.garments import Pins, coarser_garment, wear_together
from hemline.meshes import edges


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def cape(shaped):
    return garments.make_cape(shaped, rows=25, columns=40)


def areas(garment):
    return np.linalg.det(garment.rest_edges) / 2


def test_cut_and_weight_stay(cape):
    half, kept = coarser_garment(cape, 0.3)
    assert len(half.vertices) == len(kept) == 300
    np.testing.assert_array_equal(half.vertices, cape.vertices[kept])
    assert areas(half).sum() == pytest.approx(areas(cape).sum(), rel=0.01)
    assert half.material == cape.material and half.key_joint == cape.key_joint


def test_pins_that_are_left_are_where_they_were(cape, shaped):
    half, kept = coarser_garment(cape, 0.3)
    assert 3 <= len(half.pins) < len(cape.pins)
    posed = shaped.posed(shaped.rest_pose)
    before = dict(zip(cape.pins.vertices.tolist(), cape.pins.on(posed), strict=True))
    for vertex, place in zip(half.pins.vertices, half.pins.on(posed), strict=True):
        np.testing.assert_array_equal(place, before[int(kept[vertex])])


def test_a_pinned_line_across_the_cloth_stays_one(cape, shaped):
    row = 12 * 40 + np.arange(40)
    across = replace(cape, pins=Pins.on_joint(row, cape.vertices[row], 9, shaped.joints))
    half, _ = coarser_garment(across, 0.3)
    along = np.isin(edges(half.faces), half.pins.vertices).all(axis=1)
    assert len(half.pins) >= 8 and along.sum() == len(half.pins) - 1


def test_pieces_stay_apart(cape, shaped):
    both = wear_together([cape, replace(cape, name="over")])
    half, kept = coarser_garment(both, 0.3)
    first = both.pieces[0].vertex_count
    assert [piece.vertex_count for piece in half.pieces] == [(kept < first).sum(), (kept >= first).sum()]
    assert [piece.name for piece in half.pieces] == [piece.name for piece in both.pieces]
    assert (kept[half.faces] < first).all(axis=1).sum() + (kept[half.faces] >= first).all(axis=1).sum() == len(
        half.faces
    )


def test_all_of_it_is_the_garment_itself(cape):
    whole, kept = coarser_garment(cape, 1.0)
    assert whole is cape and np.array_equal(kept, np.arange(1000))


def test_wrong_shares_are_refused(cape):
    for share in (0.0, -1.0, 1.5, float("nan")):
        with pytest.raises(BadInput, match="a share of vertices is above 0 and at most 1; got"):
            coarser_garment(cape, share)
    with pytest.raises(BadInput, match="needs 50 vertices or more; got 0.01 of 1000; keep 0.05"):
        coarser_garment(cape, 0.01)

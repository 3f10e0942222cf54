"""Garments worn together that start through each other: each settles alone, and out of those beneath it."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from hemline import bodies, garments
from hemline.animators import settle
from hemline.animators.settle import separate_garments, settle_garment
from hemline.collide import inside
from hemline.collide.layers.closed_cloth import ClosedCloth
from hemline.errors import HemlineWarning, SimulationFailed
from hemline.garments import coarser_garment, wear_together
from hemline.meshes import crossing_edges, edges
from hemline.sim.rest.tangles import TangledCloth

SMALL = 0.165
"""Share of the vertices of the shipped garments."""


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def through():
    """A cape that goes through the shirt beneath it."""
    both = wear_together([garments.load("tshirt-light"), garments.load("cape-light")])
    return coarser_garment(both, SMALL)[0]


def share_crossing(vertices, faces):
    return len(crossing_edges(np.asarray(vertices, np.float32), faces)) / len(edges(faces))


def test_pieces_are_out_of_each_other_and_of_the_body(shaped, through):
    assert share_crossing(through.vertices, through.faces) > 0.01
    apart = separate_garments(through, shaped, through.vertices)
    assert share_crossing(apart, through.faces) < 0.005
    inner = through.layers[0].vertex_count
    shirt = ClosedCloth.of(inner, through.faces[through.face_pieces == 0])
    beneath = inside(shirt.vertices(apart[:inner]), shirt.faces, apart[inner:])
    assert not beneath.any()
    assert not inside(shaped.vertices, shaped.body.faces, apart).any()


def failing_together(monkeypatch, vertices_of):
    """No pair settles; a garment alone settles where it is told."""

    class At:
        def __init__(self, positions):
            self.positions = positions

    def rest_state(garment, shaped, settings):
        if len(garment.layers) > 1:
            raise SimulationFailed("tangled")
        return At(vertices_of(garment).astype(float))

    monkeypatch.setattr(settle, "rest_state", rest_state)


def test_where_they_do_not_settle_together_each_settles_alone(monkeypatch, shaped, through):
    failing_together(monkeypatch, lambda garment: garment.vertices)
    np.testing.assert_array_equal(settle_garment(through, shaped), separate_garments(through, shaped, through.vertices))


def test_a_garment_through_itself_is_refused_as_it_was(monkeypatch, shaped, through):
    def knotted(garment):
        away = np.random.default_rng(0).normal(size=garment.vertices.shape)
        return garment.vertices + 0.05 * away

    failing_together(monkeypatch, knotted)
    with pytest.raises(SimulationFailed, match="^tangled$"):
        settle_garment(through, shaped)


@pytest.mark.parametrize(("kind", "tries"), [(SimulationFailed, 1), (TangledCloth, 2)])
def test_one_garment_that_does_not_settle_is_refused(monkeypatch, shaped, kind, tries):
    limits = []

    def rest_state(garment, shaped, settings, max_crossing=None):
        limits.append(max_crossing)
        raise kind("tangled" if max_crossing is None else "more tangled")

    monkeypatch.setattr(settle, "rest_state", rest_state)
    with pytest.raises(kind, match="^tangled$"):
        settle_garment(garments.load("cape-light"), shaped)
    assert len(limits) == tries


def test_one_garment_with_a_few_tangles_is_played_and_it_is_said(monkeypatch, shaped):
    cape = garments.load("cape-light")
    found = settle.rest_state
    limits = []

    def rest_state(garment, shaped, settings, max_crossing=None):
        limits.append(max_crossing)
        if max_crossing is None:
            raise TangledCloth("tangled")
        return found(garment, shaped, settings, max_crossing=max_crossing)

    coarse, _ = coarser_garment(cape, 0.05)
    monkeypatch.setattr(settle, "rest_state", rest_state)
    with pytest.warns(HemlineWarning, match="goes through itself at rest; got 0.0 % of its edges"):
        rest = settle_garment(coarse, shaped)
    assert limits == [None, settle.MOST_CROSSING_WORN]
    assert not inside(shaped.vertices, shaped.body.faces, rest.astype(np.float32)).any()


@pytest.mark.slow
def test_a_dress_over_a_shirt_settles_near_where_both_lie_alone():
    body = bodies.load("anny24").shaped()
    both = wear_together([garments.load("tshirt-light"), garments.load("dress-light")])
    coarse, _ = coarser_garment(both, 0.16)
    rest = settle_garment(coarse, body)
    assert share_crossing(rest, coarse.faces) < 0.005
    assert not inside(body.vertices, body.body.faces, rest.astype(np.float32)).any()
    far = KDTree(body.vertices).query(rest)[0]
    assert far.max() < 0.4, "no part of it has flown away"

"""Edge limits: what is stretched too far becomes shorter, what the body stretches at rest may stay, no more."""

import numpy as np
import pytest

import hemline
from hemline.animators import together
from hemline.collide import EdgeLimits
from hemline.collide.whole.edge_limits import STRETCH, SWEEPS
from hemline.meshes import edge_strains, rest_lengths
from tests.collide.whole_samples import sheet

TORN = 120
"""Where a row of the sheet is pulled out of it: one vertex of 1,681."""


def torn(garment):
    """The sheet with one vertex pulled out by 3 cm, its edges four times as long as they are at rest."""
    vertices = garment.vertices.copy()
    vertices[TORN, 1] += 0.03
    return vertices


def lengths_of(garment, vertices):
    edges, _ = rest_lengths(garment.faces, garment.rest_edges)
    return np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)


def by_formula(garment, vertices, rest, pinned=()):
    """The same in plain NumPy, edge by edge."""
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    longest = np.maximum(lengths, lengths_of(garment, rest)) * STRETCH
    listed = np.flatnonzero(lengths_of(garment, vertices) > STRETCH * lengths)
    moved = vertices.astype(np.float64)
    for sweep in range(SWEEPS):
        for e in listed if sweep % 2 == 0 else listed[::-1]:
            a, b = edges[e]
            way = moved[b] - moved[a]
            length = np.linalg.norm(way)
            shares = np.array([a not in pinned, b not in pinned], float)
            too_long = max(0.0, length - longest[e]) / max(shares.sum(), 1)
            moved[a] += shares[0] * too_long * way / length
            moved[b] -= shares[1] * too_long * way / length
    return moved


def test_cloth_that_is_not_too_long_keeps_every_bit():
    garment = sheet()
    wider = (garment.vertices * [STRETCH - 0.01, 1, STRETCH - 0.01]).astype(np.float32)
    assert np.array_equal(EdgeLimits.of(garment).shorten(wider, garment.vertices), wider)


@pytest.mark.parametrize("pinned", [(), (TORN,), (TORN + 1,)])
def test_it_is_what_plain_numpy_makes_of_it(pinned):
    garment = sheet(pinned=pinned)
    found = EdgeLimits.of(garment).shorten(torn(garment), garment.vertices)
    expected = by_formula(garment, torn(garment), garment.vertices, pinned)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert np.abs(found - torn(garment)).max() > 0.005
    if pinned:
        assert np.array_equal(found[list(pinned)], torn(garment)[list(pinned)])


def test_a_vertex_that_is_pulled_out_comes_back_and_the_sheet_stays_where_it_is():
    """Pulls are equal and opposite: the mean place stays, and an edge far away does not move."""
    garment = sheet()
    vertices = torn(garment)
    found = EdgeLimits.of(garment).shorten(vertices, garment.vertices)
    before, after = (edge_strains(each, garment.faces, garment.rest_edges).max() for each in (vertices, found))
    assert before > 2 and after < 0.45 * before
    np.testing.assert_allclose(found.mean(axis=0), vertices.mean(axis=0), atol=1e-6)
    far = np.linalg.norm(garment.vertices - garment.vertices[TORN], axis=1) > 0.03
    assert np.array_equal(found[far], vertices[far])


def test_what_the_body_stretches_at_rest_may_be_as_long_in_any_pose():
    garment = sheet()
    large = (garment.vertices * np.float32([1.5, 1, 1.5])).astype(np.float32)
    limits = EdgeLimits.of(garment)
    assert np.array_equal(limits.shorten(large, large), large)
    assert np.abs(limits.shorten(large, garment.vertices) - large).max() > 0.001


def test_only_what_it_is_asked_to_hold_is_held():
    garment = sheet()
    vertices = torn(garment)
    apart = np.linalg.norm(garment.vertices - garment.vertices[TORN], axis=1) > 0.015
    assert np.array_equal(EdgeLimits.of(garment, apart).shorten(vertices, garment.vertices), vertices)


def kicked(*, whole, garments=("tshirt-light",)):
    """The frame of a kick in which a leg is raised to the head."""
    models = [hemline.load(name) for name in garments]
    body = hemline.bodies.load("anny24").shaped()
    kick = body.untangle_motion(hemline.motions.load("kick").resample(30.0))
    player = hemline.Player.prepare(models[0] if len(models) == 1 else together(models), body, whole=whole)
    state = player.start(kick[30], pre_roll=0.2)
    return player, player.step(state, kick[30], 1 / 30)[1]


def long_share(player, vertices):
    return float((edge_strains(vertices, player.garment.faces, player.garment.rest_edges) > 0.3).mean())


def test_a_leg_raised_to_the_head_tears_less_of_the_hem():
    player, frame = kicked(whole=True)
    assert long_share(player, frame.animated) > 0.03
    assert long_share(player, frame.before_projection) < 0.8 * long_share(player, frame.animated)
    assert long_share(player, frame.vertices) < 0.95 * long_share(player, frame.animated)
    _, plain = kicked(whole=False)
    assert np.array_equal(plain.before_projection, plain.animated) and np.array_equal(plain.animated, frame.animated)


def test_of_garments_worn_together_those_that_settle_are_held_so():
    player, frame = kicked(whole=True, garments=("tshirt-light", "longsleeve-light"))
    assert long_share(player, frame.before_projection) < 0.7 * long_share(player, frame.animated)


def test_at_lower_detail_it_holds_the_vertices_that_are_left():
    model, body = hemline.load("tshirt-light"), hemline.bodies.load("anny24").shaped((1.0, -1.0))
    kick = body.untangle_motion(hemline.motions.load("kick").resample(30.0))
    player = hemline.Player.prepare(model, body, detail=0.6)
    _, frame = player.step(player.start(kick[30], pre_roll=0.2), kick[30], 1 / 30)
    assert long_share(player, frame.before_projection) < 0.9 * long_share(player, frame.animated)

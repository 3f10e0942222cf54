"""Garments worn together that start through each other: out of each other at rest, where that is asked for."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.collide import inside
from hemline.collide.layers.closed_cloth import ClosedCloth
from hemline.errors import SimulationFailed
from hemline.garments import coarser_garment, worn_together
from hemline.meshes import crossing_edges, edges
from hemline.sim.rest.apart import moved_apart
from hemline.sim.rest.settle import rest_state
from hemline.sim.rest.tangles import MOST

SMALL = 0.09


def through():
    """A dress with sleeves that goes through a shirt beneath it."""
    both = worn_together([garments.load("tshirt-light"), garments.load("dress-light")])
    return coarser_garment(both, SMALL)[0]


def share_crossing(vertices, faces):
    return len(crossing_edges(np.asarray(vertices, np.float32), faces)) / len(edges(faces))


def test_pieces_are_out_of_each_other_and_of_the_body():
    body, both = bodies.load("anny24").shaped(), through()
    assert share_crossing(both.vertices, both.faces) > 0.01
    apart = moved_apart(both, body, lambda piece: piece.vertices)
    assert share_crossing(apart.vertices, apart.faces) < MOST
    inner = both.worn[0].vertex_count
    shirt = both.faces[both.face_pieces == 0]
    closed = ClosedCloth.of(inner, shirt)
    beneath = inside(closed.vertices(apart.vertices[:inner]), closed.faces, apart.vertices[inner:])
    assert not beneath.any()
    assert not inside(body.vertices, body.body.faces, apart.vertices).any()
    np.testing.assert_array_equal(apart.faces, both.faces)


@pytest.mark.slow
def test_what_is_refused_else_settles_apart():
    body, both = bodies.load("anny24").shaped(), through()
    with pytest.raises(SimulationFailed, match=r"'tshirt-light\+dress-light' is tangled: \d+ of \d+ edges"):
        rest_state(both, body)
    rest = rest_state(both, body, apart=True)
    assert share_crossing(rest.positions, both.faces) <= 0.005
    assert not inside(body.vertices, body.body.faces, rest.positions.astype(np.float32)).any()


@pytest.mark.slow
def test_one_garment_through_itself_is_refused_whatever_is_asked():
    body = bodies.load("anny24").shaped()
    cape = garments.make_cape(body, rows=20, columns=31, name="napkin")
    knotted = replace(cape, vertices=cape.vertices + np.float32(0.02) * np.sin(900 * cape.vertices))
    with pytest.raises(SimulationFailed):
        rest_state(knotted, body, apart=True)

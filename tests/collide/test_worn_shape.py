"""A garment that is torn at rest is relaxed before anything carries it along."""

from dataclasses import replace

import numpy as np
import pytest

import hemline
from hemline.animators.live import Live
from hemline.collide import inside
from hemline.collide.close.worn_shape import TORN, relax_torn
from hemline.meshes import edge_strains, vertex_normals


@pytest.fixture(scope="module")
def body():
    return hemline.bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def torn(body):
    """The T-shirt with every twentieth vertex pulled out by three centimetres."""
    shirt = hemline.garments.load("tshirt-light").dressed(body)
    vertices = shirt.vertices.copy()
    pulled = np.arange(0, len(vertices), 20)
    vertices[pulled] += 0.03 * vertex_normals(vertices, shirt.faces)[pulled]
    return replace(shirt, vertices=vertices.astype(np.float32))


def stretch_p99(garment, vertices):
    return np.percentile(edge_strains(vertices, garment.faces, garment.rest_edges), 99)


def test_edges_are_no_longer_torn_and_the_garment_stays_outside(body, torn):
    assert stretch_p99(torn, torn.vertices) > 2 * TORN
    relaxed = relax_torn(torn, body)
    assert stretch_p99(torn, relaxed.vertices) < 0.6 * TORN
    posed = body.posed(body.rest_pose)
    assert not inside(posed.vertices, posed.faces, relaxed.vertices).any()
    assert np.linalg.norm(relaxed.vertices - torn.vertices, axis=1).max() < 0.05
    assert relaxed.rest_edges is torn.rest_edges and np.array_equal(relaxed.faces, torn.faces)


def test_a_garment_that_is_whole_is_left_as_it_is(body):
    shirt = hemline.garments.load("tshirt-light").dressed(body)
    assert relax_torn(shirt, body) is shirt


def test_a_loose_garment_is_left_as_it_is(body):
    """The loop is for cloth that lies close: it would crumple a skirt."""
    skirt = hemline.garments.load("skirt-light").dressed(body)
    torn = replace(skirt, rest_edges=0.5 * skirt.rest_edges)
    assert stretch_p99(torn, torn.vertices) > TORN and relax_torn(torn, body) is torn


def test_live_does_not_carry_torn_edges_along(body, torn):
    """What it makes of the torn shirt is stretched as what it makes of the whole one is."""
    pose, found = hemline.motions.load("walk")[0], []
    for shirt in (torn, hemline.garments.load("tshirt-light").dressed(body)):
        player = hemline.Player.prepare(Live().animator_for(shirt, body), body)
        _, frame = player.step(player.start(pose), pose, 1 / 30)
        found.append(stretch_p99(shirt, frame.animated))
    assert found[0] < 1.25 * found[1]

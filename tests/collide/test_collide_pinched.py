"""Pinched vertices: cloth between an arm and the chest that it is pressed into stays one cloth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array, csr_array

import hemline
from hemline import bodies
from hemline.bodies.lifted_arms import FORMER_LIFT_DEG
from hemline.collide import Projector
from hemline.meshes import edges, rest_lengths

NO_FACES = np.empty((0, 3), np.int32)


@pytest.fixture(scope="module")
def pressed():
    """The shipped T-shirt as its animator shows it on arms lifted off the chest, and the body with hanging arms."""
    model, body = replace(hemline.load("tshirt-light"), lift_deg=FORMER_LIFT_DEG), bodies.load("anny24").shaped()
    posed = body.posed(hemline.motions.load("walk")[20])
    _, vertices = model.step(model.start(posed), posed, 1 / 30)
    return model.garment, body, posed, vertices


def projected(pressed, faces, places=None):
    garment, body, posed, vertices = pressed
    projector = Projector.prepare(body, garment.vertices, faces)
    return projector.project(projector.start(), posed, vertices, dt=1 / 30, places=places)


def test_they_go_along_with_those_around_them_and_no_other_moves(pressed):
    """By another route: the Laplace equation, with what is not pinched as its boundary."""
    garment, _, _, vertices = pressed
    _, alone, before = projected(pressed, NO_FACES)
    _, linked, after = projected(pressed, garment.faces)
    pinched = after.pinched
    assert len(pinched) > 50
    np.testing.assert_array_equal(pinched, before.pinched)
    np.testing.assert_array_equal(np.delete(linked, pinched, axis=0), np.delete(alone, pinched, axis=0))
    count, (one, other) = len(vertices), edges(garment.faces).T
    links = coo_array((np.ones(2 * len(one)), (np.r_[one, other], np.r_[other, one])), (count, count))
    mean = csr_array(links.multiply(1 / links.sum(axis=1)[:, None]))[pinched]
    moved = linked.astype(np.float64) - vertices
    moved[pinched] = 0
    plain = np.linalg.solve(np.eye(len(pinched)) - mean[:, pinched].toarray(), mean @ moved)
    np.testing.assert_allclose(linked[pinched] - vertices[pinched], plain, atol=2e-3)


def test_cloth_is_not_torn_between_two_limbs(pressed):
    garment, _, _, vertices = pressed
    which, lengths = rest_lengths(garment.faces, garment.rest_edges)

    def torn(worn):
        return np.mean(np.linalg.norm(worn[which[:, 0]] - worn[which[:, 1]], axis=1) > 1.3 * lengths)

    alone, linked = (projected(pressed, faces)[1] for faces in (NO_FACES, garment.faces))
    more_alone, more_linked = (torn(worn) - torn(vertices) for worn in (alone, linked))
    assert more_alone > 2 * torn(vertices)
    assert more_linked < 0.2 * more_alone


def test_what_contact_holds_off_is_left_to_it(pressed):
    garment = pressed[0]
    nowhere = np.full(len(garment.vertices), -1, np.int32)
    alone, linked = (projected(pressed, faces, nowhere)[1] for faces in (NO_FACES, garment.faces))
    np.testing.assert_array_equal(linked, alone)

"""How poses are chosen for sensitivity-optimised rigging, and the force that is left on a garment."""

import numpy as np

from hemline import bodies, garments
from hemline.collide import inside
from hemline.garments import coarser_garment
from hemline.sim.rest.settle import rest_state
from papers.agentdress.residual import Residual
from papers.agentdress.sampling import clustered, greedy

LINE = np.array([0.0, 0.1, 0.2, 1.0, 1.1, 5.0])


def test_greedy_takes_the_farthest_where_distance_is_what_is_missed():
    def missed(chosen):
        return np.abs(LINE[:, None] - LINE[chosen]).min(axis=1)

    assert greedy(missed, 0, 3).tolist() == [0, 5, 4]


def test_greedy_takes_no_candidate_twice():
    def missed(chosen):
        return np.where(np.arange(6) == 2, 9.0, 1.0)

    assert sorted(greedy(missed, 0, 6).tolist()) == list(range(6))


def test_each_cluster_gives_one_pose():
    turn = np.array([np.cos(LINE / 2), np.sin(LINE / 2)]).T
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (6, 24, 1))
    rotations[:, 5, [0, 2]] = turn
    found = clustered(rotations, np.eye(24)[5], 3, seed=0)
    assert {int(each) for each in found} in ({1, 3, 5}, {1, 4, 5})


def worn():
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    shaped = bodies.load("anny24").shaped()
    return garment, shaped, rest_state(garment, shaped)


def test_forces_inside_the_cloth_cancel_and_its_weight_is_left_in_the_air():
    garment, shaped, rest = worn()
    residual = Residual(garment, shaped)
    forces = residual.forces(shaped.posed(shaped.rest_pose), rest.vertices + np.array([0, 5, 0], np.float32))
    weight = residual.dressed.sheet.mass.sum() * np.array(residual.dressed.settings.gravity)
    np.testing.assert_allclose(forces.sum(axis=0), weight, atol=1e-4 * np.abs(weight).max())


def test_less_force_is_left_on_a_settled_garment_than_on_a_pulled_one():
    garment, shaped, rest = worn()
    residual, posed = Residual(garment, shaped), shaped.posed(shaped.rest_pose)
    still, pulled = residual.left(posed, rest.vertices), rest.vertices * np.array([1.0, 1.05, 1.0], np.float32)
    left = residual.left(posed, pulled)
    assert left.norm > 3 * still.norm
    assert left.median > 3 * still.median


def test_what_is_in_the_body_is_pushed_out():
    garment, shaped, rest = worn()
    posed, centre = shaped.posed(shaped.rest_pose), rest.vertices.mean(axis=0)
    within = centre + np.float32(0.9) * (rest.vertices - centre)
    out, pinched = Residual(garment, shaped).pushed_out(posed, within)
    assert inside(posed.vertices, posed.faces, within).sum() > 20
    assert not inside(posed.vertices, posed.faces, out.astype(np.float32))[~pinched].any()


def test_being_pushed_out_does_not_depend_on_what_was_pushed_before():
    garment, shaped, rest = worn()
    posed, centre = shaped.posed(shaped.rest_pose), rest.vertices.mean(axis=0)
    within = [centre + np.float32(share) * (rest.vertices - centre) for share in (0.9, 0.8)]
    residual = Residual(garment, shaped)
    first, _ = residual.pushed_out(posed, within[0])
    residual.pushed_out(posed, within[1])
    np.testing.assert_array_equal(residual.pushed_out(posed, within[0])[0], first)

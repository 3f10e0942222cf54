"""Choice of poses for sensitivity-optimised rigging, and the residual of a garment."""

import numpy as np

from hemline import bodies, garments
from hemline.collide import inside
from hemline.garments import coarser_garment
from hemline.sim.rest.settle import rest_state
from papers.agentdress.sampling import choose_greedily
from papers.agentdress.settled.pairs import cluster_centres
from papers.agentdress.settled.residual import Residual

LINE = np.array([0.0, 0.1, 0.2, 1.0, 1.1, 5.0])


def test_greedy_choice_takes_the_farthest_if_the_error_is_distance():
    def errors(chosen):
        return np.abs(LINE[:, None] - LINE[chosen]).min(axis=1)

    assert choose_greedily(errors, 0, 3).tolist() == [0, 5, 4]


def test_greedy_choice_takes_no_candidate_twice():
    def errors(chosen):
        return np.where(np.arange(6) == 2, 9.0, 1.0)

    assert sorted(choose_greedily(errors, 0, 6).tolist()) == list(range(6))


def test_each_cluster_has_one_centre():
    turn = np.array([np.cos(LINE / 2), np.sin(LINE / 2)]).T
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (6, 24, 1))
    rotations[:, 5, [0, 2]] = turn
    found = cluster_centres(rotations, np.eye(24)[5], 3)
    assert {int(each) for each in found} in ({1, 3, 5}, {1, 4, 5})


def rest_garment():
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    shaped = bodies.load("anny24").shaped()
    return garment, shaped, rest_state(garment, shaped)


def test_inner_forces_cancel_and_the_weight_remains_in_the_air():
    garment, shaped, rest = rest_garment()
    residual = Residual(garment, shaped)
    forces = residual.forces(shaped.posed(shaped.rest_pose), rest.vertices + np.array([0, 5, 0], np.float32))
    weight = residual.dressed.sheet.mass.sum() * np.array(residual.dressed.settings.gravity)
    np.testing.assert_allclose(forces.sum(axis=0), weight, atol=1e-4 * np.abs(weight).max())


def test_a_settled_garment_has_less_residual_than_a_pulled_one():
    garment, shaped, rest = rest_garment()
    residual, posed = Residual(garment, shaped), shaped.posed(shaped.rest_pose)
    pulled = rest.vertices * np.array([1.0, 1.05, 1.0], np.float32)
    settled, size = (residual.measure(posed, each, steps=0) for each in (rest.vertices, pulled))
    assert size.norm > 3 * settled.norm
    assert size.median > 3 * settled.median
    assert residual.measure(posed, pulled).median > 3 * residual.measure(posed, rest.vertices).median


def test_noise_that_nobody_sees_does_not_count_and_a_drape_from_elsewhere_does():
    """Without relaxation, 0.1 mm of noise is a larger residual than a garment that is a centimetre off."""
    garment, shaped, rest = rest_garment()
    residual, posed = Residual(garment, shaped), shaped.posed(shaped.rest_pose)
    noise = np.random.default_rng(0).normal(size=rest.vertices.shape)
    wave = np.sin(20 * rest.vertices[:, [1]]) * np.array([1.0, 0.0, 1.0])
    noisy, wavy = rest.vertices + 1e-4 * noise, rest.vertices + 1e-2 * wave
    plain = [residual.measure(posed, each, steps=0).median for each in (rest.vertices, noisy, wavy)]
    relaxed = [residual.measure(posed, each).median for each in (rest.vertices, noisy, wavy)]
    assert plain[1] > 10 * plain[0]
    assert relaxed[1] < 0.3 * plain[1] and relaxed[1] < 0.5 * relaxed[2]


def test_push_out_leaves_nothing_in_the_body():
    garment, shaped, rest = rest_garment()
    posed, centre = shaped.posed(shaped.rest_pose), rest.vertices.mean(axis=0)
    within = centre + np.float32(0.9) * (rest.vertices - centre)
    out, pinched = Residual(garment, shaped).push_out(posed, within)
    assert inside(posed.vertices, posed.faces, within).sum() > 20
    assert not inside(posed.vertices, posed.faces, out.astype(np.float32))[~pinched].any()


def test_push_out_does_not_depend_on_earlier_garments():
    garment, shaped, rest = rest_garment()
    posed, centre = shaped.posed(shaped.rest_pose), rest.vertices.mean(axis=0)
    within = [centre + np.float32(factor) * (rest.vertices - centre) for factor in (0.9, 0.8)]
    residual = Residual(garment, shaped)
    first, _ = residual.push_out(posed, within[0])
    residual.push_out(posed, within[1])
    np.testing.assert_array_equal(residual.push_out(posed, within[0])[0], first)

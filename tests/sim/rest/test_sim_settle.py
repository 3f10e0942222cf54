"""Garments at rest: a shirt that only friction and shape hold, a strip that hangs free."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from hemline import bodies, garments
from hemline.bench.simulator import make_shirt
from hemline.errors import BadInput, BadMotion, SimulationFailed
from hemline.garments.pins import Pins
from hemline.meshes import crossing_edges
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix
from hemline.sim import SimSettings, rest_drape, settle, settle_all, simulate
from hemline.tryon.fitness import STRAIN_LIMIT
from tests.sim.sim_garments import hanging_strip

GRAVITY = 9.81


@cache
def shirt():
    shaped = bodies.load("anny24").shaped()
    return make_shirt(shaped), shaped


@cache
def rest():
    return settle(*shirt())


def test_a_shirt_comes_to_rest_outside_the_body():
    igl = pytest.importorskip("igl")
    garment, shaped = shirt()
    found = rest()
    weight = GRAVITY * garment.material.density * area_of(garment) / len(garment.vertices)
    sizes = np.linalg.norm(found.forces, axis=1)
    assert found.residual_share <= 0.01
    assert sizes.mean() == pytest.approx(found.residual_share * weight, rel=1e-6)
    assert sizes.max() == pytest.approx(found.worst_share * weight, rel=1e-6)
    winding = igl.fast_winding_number(
        shaped.vertices.astype(float), shaped.body.faces.astype(np.int64), found.vertices.astype(float)
    )
    assert (winding < 0.5).all()
    assert found.figures["inside"] == 0
    # what presses on the body carries the shirt: it slopes and it rubs, so the loads are larger than the weight
    assert found.load.sum() > weight * len(garment.vertices)


def area_of(garment):
    return 0.5 * np.abs(np.linalg.det(garment.rest_edges)).sum()


def test_a_garment_settled_from_itself_stays_to_the_bit():
    again = settle(*shirt(), start=rest())
    assert np.array_equal(again.positions, rest().positions)
    assert again.newton_steps == 0


def test_turning_and_moving_the_body_as_a_whole_takes_the_shirt_along():
    garment, shaped = shirt()
    pose, turn, shift = shaped.rest_pose, from_axis_angle(np.array([0.0, 1.3, 0.0])), np.array([0.4, 0.1, -2.0])
    rotations = pose.rotations.astype(np.float64)
    rotations[0] = multiply(turn, rotations[0])
    there = settle(garment, shaped, start=rest(), tolerance=1e-3)
    moved = settle(garment, shaped, Pose(rotations, pose.translation + shift), start=there, tolerance=1e-3)
    wanted = (there.positions - pose.translation) @ to_matrix(turn).T + pose.translation + shift
    # contact amplifies the skin's float32 (1e-7 m)
    assert np.abs(moved.positions - wanted).max() < 5e-4
    assert moved.residual_share <= 1e-3


def test_shapes_are_settled_each_from_its_neighbour_and_given_back_in_order():
    garment, shaped = shirt()
    shapes = [shaped.body.shaped((0.0, share)) for share in (0.2, 0.0, 0.1)]
    found = settle_all(garment, shapes, tolerance=0.02)
    assert [each.shaped is shape for each, shape in zip(found, shapes, strict=True)] == [True] * 3
    assert all(each.residual_share <= 0.02 for each in found)
    large, own, middle = (each.positions for each in found)
    assert (
        np.linalg.norm(middle - 0.5 * (large + own), axis=1).mean() < 0.5 * np.linalg.norm(large - own, axis=1).mean()
    )


def test_shapes_around_the_mean_all_find_their_equilibrium():
    garment, shaped = shirt()
    rng = np.random.default_rng(0)
    for _ in range(5):
        found = settle(garment, shaped.body.shaped(0.5 * rng.normal(size=8)), start=rest())
        assert found.residual_share <= 0.01 and found.figures["inside"] == 0


def random_shape(number):
    return bodies.load("anny24").shaped(np.random.default_rng(3).normal(size=(200, 16)).astype(np.float32)[number])


def test_a_shirt_that_dressing_pushes_through_itself_comes_apart():
    shirt, thin = garments.load("tshirt-light"), random_shape(90)
    dressed = shirt.dressed(thin)
    assert len(crossing_edges(dressed.vertices, dressed.faces)) > 40
    rest = rest_drape(shirt, thin)
    assert np.array_equal(rest.betas, thin.betas)
    assert rest.figures["self_crossing_percent"] == 0 and rest.figures["inside"] == 0
    assert rest.figures["edge_strain_max"] < 0.3 and rest.figures["residual_share"] < 0.1


@pytest.mark.slow
def test_trousers_follow_the_body_where_thighs_press_together():
    # dressed on this body, the heaviest of two hundred, they end tangled (77 of 10,334 edges): this is the only way
    trousers, heavy = garments.load("trousers-light"), random_shape(194)
    rest = rest_drape(trousers, heavy)
    assert np.array_equal(rest.betas, heavy.betas)
    assert rest.figures["self_crossing_percent"] < 0.5 and rest.figures["inside"] == 0
    assert rest.figures["edge_strain_max"] < STRAIN_LIMIT and rest.figures["residual_share"] < 0.2


def test_a_hanging_strip_rests_as_the_closed_form_says():
    # F S = rho g (L - s), S = Y (F^2 - 1) / 2, as in tests/laws; thirty triangles of constant strain: 0.3 %
    garment, shaped, length = hanging_strip()
    material = garment.material
    found = settle(garment, shaped, tolerance=1e-6)
    rows = found.positions.reshape(4, 31, 3)
    stretch = float(np.linalg.norm(rows[:, 0] - rows[:, -1], axis=1).mean()) - length

    def strain(s):
        stress = material.density * GRAVITY * (length - s)
        return brentq(lambda f: f * material.young * (f**2 - 1) / 2 - stress, 1, 3) - 1

    assert stretch == pytest.approx(quad(strain, 0, length)[0], rel=5e-3)
    assert found.residual_share <= 1e-6


@pytest.mark.parametrize("stiffness", [2.0, 50.0])
def test_a_strip_on_springs_rests_lower_by_its_weight_over_their_stiffness(stiffness):
    garment, shaped, length = hanging_strip()
    springs = replace(garment, pins=garment.pins.with_stiffness(stiffness))
    hard, soft = (settle(each, shaped, tolerance=1e-6) for each in (garment, springs))
    pins = garment.pins.vertices
    lower = (hard.positions - soft.positions)[pins]
    weight = GRAVITY * 0.15 * 0.06 * length
    # in the mean of the springs, since all of them together carry all of it; sideways nothing pulls
    assert lower.mean(axis=0) == pytest.approx([0.0, weight / (len(pins) * stiffness), 0.0], abs=1e-6)


def test_a_strip_on_a_turned_joint_hangs_from_where_the_joint_takes_it():
    garment, shaped, _ = hanging_strip()
    number, top = JOINT_NAMES.index("spine3"), garment.vertices[garment.pins.vertices].astype(float)
    pins = Pins.on_joint(garment.pins.vertices, top, number, shaped.joints)
    rotations = shaped.rest_pose.rotations.astype(float)
    rotations[0] = multiply(from_axis_angle(np.array([0.0, 0.6, 0.0])), rotations[0])
    rest = settle(replace(garment, pins=pins), shaped, Pose(rotations, shaped.rest_pose.translation))
    # the whole body turns about the vertical through the pelvis, and the strip with it
    arm = top - shaped.rest_pose.translation
    cos, sin = np.cos(0.6), np.sin(0.6)
    turned = np.stack([cos * arm[:, 0] + sin * arm[:, 2], arm[:, 1], cos * arm[:, 2] - sin * arm[:, 0]], axis=1)
    assert rest.positions[pins.vertices] == pytest.approx(turned + shaped.rest_pose.translation, abs=2e-6)
    assert rest.residual_share <= 0.01


def test_draping_is_a_second_of_dynamics_and_says_how_still_the_cloth_is():
    draped = settle(*shirt(), start=rest(), method="draping")
    assert draped.method == "draping"
    assert draped.newton_steps == 0
    assert 0 < draped.residual_share < 2
    assert np.abs(draped.positions - rest().positions).max() < 0.05


@pytest.mark.slow
def test_a_body_that_cuts_through_itself_marks_vertices_pinched():
    garment, shaped = shirt()
    rotations = shaped.rest_pose.rotations.astype(np.float64)
    joint = JOINT_NAMES.index("left_shoulder")
    rotations[joint] = multiply(rotations[joint], from_axis_angle(np.array([0.0, 0.0, -0.75])))
    pose, apart = Pose(rotations, shaped.rest_pose.translation), SimSettings(self_contact=False)
    with pytest.raises(SimulationFailed, match=r"found no equilibrium: .* \d+ vertices are pinched between parts"):
        settle(garment, shaped, pose, apart, start=rest(), tolerance=1.0)
    found = settle(garment, shaped, pose, apart, start=rest(), method="draping")
    assert found.pinched.sum() > 0
    assert found.figures["pinched"] == found.pinched.sum()
    assert np.isfinite(found.positions).all()


def test_a_take_starts_from_the_garment_at_rest():
    take = rest().take()
    assert take.kind == "rest"
    assert np.array_equal(take.vertices[0], rest().vertices)
    assert take.figures["residual_share"] == rest().residual_share
    garment, shaped = shirt()
    simulated = simulate(garment, shaped, take.motion, SimSettings(lead_in=0.1), start=take)
    assert simulated.failed is None


def test_what_cannot_be_settled_is_refused_with_the_reason():
    garment, shaped = shirt()
    with pytest.raises(BadInput, match="'tolerance' must be positive; got 0"):
        settle(garment, shaped, tolerance=0)
    with pytest.raises(BadInput, match="unknown method; got 'magic'; use 'newton', 'draping' or 'walked'"):
        settle(garment, shaped, method="magic")
    with pytest.raises(BadMotion, match="finite"):
        settle(garment, shaped, Pose(np.full((24, 4), np.nan), np.zeros(3)))
    with pytest.raises(BadInput, match="'bodies' must hold a shape"):
        settle_all(garment, [])
    other = replace(garment, name="other", rest_edges=1.1 * garment.rest_edges)
    with pytest.raises(BadInput, match="'start' must belong to garment 'other'; got one of 'shirt'"):
        settle(other, shaped, start=rest())
    stranger = replace(shaped.body, name="stranger", template=1.01 * shaped.body.template)
    with pytest.raises(BadInput, match="'start' must be on the body 'stranger'; got one on 'anny24'"):
        settle(garment, stranger.shaped(), start=rest())


def test_cloth_that_nothing_holds_finds_no_equilibrium():
    garment, shaped, _ = hanging_strip(pinned=False)
    with pytest.raises(SimulationFailed, match="'strip' found no equilibrium: 1 of a vertex's weight is left"):
        settle(garment, shaped, settings=SimSettings(settle=0.1))


def test_whoever_waits_for_a_garment_may_give_it_up():
    """Called before each step, without a change of the result; what it raises comes through."""
    calls: list[int] = []
    free = rest_drape(*shirt())
    watched = rest_drape(*shirt(), on_step=lambda: calls.append(1))
    np.testing.assert_array_equal(free.vertices, watched.vertices)
    assert len(calls) > 10

    class TimeIsUp(Exception):
        pass

    def give_up():
        if len(calls) >= 15:
            raise TimeIsUp
        calls.append(1)

    calls.clear()
    with pytest.raises(TimeIsUp):
        rest_drape(*shirt(), on_step=give_up)
    assert len(calls) == 15

"""Kernels of small steps beside plain NumPy versions and the kernels of the offline simulator."""

import numpy as np
import pytest

from hemline.sim.cloth.air_kernels import TriangleAir, air_by_triangle
from hemline.sim.cloth.hinge_kernels import hinge_forces
from hemline.sim.small_steps.force_kernels import add_air, add_bending, add_viscosity, bending_give
from hemline.sim.small_steps.spring_sheet import spring_sheet
from hemline.sim.small_steps.step_kernels import (
    BUCKLED,
    PinTargets,
    StepCloth,
    edge_factors,
    find_velocities,
    predict,
    pull_pins,
    solve_edges,
)

pytestmark = pytest.mark.usefixtures("all_threads")
NO_PINS = np.empty(0, np.int32), np.empty(0)


def shuffled(sheet, pins=NO_PINS, seed=0):
    """A sheet for the kernels, in another order, with that order."""
    order = np.random.default_rng(seed).permutation(sheet.vertex_count)
    return spring_sheet(sheet, *pins, order), order


def crumple(positions, order, amount=0.02, seed=1):
    return (positions + amount * np.random.default_rng(seed).normal(size=positions.shape))[order].astype(np.float32)


def test_air_is_that_of_the_offline_simulator(square):
    sheet, flat = square(7, drag=1.2, lift=0.4)
    springs, order = shuffled(sheet)
    x, random = crumple(flat, order), np.random.default_rng(2)
    velocities, wind = (random.normal(size=x.shape).astype(np.float32) for _ in range(2))
    accelerations = np.zeros_like(x)
    add_air(springs, wind, np.float32(0.6), np.float32(0), x, velocities, accelerations)
    there = np.argsort(order)
    triangles = TriangleAir(np.empty((len(sheet.faces), 3)), np.empty((len(sheet.faces), 6)))
    own = (each[there].astype(float) for each in (x, velocities, wind))
    air_by_triangle(*own, sheet.faces, sheet.drag, sheet.lift, 0.6, triangles)
    forces = np.zeros((len(x), 3))
    np.add.at(forces, sheet.faces.astype(int), triangles.force[:, None])
    np.testing.assert_allclose(accelerations[there], forces / sheet.mass[:, None], rtol=1e-3, atol=1e-4)


def test_a_storm_blows_no_vertex_faster_than_itself(square):
    sheet, flat = square(7, drag=1.2, lift=0.4, density=0.05)
    springs, order = shuffled(sheet)
    x, still, h = crumple(flat, order), np.zeros((len(order), 3), np.float32), np.float32(0.008)
    for speed in (1.0, 50.0, 5000.0):
        accelerations = np.zeros_like(x)
        wind = np.tile(np.float32([0, speed, 0]), (len(x), 1))
        add_air(springs, wind, np.float32(0.6), h, x, still, accelerations)
        assert 0 < (h * accelerations[:, 1]).max() < 1.1 * speed


@pytest.mark.parametrize("curved", [0.0, 0.2])
def test_bending_is_that_of_the_offline_simulator(square, curved):
    sheet, flat = square(6, curved=curved, bending=0.01)
    springs, order = shuffled(sheet)
    x, there = crumple(flat, order), np.argsort(order)
    accelerations = np.zeros_like(x)
    add_bending(springs, springs.inverse_masses, x, accelerations)
    rests = 2 * np.sin(0.5 * sheet.hinge_rest) if curved else np.zeros(len(sheet.hinges))
    gradient, energy = np.empty((len(sheet.hinges), 12)), np.empty(len(sheet.hinges))
    hinge_forces(x[there].astype(float), sheet.hinges, sheet.hinge_weight, rests, gradient, energy)
    forces = np.zeros((len(x), 3))
    np.add.at(forces, sheet.hinges.ravel(), -gradient.reshape(-1, 3))
    expected = forces / sheet.mass[:, None]
    np.testing.assert_allclose(accelerations[there], expected, rtol=2e-3, atol=2e-4 * np.abs(expected).max())


def test_bending_that_is_too_stiff_for_the_step_is_damped_and_weak_bending_is_not(square):
    springs, _ = shuffled(square(6, bending=1.0)[0])
    give = bending_give(springs, np.float32(0.008))
    np.testing.assert_allclose(1 / give, 1 / springs.inverse_masses + 0.008**2 * springs.bending_stiffness, rtol=1e-5)
    assert (give * springs.bending_stiffness * 0.008**2).max() < 1
    weak, _ = shuffled(square(6, bending=1e-9)[0])
    np.testing.assert_allclose(bending_give(weak, np.float32(0.008)), weak.inverse_masses, rtol=1e-4)


def test_the_diagonal_of_the_bending_matrix_is_the_derivative_of_the_forces(square):
    sheet, flat = square(5, bending=0.01)
    springs, order = shuffled(sheet)
    for i in (0, 7, 12):
        x, accelerations = flat[order].astype(np.float32), np.zeros((len(order), 3), np.float32)
        # out of the plane of the sheet, in which it does not bend
        x[i, 1] += 1e-3
        add_bending(springs, springs.inverse_masses, x, accelerations)
        stiffness = -accelerations[i, 1] / springs.inverse_masses[i] / 1e-3
        assert stiffness == pytest.approx(springs.bending_stiffness[i], rel=1e-2)


@pytest.mark.parametrize("kernel", ["bending", "viscosity", "edges"])
def test_inner_forces_change_neither_momentum_nor_angular_momentum(square, kernel):
    sheet, flat = square(6, bending=0.01, young=50.0)
    springs, order = shuffled(sheet)
    x, accelerations = crumple(flat, order), np.zeros((len(order), 3), np.float32)
    if kernel == "bending":
        add_bending(springs, springs.inverse_masses, x, accelerations)
    elif kernel == "viscosity":
        velocities = np.random.default_rng(3).normal(size=x.shape).astype(np.float32)
        add_viscosity(springs, np.float32(10), velocities, accelerations)
    else:
        before = x.copy()
        solve_edges(springs, edge_factors(springs, np.float32(1e-3)), False, x)
        accelerations, x = (x - before) * 1e4, 0.5 * (x + before)
    forces = accelerations.astype(float) / springs.inverse_masses[:, None]
    size = np.linalg.norm(forces, axis=1).sum()
    assert size > 1e-3
    assert np.abs(forces.sum(axis=0)).max() < 1e-4 * size
    if kernel != "viscosity":  # its forces are along the difference of velocities, not along the edge
        # the edges' forces act at places that change within a sweep
        assert np.abs(np.cross(x, forces).sum(axis=0)).max() < (2e-2 if kernel == "edges" else 1e-4) * size


def test_viscosity_stops_relative_motion_and_leaves_a_common_one(square):
    sheet, _ = square(6)
    springs, order = shuffled(sheet)
    velocities = np.random.default_rng(3).normal(size=(len(order), 3)).astype(np.float32)
    found = []
    for common in (0.0, 5.0):
        accelerations = np.zeros_like(velocities)
        add_viscosity(springs, np.float32(10), velocities + np.float32(common), accelerations)
        found.append(accelerations)
    assert (found[0] * velocities / springs.inverse_masses[:, None]).sum() < 0
    np.testing.assert_allclose(found[1], found[0], atol=1e-3)
    still = np.zeros_like(velocities)
    add_viscosity(springs, np.float32(10), np.full_like(velocities, 3.0), still)
    assert np.abs(still).max() < 1e-4


def test_edges_are_solved_as_in_plain_numpy(square):
    sheet, flat = square(5, young=20.0)
    springs, order = shuffled(sheet, (np.array([0, 4], np.int32), np.array([np.inf, np.inf])))
    x, h = crumple(flat, order), 2e-3
    expected = x.astype(float)
    w = springs.inverse_masses.astype(float)
    for (a, b), length, compliance in zip(springs.edges, springs.lengths, springs.compliances, strict=True):
        away = expected[b] - expected[a]
        distance = np.linalg.norm(away)
        give = compliance if distance > length else compliance / BUCKLED
        pull = (distance - length) / (w[a] + w[b] + give / h**2) / distance
        expected[a] += w[a] * pull * away
        expected[b] -= w[b] * pull * away
    solve_edges(springs, edge_factors(springs, np.float32(h)), False, x)
    np.testing.assert_allclose(x, expected, atol=2e-6)


def test_a_soft_spring_resists_half_as_much_when_it_is_compressed(square):
    """A sheet that is very soft, evenly stretched and evenly compressed by the same fraction."""
    sheet, flat = square(4, young=1e-3)
    springs, order = shuffled(sheet)
    moved = []
    for scale in (1.1, 0.9):
        x = np.ascontiguousarray(scale * flat[order], np.float32)
        before = x.copy()
        solve_edges(springs, edge_factors(springs, np.float32(1e-3)), False, x)
        moved.append(np.abs(x.astype(float) - before).sum())
    assert moved[1] / moved[0] == pytest.approx(0.5, rel=0.01)


def test_steps_go_by_velocity_and_velocities_are_those_of_the_step(square):
    sheet, flat = square(4)
    x = crumple(flat, shuffled(sheet)[1])
    velocities = np.random.default_rng(0).normal(size=x.shape).astype(np.float32)
    cloth, changes = StepCloth(x.copy(), velocities.copy(), np.empty_like(x)), np.full_like(x, 2.0)
    predict(np.float32(0.01), changes, cloth)
    np.testing.assert_allclose(cloth.velocities, velocities + 0.02, atol=1e-6)
    np.testing.assert_allclose(cloth.positions, x + 0.01 * (velocities + 0.02), atol=1e-6)
    np.testing.assert_array_equal(cloth.start, x)
    cloth.positions[:] += 0.003
    find_velocities(np.float32(0.01), cloth)
    np.testing.assert_allclose(cloth.velocities, velocities + 0.32, atol=1e-3)


def test_hard_pins_go_all_the_way_and_soft_ones_as_far_as_their_spring_pulls(square):
    sheet, flat = square(4)
    springs, order = shuffled(sheet, (np.array([0, 3], np.int32), np.array([np.inf, 5.0])))
    x, h, targets = flat[order].astype(np.float32), 1e-3, flat[[0, 3]].astype(np.float32) + np.float32(0.1)
    here = x[springs.pins].copy()
    pull_pins(springs, PinTargets(here, targets), np.float32(0.5), np.float32(h), x)
    np.testing.assert_allclose(x[springs.pins[0]], 0.5 * (here[0] + targets[0]), atol=1e-6)
    w = springs.inverse_masses[springs.pins[1]]
    share = w / (w + 1 / (5.0 * h**2))
    np.testing.assert_allclose(x[springs.pins[1]] - here[1], share * 0.05, rtol=1e-3)


def test_springs_have_the_modulus_of_the_fabric():
    """A sheet of equilateral triangles under 1 % of strain: stress along it and across it as of Poisson's ratio 1/3."""
    from hemline.sim import Elastic, make_sheet

    count, edge, young = 12, 0.05, 80.0
    i, j = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    flat = np.stack([edge * (i + 0.5 * (j % 2)), edge * np.sqrt(0.75) * j], axis=-1).reshape(-1, 2)
    number, faces = np.arange(count**2).reshape(count, count), []
    for a in range(count - 1):
        for b in range(count - 1):
            p, q, r, s = number[a, b], number[a + 1, b], number[a + 1, b + 1], number[a, b + 1]
            faces += [[p, q, r], [p, r, s]] if b % 2 else [[p, q, s], [q, r, s]]
    faces = np.array(faces, np.int32)
    rest = np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)
    sheet = make_sheet(faces, rest, Elastic(young=young, poisson=1 / 3))
    springs = spring_sheet(sheet, *NO_PINS, np.arange(count**2))
    strain = np.array([0.01, -0.01 / 3])
    away = flat[springs.edges[:, 1]] - flat[springs.edges[:, 0]]
    change = (away * strain * away).sum(axis=1) / springs.lengths
    force = change / springs.compliances
    # virial stress of the edges within the sheet, whose area is that of their triangles
    stress = np.einsum("e,ei,ej->ij", force / springs.lengths, away, away) / sheet.area.sum()
    assert stress[0, 0] == pytest.approx(young * 0.01, rel=1e-3)
    assert abs(stress[1, 1]) < 1e-3 * young * 0.01 + 1e-6 and abs(stress[0, 1]) < 1e-3

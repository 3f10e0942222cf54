"""The settled drape is an equilibrium of the ropes, exactly at rest and again after a shove."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.animators.ropes.mechanics.balance import STANDARD_GRAVITY, drape_balance
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.rope_force_kernels import spring_accelerations
from hemline.sim import SimSettings
from hemline.sim.cloth.air_kernels import TriangleAir, air_by_triangle


@functools.cache
def shaped():
    return bodies.load("anny24").shaped()


@functools.cache
def ropes(name="cape-light"):
    return build_ropes(garments.load(name), shaped(), chain_count=6, bone_counts=(8, 9))


def stood_mm(each, seconds, shove=0.0, fps=30):
    """Returns distance and speed of the free bones after standing still in the rest pose [mm, mm/s]."""
    posed = shaped().posed(shaped().rest_pose)
    state = each.start(posed)
    began, free = state.positions, each.parents >= 0
    velocities = np.random.default_rng(0).normal(0, 1, began.shape) * shove * free[:, None]
    state = replace(state, velocities=velocities)
    for _ in range(int(seconds * fps)):
        state = each.step(state, posed, 1 / fps)
    return 1000 * np.linalg.norm((state.positions - began)[free], axis=1), 1000 * np.abs(state.velocities[free]).max()


def test_in_the_drape_tension_weight_and_balance_cancel_at_every_node():
    chains = ropes().chains
    down = np.array([0, -STANDARD_GRAVITY, 0])
    for first, last in zip(chains.offsets[:-1], chains.offsets[1:], strict=True):
        for i in range(first + 1, last):
            force = chains.masses[i] * (down + chains.balance[i]) - chains.rest_tensions[i] * chains.rest_directions[i]
            if i + 1 < last:
                force = force + chains.rest_tensions[i + 1] * chains.rest_directions[i + 1]
            assert np.abs(force).max() < 1e-12
    assert (chains.balance[chains.kinematic] == 0).all()


def test_a_chain_that_hangs_straight_down_needs_no_balance():
    down = np.tile([0.0, -1.0, 0.0], (6, 1))
    masses = np.array([9.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    balance, tensions = drape_balance(np.array([0, 6], np.int32), down, masses, np.ones(6, np.bool_))
    np.testing.assert_array_equal(balance, 0)
    np.testing.assert_allclose(tensions[1:], STANDARD_GRAVITY * np.cumsum(masses[:0:-1])[::-1])


@pytest.mark.parametrize("name", ["cape-light", "skirt-light"])
@pytest.mark.parametrize("fps", [24, 60])
def test_ropes_at_rest_stay_at_rest(name, fps):
    away, speed = stood_mm(ropes(name), 5, fps=fps)
    assert away.max() < 0.01 and speed < 0.01


def test_after_a_shove_the_ropes_come_back_to_the_drape_and_to_rest():
    away, speed = stood_mm(ropes(), 8, shove=0.5)
    assert away.mean() < 1 and speed < 10


@pytest.mark.parametrize("fraction", [0.2, 2.0])
def test_the_drape_is_an_equilibrium_on_the_moon_too(fraction):
    lighter = ropes().with_constants(RopeConstants(gravity=(0.0, -fraction * STANDARD_GRAVITY, 0.0)))
    away, speed = stood_mm(lighter, 5)
    assert away.mean() < 1 and speed < 10


def test_the_drape_turns_with_the_body():
    from hemline.motions import Pose

    rest, half = shaped().rest_pose, np.array([0.0, 0.0, 1.0, 0.0], np.float32)
    turned = rest.rotations.copy()
    w, x, y, z = rest.rotations[0]
    turned[0] = [-y, z, w, -x]  # half a turn about the vertical, before the pelvis' own
    assert half @ half == 1
    posed = shaped().posed(Pose(turned, rest.translation))
    state = ropes().start(posed)
    began = state.positions
    for _ in range(60):
        state = ropes().step(state, posed, 1 / 30)
    assert np.abs(state.positions - began).max() < 1e-3


def test_the_air_and_friction_of_new_ropes_are_those_of_the_simulator():
    """By the force on one triangle of the simulator, over its mass."""
    chains, settings = ropes().chains, SimSettings()
    material = garments.load("cape-light").material
    found = RopeConstants.of_material(material, settings.air_density)
    x = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
    wind = np.tile([0.3, -0.2, 1.0], (3, 1))
    out = TriangleAir(np.zeros((1, 3)), np.zeros((1, 6)))
    coefficients = np.array([material.drag]), np.array([material.lift])
    faces = np.array([[0, 1, 2]])
    air_by_triangle(x, np.zeros((3, 3)), wind, faces, *coefficients, 0.5 * settings.air_density, out)
    mass = material.density * 0.005
    u, n = wind[0], np.array([0.0, 0, 1])
    speed, facing = np.linalg.norm(u), u @ n
    rates = found.air_drag, found.air_lift
    expected = abs(facing) * (rates[0] - rates[1] * abs(facing) / speed) * u + rates[1] * speed * facing * n
    np.testing.assert_allclose(3 * out.force[0] / mass, expected, rtol=1e-5)
    assert (found.drag, found.friction) == (0.0, material.friction)
    assert chains.constants.drag == 0.0


@pytest.mark.parametrize(("off", "kept"), [(-0.05, 1.0), (0.0, 1.0), (0.04, 0.6), (0.1, 0.0), (0.5, 0.0)])
def test_the_balance_fades_where_a_node_leaves_its_support(off, kept):
    chains = ropes().chains
    free = np.flatnonzero((chains.parents >= 0) & (np.linalg.norm(chains.balance, axis=1) > 1.0))
    chosen = int(free[0])
    constants = replace(chains.constants, lateral=0.0, lateral_stretch=0.0, shrink=0.0, balance_reach=0.1)
    chains = replace(chains, constants=constants)
    direction = chains.balance[chosen] / np.linalg.norm(chains.balance[chosen])
    positions = np.array(ropes().rest, np.float64)
    positions[chosen] += off * direction
    found, none = np.zeros_like(positions), np.zeros_like(positions)
    turns = np.tile(np.eye(3), (len(chains.chain_joints), 1, 1))
    forces = chains.kernel_chains, constants.numbers(), 1 / 60, turns, none, chains.rest_tensions, positions
    spring_accelerations(*forces, found)
    np.testing.assert_allclose(found[chosen] - constants.gravity, kept * chains.balance[chosen], atol=1e-6)

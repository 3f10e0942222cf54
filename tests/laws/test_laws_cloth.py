"""Laws of mechanics that the simulator must obey, against closed forms."""

import hashlib
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from hemline.sim import BodySurface, ClothState, Elastic, Gusts, MovingSkin, SimSettings, Stepper, StepScene, make_sheet

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops

GRAVITY = 9.81
TIGHT = SimSettings(residual_share=1e-3, solver_share=1e-3, newton_steps=30)


def sheet_of(across, along, width, length, **material):
    """A flat rectangle in the plane y = 0; vertex (i, j) is number i * along + j."""
    u, v = np.meshgrid(np.linspace(0, width, across), np.linspace(0, length, along), indexing="ij")
    flat = np.stack([u.ravel(), v.ravel()], axis=1)
    number = np.arange(across * along).reshape(across, along)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    rest = np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)
    return make_sheet(faces, rest, Elastic(**material)), np.stack([u.ravel(), 0 * u.ravel(), v.ravel()], axis=1)


def still(pinned=None, skin=None):
    """A scene in which nothing moves."""
    scene = StepScene(np.zeros((0, 3)) if pinned is None else pinned, skin)
    return lambda share: scene


def run(stepper, state, h, steps, scene):
    for _ in range(steps):
        state, report = stepper.advance(state, h, scene)
        yield state, report


def last(stepper, state, h, steps, scene):
    *_, (state, report) = run(stepper, state, h, steps, scene)
    return state, report


def test_free_fall():
    # backward Euler: y_n = -g h^2 n (n + 1) / 2, which is g t^2 / 2 plus g t h / 2
    sheet, x = sheet_of(5, 5, 0.4, 0.4)
    stepper, h, steps = Stepper(sheet, settings=TIGHT), 1 / 240, 120
    state, _ = last(stepper, stepper.start(x), h, steps, still())
    fallen = x[:, 1] - state.positions[:, 1]
    assert fallen == pytest.approx(GRAVITY * h**2 * steps * (steps + 1) / 2, rel=1e-6)
    time = steps * h
    assert np.abs(fallen - GRAVITY * time**2 / 2).max() <= 1.001 * GRAVITY * time * h / 2


@pytest.mark.parametrize(("young", "damping"), [(500.0, 0.0), (60.0, 0.003)])
def test_a_hanging_strip_stretches_by_its_own_weight(young, damping):
    # stress over rest length at s from the top: F S = rho g (L - s), S = Y (F^2 - 1) / 2; for small strain the strip
    # lengthens by rho g L^2 / (2 Y). Triangles have constant strain: 0.3 % on 30 of them.
    density, length = 0.15, 1.0
    sheet, x = sheet_of(4, 31, 0.1, length, density=density, young=young, poisson=0.0, bending=1e-7, damping=damping)
    x = np.stack([x[:, 0], -x[:, 2], 0 * x[:, 1]], axis=1)
    top = np.flatnonzero(x[:, 1] == 0)
    stepper = Stepper(sheet, pinned=top, settings=TIGHT)
    state, _ = last(stepper, stepper.start(x), 0.1, 60, still(x[top]))
    bottom = x[:, 1] == x[:, 1].min()
    found = -state.positions[bottom, 1].mean() - length

    def stretch(s):
        stress = density * GRAVITY * (length - s)
        return brentq(lambda f: f * young * (f**2 - 1) / 2 - stress, 1, 3) - 1

    wanted = quad(stretch, 0, length)[0]
    assert found == pytest.approx(wanted, rel=5e-3)
    if young == 500.0:
        assert found == pytest.approx(density * GRAVITY * length**2 / (2 * young), rel=1e-2)


def energy(stepper, state):
    mass = stepper.model.sheet.mass
    kinetic = 0.5 * (mass * (state.velocities**2).sum(axis=1)).sum()
    return kinetic + stepper.energy(state.positions) + GRAVITY * (mass * state.positions[:, 1]).sum()


@pytest.mark.parametrize("drag", [0.0, 1.2])
def test_energy_of_a_free_swinging_sheet_never_grows(drag):
    sheet, x = sheet_of(13, 13, 0.6, 0.6, young=100.0, drag=drag, lift=0.3 * drag)
    pins = np.array([0, 12])
    stepper = Stepper(sheet, pinned=pins, settings=TIGHT)
    state, before = stepper.start(x), np.inf
    for _ in range(120):
        state, _ = stepper.advance(state, 1 / 120, still(x[pins]))
        after = energy(stepper, state)
        # what the solver leaves open: 1e-3 of the weight, moved by centimetres
        assert after <= before + 1e-3 * GRAVITY * sheet.mass.sum() * 0.01
        before = after


def test_momentum_is_conserved():
    sheet, x = sheet_of(9, 9, 0.5, 0.5, young=50.0, bending=1e-4, damping=0.005)
    settings = replace(TIGHT, gravity=(0.0, 0.0, 0.0))
    stepper = Stepper(sheet, settings=settings)
    velocities = np.random.default_rng(0).normal(size=x.shape)
    state = replace(stepper.start(x), velocities=velocities)
    wanted = (sheet.mass[:, None] * velocities).sum(axis=0)
    size = (sheet.mass * np.linalg.norm(velocities, axis=1)).sum()
    state, _ = last(stepper, state, 1 / 120, 40, still())
    found = (sheet.mass[:, None] * state.velocities).sum(axis=0)
    # forces between vertices cancel; what is left is the solver's residual, summed over 40 steps
    assert np.abs(found - wanted).max() < 1e-3 * size


def ball(radius, detail=4):
    import trimesh

    sphere = trimesh.creation.icosphere(detail, radius)
    vertices = np.asarray(sphere.vertices, np.float32)
    return MovingSkin(vertices, vertices / np.float32(radius)), np.asarray(sphere.faces)


def test_moving_everything_rigidly_moves_the_result_rigidly():
    sheet, x = sheet_of(11, 11, 0.5, 0.5, young=80.0, drag=1.0, lift=0.3, friction=0.3)
    x = x + [-0.1, 0.208, -0.22]
    skin, faces = ball(0.2)
    surface = BodySurface(faces, reach=0.05)
    turn, shift = Rotation.from_rotvec([0.4, 1.1, -0.7]).as_matrix(), np.array([1.0, -2.0, 0.5])
    turned = MovingSkin((skin.vertices @ turn.T + shift).astype(np.float32), (skin.normals @ turn.T).astype(np.float32))
    settings = replace(TIGHT, wind=(0.5, 0.0, 1.0))
    other = replace(settings, gravity=tuple(turn @ settings.gravity), wind=tuple(turn @ settings.wind))
    first, second = (Stepper(sheet, surface=surface, settings=each) for each in (settings, other))
    one, _ = last(first, first.start(x), 1 / 120, 30, still(skin=skin))
    two, _ = last(second, second.start(x @ turn.T + shift), 1 / 120, 30, still(skin=turned))
    # the sheet falls on the ball, so that the skin's float32 (1e-7 m) and the solver's tolerance are amplified
    assert np.abs(one.positions - x).max() > 0.05
    assert np.abs(one.positions @ turn.T + shift - two.positions).max() < 1e-4


def test_a_sheet_on_a_sphere_comes_to_rest():
    sheet, x = sheet_of(21, 21, 0.6, 0.6, density=0.15, young=120.0, bending=1e-4, damping=0.01, friction=0.5)
    x = x + [-0.3, 0.26, -0.3]
    skin, faces = ball(0.25)
    settings = replace(SimSettings(), residual_share=5e-3, solver_share=0.02, newton_steps=20, creep=1e-4)
    stepper = Stepper(sheet, surface=BodySurface(faces, reach=0.05), settings=settings)
    state = stepper.start(x)
    for _ in range(90):
        state, _ = stepper.advance(state, 1 / 60, still(skin=skin))
        state = replace(state, velocities=0.9 * state.velocities)
    after, report = stepper.advance(state, 1 / 60, still(skin=skin))
    weight = GRAVITY * sheet.mass.mean()
    inertia = sheet.mass * np.linalg.norm(after.velocities - state.velocities, axis=1) * 60
    assert report.residual_share < 0.01
    assert inertia.mean() / weight < 0.05
    # the ball carries the sheet: load along the normals, with friction along the surface in either sense
    distance = np.linalg.norm(after.positions, axis=1)
    upwards = after.load * after.positions[:, 1] / distance
    assert 0.75 * weight * sheet.vertex_count < upwards.sum() < 1.25 * weight * sheet.vertex_count
    assert distance.min() > 0.25 + 0.002


@pytest.mark.parametrize("tangent", [0.2, 0.27, 0.33, 0.5])
def test_a_patch_on_a_slope_slides_only_beyond_the_angle_of_friction(tangent):
    # Coulomb, mu = 0.3: sticks below tan = 0.3, else slides with a = g (sin - mu cos)
    mu, angle = 0.3, np.arctan(tangent)
    sheet, x = sheet_of(5, 5, 0.1, 0.1, young=100.0, friction=mu)
    floor, ground = sheet_of(31, 11, 1.5, 0.4)
    ground = ground - [0.2, 0, 0.15]
    skin = MovingSkin(ground.astype(np.float32), np.tile(np.float32([0, 1, 0]), (len(ground), 1)))
    down = (GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle), 0.0)
    settings = replace(TIGHT, gravity=down, creep=1e-3)
    stepper = Stepper(sheet, surface=BodySurface(floor.faces[:, ::-1], reach=0.08), settings=settings)
    # let the load build up first
    sink = settings.thickness - GRAVITY * np.cos(angle) * sheet.density[0] / settings.contact_stiffness
    start = replace(stepper.start(x + [0, sink, 0]), load=sheet.mass * GRAVITY * np.cos(angle))
    steps, h = 60, 1 / 240
    state, _ = last(stepper, start, h, steps, still(skin=skin))
    slid, time = (state.positions - x)[:, 0].mean(), steps * h
    if tangent < mu:
        # friction is smoothed below the creep speed
        assert abs(slid) < 1e-3 * time
    else:
        wanted = 0.5 * GRAVITY * (np.sin(angle) - mu * np.cos(angle)) * time**2
        assert slid == pytest.approx(wanted, rel=0.05)


def test_period_of_a_stiff_pendulum_sheet():
    # a rigid sheet hinged on its upper edge: omega^2 = g sum(m r) / sum(m r^2) for the lumped masses; small amplitude
    # (0.05 rad changes the period by 0.02 %); backward Euler with 1/480 s by less than 0.1 %
    sheet, x = sheet_of(3, 13, 0.1, 0.5, young=2000.0, bending=1.0)
    tilt = 0.05
    radius = x[:, 2].copy()
    x = np.stack([x[:, 0], -radius * np.cos(tilt), radius * np.sin(tilt)], axis=1)
    top = np.flatnonzero(radius == 0)
    stepper, h = Stepper(sheet, pinned=top, settings=TIGHT), 1 / 480
    swing = [tilt]
    for state, _ in run(stepper, stepper.start(x), h, 700, still(x[top])):
        swing.append(float(state.positions[-1, 2]))
    swing = np.array(swing)
    crossing = np.flatnonzero(np.sign(swing[1:]) != np.sign(swing[:-1]))
    times = h * (crossing + swing[crossing] / (swing[crossing] - swing[crossing + 1]))
    wanted = 2 * np.pi / np.sqrt(GRAVITY * (sheet.mass * radius).sum() / (sheet.mass * radius**2).sum())
    assert 2 * np.diff(times)[0] == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_the_hem_swings_on_when_the_body_stops(speed):
    # a stiff sheet hangs from a hinge that moves sideways and stops at once: about the hinge it keeps its angular
    # momentum, w = v sum(m r) / sum(m r^2), and rises until I w^2 / 2 = g sum(m r) (1 - cos); backward Euler with
    # 1/960 s loses 1 to 2 % of the height on the way up
    sheet, x = sheet_of(3, 13, 0.1, 0.5, young=5000.0, bending=1.0)
    radius = x[:, 2].copy()
    x = np.stack([x[:, 0], -radius, 0 * radius], axis=1)
    top = np.flatnonzero(radius == 0)
    stepper, h = Stepper(sheet, pinned=top, settings=TIGHT), 1 / 960
    moving = replace(stepper.start(x), velocities=np.tile([0.0, 0.0, speed], (len(x), 1)))
    angle = max(
        float(np.arctan2(state.positions[-1, 2], -state.positions[-1, 1]))
        for state, _ in run(stepper, moving, h, 420, still(x[top]))
    )
    first, second = (sheet.mass * radius).sum(), (sheet.mass * radius**2).sum()
    wanted = np.arccos(1 - 0.5 * (speed * first / second) ** 2 * second / (GRAVITY * first))
    assert angle == pytest.approx(wanted, rel=0.03)


def test_a_falling_sheet_reaches_its_terminal_speed():
    # face down: weight = rho / 2 drag A v^2
    density, drag = 0.15, 1.2
    sheet, x = sheet_of(6, 6, 0.3, 0.3, density=density, drag=drag, lift=0.0, young=100.0, bending=1e-3)
    settings = replace(TIGHT, air_density=1.2)
    stepper = Stepper(sheet, settings=settings)
    state, _ = last(stepper, stepper.start(x), 1 / 60, 180, still())
    wanted = np.sqrt(2 * density * GRAVITY / (settings.air_density * drag))
    assert -state.velocities[:, 1] == pytest.approx(wanted, rel=1e-3)


def test_in_gusts_a_light_sheet_goes_with_the_air():
    # the air alone moves it: its mean velocity follows that of the air around it
    sheet, x = sheet_of(6, 6, 0.3, 0.3, density=0.02, drag=1.2, lift=1.2, young=100.0, bending=1e-4)
    gusts = Gusts(mean=(1.0, 0.5, 0.0), strength=0.3, length=3.0, seconds=5.0, seed=1)
    stepper = Stepper(sheet, settings=replace(TIGHT, gravity=(0.0, 0.0, 0.0)), wind=gusts)
    state, _ = last(stepper, stepper.start(x), 1 / 60, 240, still())
    air = gusts(state.time, state.positions).mean(axis=0)
    assert np.linalg.norm(air) > 0.5
    assert np.linalg.norm(state.velocities.mean(axis=0) - air) < 0.25 * np.linalg.norm(air)


def test_twice_the_resolution_gives_the_same_drape():
    drapes = []
    for count in (13, 25):
        sheet, x = sheet_of(count, count, 0.6, 0.6, young=100.0, bending=2e-4, damping=0.01)
        pins = np.array([0, count - 1, count * (count - 1), count * count - 1])
        held = x[pins] * [0.85, 1, 0.85]
        stepper = Stepper(sheet, pinned=pins, settings=replace(TIGHT, residual_share=0.01))
        hollow = np.sin(np.pi * x[:, 0] / 0.6) * np.sin(np.pi * x[:, 2] / 0.6)
        state = stepper.start(x * [0.85, 1, 0.85] - 0.2 * hollow[:, None] * [0, 1, 0])
        state, _ = last(stepper, state, 1 / 20, 60, still(held))
        drapes.append(state.positions.reshape(count, count, 3))
    coarse, fine = drapes[0], drapes[1][::2, ::2]
    sag = -coarse[..., 1].min()
    assert sag > 0.1
    assert np.abs(-fine[..., 1].min() - sag) < 0.05 * sag
    assert np.linalg.norm(coarse - fine, axis=-1).mean() < 0.05 * 0.6


THREADS = """
import hashlib, sys
from tests.laws.test_laws_cloth import some_steps
print(hashlib.sha256(some_steps().positions.tobytes()).hexdigest())
"""


def some_steps() -> ClothState:
    """A sheet of several chunks and patches, pinned, in the wind, on a ball."""
    sheet, x = sheet_of(24, 24, 0.6, 0.6, young=100.0, drag=1.2, lift=0.4)
    skin, faces = ball(0.2, 3)
    pins = np.array([0, 23])
    settings = SimSettings(wind=(1.0, 0.0, 2.0))
    stepper = Stepper(sheet, pinned=pins, surface=BodySurface(faces, reach=0.08), settings=settings)
    start = x + [-0.3, 0.21, -0.3]
    return last(stepper, stepper.start(start), 1 / 120, 8, still(start[pins], skin))[0]


def test_the_number_of_threads_changes_no_bit():
    code = THREADS
    found = []
    for threads in ("1", "2"):
        # threads that wait asleep: on a busy machine, spinning ones take minutes
        environment = os.environ | {"NUMBA_NUM_THREADS": threads, "OMP_WAIT_POLICY": "passive"}
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        found.append(done.stdout.strip())
    assert found[0] == found[1] == hashlib.sha256(some_steps().positions.tobytes()).hexdigest()

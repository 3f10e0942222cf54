"""Laws of mechanics that rope chains must keep: closed forms, and independent integrators."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.collide.primitives.distances import round_cone_shape

GRAVITY = 9.81
QUIET = {
    "drag": 0.0,
    "air_drag": 0.0,
    "air_lift": 0.0,
    "parent_damping": 0.0,
    "root_damping": 0.0,
    "bend_damping": 0.0,
    "lateral_damping": 0.0,
    "lateral": 0.0,
    "lateral_stretch": 0.0,
    "shrink": 0.0,
    "margin": 0.0,
    "friction": 0.0,
}
STILL = np.eye(4)[None, :3].copy()


def constants(**changes):
    return RopeConstants(**(QUIET | {"substep": 1.0} | changes))


def run(chains, positions, dt, count, *, velocities=None, roots=None, primitives=None, frames=None):
    """All positions of a run; `roots(t)` gives the kinematic nodes, `frames(t)` the colliders."""
    primitives = primitives or BodyPrimitives.none()
    frames = frames or (lambda t: STILL)
    fixed = positions[chains.kinematic]
    roots = roots or (lambda t: fixed)
    x, v = positions.copy(), np.zeros_like(positions) if velocities is None else velocities.copy()
    tensions, path, touched, speed = np.zeros(len(x)), [x], [], [v]
    for k in range(count):
        a, b = k * dt, (k + 1) * dt
        e = 1e-4 * dt
        rates = [(roots(t + e) - roots(t - e)) / (2 * e) for t in (a, b)]
        motion = np.stack([roots(a), roots(b), *rates])
        x, v, tensions, hit = chains.advance(
            x, v, tensions, motion, dt, colliders=primitives.colliders, frames=(frames(a), frames(b))
        )
        path.append(x)
        touched.append(hit)
        speed.append(v)
    return np.array(path), np.array(speed), tensions, np.array(touched)


def hanging(count, length=0.1):
    return np.column_stack([np.zeros(count), -length * np.arange(count), np.zeros(count)])


@pytest.mark.parametrize("count", [2, 6, 15])
def test_tensions_of_a_hanging_chain_carry_all_that_is_below(count):
    line, mass = hanging(count), 0.3
    chains = RopeChains.free([line], constants(), [np.full(count, mass)])
    _, _, tensions, _ = run(chains, line, 1 / 60, 3)
    expected = (count - 1 - np.arange(1, count) + 1) * mass * GRAVITY
    np.testing.assert_allclose(tensions[1:], expected, rtol=1e-6)


@pytest.mark.parametrize("degrees", [10, 60])
@pytest.mark.parametrize(("length", "dt"), [(1.0, 1 / 60), (0.05, 1 / 120)])
def test_a_pendulum_keeps_its_period_and_its_amplitude(length, dt, degrees):
    angle = np.radians(degrees)
    start = np.array([[0, 0, 0], [length * np.sin(angle), -length * np.cos(angle), 0]])
    period = 4 * np.sqrt(length / GRAVITY) * ellipk(np.sin(angle / 2) ** 2)
    chains = RopeChains.free([start], RopeConstants(**QUIET))
    path, *_ = run(chains, start, dt, int(20.3 * period / dt))
    swing = np.arctan2(path[:, 1, 0], -path[:, 1, 1])
    down = np.flatnonzero((swing[:-1] > 0) & (swing[1:] <= 0))
    times = dt * (down + swing[down] / (swing[down] - swing[down + 1]))
    assert len(times) >= 20
    assert abs((times[19] - times[0]) / 19 / period - 1) < 0.005
    last = np.abs(swing[-int(1.05 * period / dt) :]).max()
    assert abs(last / angle - 1) < 0.01


def test_a_pendulum_that_is_put_back_on_its_circle_loses_amplitude():
    """Evolve and project, paper section 5: the arc is shorter than the way, so it swings less and less; turned, it does
    not."""
    start = 0.2 * np.array([[0, 0, 0], [np.sin(1.0), -np.cos(1.0), 0]])
    left = {}
    for way in ("turn", "project"):
        chains = RopeChains.free([start], RopeConstants(**QUIET, substep=1.0, substep_limit=1, position_update=way))
        path, *_ = run(chains, start, 1 / 30, 900)
        left[way] = np.abs(np.arctan2(path[-90:, 1, 0], -path[-90:, 1, 1])).max()
    assert left["turn"] > 0.99 and left["project"] < 0.97


def double_pendulum(seconds, first, second, masses=(1.0, 4.0)):
    one, two = masses

    def rates(_, state):
        a, b, u, w = state
        matrix = np.array([[one + two, two * np.cos(a - b)], [two * np.cos(a - b), two]])
        sine = two * np.sin(a - b)
        force = [-(one + two) * GRAVITY * np.sin(a) - sine * w * w, -two * GRAVITY * np.sin(b) + sine * u * u]
        return [u, w, *np.linalg.solve(matrix, force)]

    times = np.linspace(0, seconds, 241)
    solved = solve_ivp(rates, (0, seconds), [first, second, 0, 0], "DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
    return solved.y[:2].T


def rope_angles(dt, seconds, first, second):
    points = np.array([[0, 0], [np.sin(first), -np.cos(first)], [0, 0]])
    points[2] = points[1] + [np.sin(second), -np.cos(second)]
    start = np.column_stack([points, np.zeros(3)])
    chains = RopeChains.free([start], constants(), [np.array([1.0, 1.0, 4.0])])
    path, *_ = run(chains, start, dt, round(seconds / dt))
    ropes = np.diff(path, axis=1)
    return np.arctan2(ropes[:, :, 0], -ropes[:, :, 1])


def test_a_double_pendulum_of_unequal_masses_follows_dop853_at_second_order():
    seconds, first, second = 2.0, 0.7, 1.0
    truth = double_pendulum(seconds, first, second)
    errors = {}
    for rate in (120, 240):
        angles = rope_angles(1 / rate, seconds, first, second)
        errors[rate] = np.abs(angles[:: rate // 120] - truth).max()
    assert errors[240] < 0.01 * np.abs(truth).max()
    assert 3.2 < errors[120] / errors[240] < 5


def swinging_chain(**changes):
    line = hanging(8, 0.08)
    line[:, [0, 1]] = line[:, [0, 1]] @ np.array([[0.6, -0.8], [0.8, 0.6]])
    side = line + [0, 0, 0.1]
    chains = RopeChains.free([line, side], RopeConstants(**changes))
    pairs = np.column_stack([np.arange(1, 8), np.arange(9, 16)]).astype(np.int32)
    chains = RopeChains(**(vars_of(chains) | {"pairs": pairs, "pair_spans": np.tile([0.1, 0.12], (7, 1))}))
    return chains, np.concatenate([line, side])


def vars_of(chains):
    return {name: getattr(chains, name) for name in type(chains).__dataclass_fields__}


ALL_FORCES = {"drag": 2.0, "parent_damping": 2.0, "lateral": 50.0, "shrink": 50.0, "rest_angle": 30.0, "friction": 0.3}


def shaken(t):
    return np.array([0.2 * np.sin(7 * t), 0.1 * np.sin(11 * t), 0.15 * np.cos(5 * t)])


def test_a_constant_velocity_of_the_whole_world_changes_nothing():
    kind, shape = round_cone_shape(np.array([-0.3, -0.35, -0.2]), np.array([0.3, -0.35, 0.3]), 0.1, 0.08)
    primitives = BodyPrimitives.from_primitives([(0, (kind, shape))], np.zeros((1, 3)))
    drift = np.array([3.0, -1.0, 2.0])
    paths = []
    for speed in (0 * drift, drift):
        chains, start = swinging_chain(**ALL_FORCES, wind=tuple(np.array([1.0, 0, 0]) + speed))

        def frames(t, speed=speed):
            return np.concatenate([np.eye(3), (shaken(t) * 0.2 + speed * t)[:, None]], axis=1)[None].copy()

        def roots(t, chains=chains, start=start, speed=speed):
            return start[chains.kinematic] + shaken(t) - shaken(0) + speed * t

        path, _, _, touched = run(
            chains,
            start,
            1 / 60,
            120,
            velocities=np.tile(speed, (16, 1)),
            roots=roots,
            primitives=primitives,
            frames=frames,
        )
        assert touched.any()
        paths.append(path - speed * (np.arange(121) / 60)[:, None, None])
    assert np.abs(paths[1] - paths[0]).max() < 1e-6


def test_turning_the_world_about_the_vertical_turns_the_result():
    angle = 1.1
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    kind, shape = round_cone_shape(np.array([-0.3, -0.35, -0.2]), np.array([0.3, -0.35, 0.3]), 0.1, 0.08)
    primitives = BodyPrimitives.from_primitives([(0, (kind, shape))], np.zeros((1, 3)))
    paths = []
    for spin in (np.eye(3), turn):
        chains, start = swinging_chain(**ALL_FORCES, wind=tuple(spin @ [1.0, 0, 0.5]))
        turned = start @ spin.T

        def frames(t, spin=spin):
            return np.concatenate([spin, (spin @ shaken(t) * 0.2)[:, None]], axis=1)[None].copy()

        def roots(t, chains=chains, turned=turned, spin=spin):
            return turned[chains.kinematic] + (shaken(t) - shaken(0)) @ spin.T

        path, *_ = run(chains, turned, 1 / 60, 60, roots=roots, primitives=primitives, frames=frames)
        paths.append(path @ spin)
    assert np.abs(paths[1] - paths[0]).max() < 1e-6


@pytest.mark.parametrize("rate", [120, 60, 30, 24])
def test_no_rope_is_longer_than_it_may_be_on_a_violently_moving_root(rate):
    chains, start = swinging_chain(**ALL_FORCES)

    def roots(t):
        way = 0.4 * np.array([np.sin(31 * t), np.sin(23 * t), np.cos(41 * t)])
        return start[chains.kinematic] + way - 0.4 * np.array([0, 0, 1])

    path, *_ = run(chains, start, 1 / rate, 3 * rate, roots=roots)
    assert np.isfinite(path).all()
    assert chains.excess(path).max() <= 1e-5


def test_same_input_gives_the_same_bits():
    runs = []
    for _ in range(2):
        chains, start = swinging_chain(**ALL_FORCES)
        runs.append(run(chains, start, 1 / 60, 60, roots=lambda t, start=start: start[[0, 8]] + shaken(t))[0].tobytes())
    assert runs[0] == runs[1]


def test_momentum_changes_by_gravity_alone_in_free_flight():
    chains, start = swinging_chain(lateral=80.0, shrink=60.0, rest_angle=40.0, drag=0.0, parent_damping=0.0)
    x = start + 0.02 * np.sin(np.arange(48)).reshape(16, 3)
    # roots fall with the rest, so that they pull at nothing
    path, speed, *_ = run(chains, x, 1 / 120, 1, roots=lambda t: x[[0, 8]] - [0, 0.5 * GRAVITY * t * t, 0])
    assert np.isfinite(path).all()
    slack = RopeChains(
        **(
            vars_of(chains)
            | {"lengths": chains.lengths * 3, "pairs": chains.pairs[2:], "pair_spans": chains.pair_spans[2:]}
        )
    )
    slack = RopeChains(**(vars_of(slack) | {"constants": RopeConstants(**(QUIET | {"lateral": 80.0}))}))
    _, speed, *_ = run(slack, x, 1 / 120, 4)
    free = [i for i in range(16) if i not in (0, 8)]
    np.testing.assert_allclose(speed[-1][free].sum(0), [0, -GRAVITY * 4 / 120 * 14, 0], atol=1e-10)


THIN = 0.01


def crossed(choice, **changes):
    """A bead thrown downward through a thin horizontal capsule within one step."""
    kind, shape = round_cone_shape(np.array([-1.0, 0, 0]), np.array([1.0, 0, 0]), THIN, THIN)
    primitives = BodyPrimitives.from_primitives([(0, (kind, shape))], np.zeros((1, 3)))
    start = np.array([[0, 1.0, 0], [0, 0.05, 0]])
    options = QUIET | {"gravity": (0, 0, 0), "substep": 1.0, "position_push": choice} | changes
    chains = RopeChains.free([start], RopeConstants(**options))
    chains = RopeChains(**(vars_of(chains) | {"lengths": np.array([0, 5.0])}))
    return chains, primitives, start


@pytest.mark.parametrize("speed", [-0.056 * 60, -0.4 * 60])
@pytest.mark.parametrize("choice", ["history", "slide"])
def test_history_leaves_a_thin_capsule_on_the_side_of_entry(choice, speed):
    chains, primitives, start = crossed(choice)
    thrown = np.array([[0, 0, 0], [0, speed, 0]])
    path, velocity, _, touched = run(chains, start, 1 / 60, 1, velocities=thrown, primitives=primitives)
    assert touched[0, 1]
    assert path[1, 1, 1] == pytest.approx(THIN, abs=1e-6)
    assert velocity[1, 1, 1] >= -1e-12


def test_gradient_leaves_a_thin_capsule_on_the_far_side():
    chains, primitives, start = crossed("gradient")
    path, *_ = run(
        chains, start, 1 / 60, 1, velocities=np.array([[0, 0, 0], [0, -0.056 * 60, 0]]), primitives=primitives
    )
    assert path[1, 1, 1] == pytest.approx(-THIN, abs=1e-6)


@pytest.mark.parametrize("choice", ["history", "slide"])
def test_a_capsule_that_sweeps_over_a_resting_bead_takes_it_along(choice):
    chains, primitives, start = crossed(choice)

    def way(t):
        return np.concatenate([np.eye(3), [[0], [6.0 * t], [0]]], axis=1)[None].copy()

    path, velocity, *_ = run(chains, start, 1 / 60, 2, primitives=primitives, frames=way)
    assert path[2, 1, 1] == pytest.approx(0.2 + THIN, abs=1e-6)
    assert velocity[2, 1, 1] == pytest.approx(6.0, abs=1e-9)


@pytest.mark.parametrize(("friction", "sticks"), [(0.2, False), (0.6, True)])
def test_a_bead_on_a_slope_slides_only_where_friction_is_below_its_tangent(friction, sticks):
    slope = np.radians(22)
    along = np.array([np.cos(slope), -np.sin(slope), 0.0])
    up = np.array([np.sin(slope), np.cos(slope), 0.0])
    kind, shape = round_cone_shape(-50 * along, 50 * along, 1.0, 1.0)
    primitives = BodyPrimitives.from_primitives([(0, (kind, shape))], np.zeros((1, 3)))
    start = np.stack([5 * up, up * (1.0 + 1e-9)])
    chains = RopeChains.free([start], constants(friction=friction))
    chains = RopeChains(**(vars_of(chains) | {"lengths": np.array([0, 50.0])}))
    path, *_ = run(chains, start, 1 / 120, 120, primitives=primitives)
    slid = (path[-1, 1] - start[1]) @ along
    free = 0.5 * GRAVITY * (np.sin(slope) - friction * np.cos(slope))
    if sticks:
        assert abs(slid) < 1e-3
    else:
        assert slid == pytest.approx(free, rel=0.05)


def test_wild_input_stays_finite_and_outside():
    rng = np.random.default_rng(3)
    chains, start = swinging_chain(**ALL_FORCES)
    kind, shape = round_cone_shape(np.array([-0.2, -0.3, 0]), np.array([0.3, -0.2, 0.1]), 0.15, 0.05)
    primitives = BodyPrimitives.from_primitives([(0, (kind, shape))], np.zeros((1, 3)))
    x, v, tensions = start + rng.normal(0, 3, start.shape), rng.normal(0, 1e4, start.shape), rng.normal(0, 1e6, 16)
    x[9] = x[10] = x[8]
    for k in range(30):
        dt = float(rng.choice([1e-5, 1 / 60, 1.0]))
        roots = start[chains.kinematic] + rng.normal(0, 5, (2, 3))
        motion = np.stack([x[chains.kinematic], roots, rng.normal(0, 300, (2, 3)), rng.normal(0, 300, (2, 3))])
        spin = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        spin *= np.sign(np.linalg.det(spin))
        frame = np.concatenate([spin, rng.normal(0, 1, (3, 1))], axis=1)[None].copy()
        last = frame if k == 0 else last
        x, v, tensions, _ = chains.advance(
            x, v, tensions, motion, dt, colliders=primitives.colliders, frames=(last, frame)
        )
        last = frame
        assert np.isfinite(x).all() and np.isfinite(v).all() and np.isfinite(tensions).all()
        assert chains.excess(x).max() <= 0.2 + 1e-9


def test_gauss_seidel_comes_to_the_direct_solution():
    line = hanging(9, 0.1)
    line[:, 0] = 0.03 * np.arange(9)
    ends = {}
    for sweeps in (0, 1, 10, 400):
        chains = RopeChains.free([line], constants(tension_sweeps=sweeps, impulse_sweeps=sweeps))
        path, *_ = run(chains, line, 1 / 120, 60)
        assert chains.excess(path).max() <= 1e-5
        ends[sweeps] = path[-1]
    away = {sweeps: np.abs(ends[sweeps] - ends[0]).max() for sweeps in (1, 10, 400)}
    assert away[400] < 1e-5 < away[10] < away[1]


def test_one_cold_sweep_leaves_the_top_rope_with_one_weight_and_warm_starts_mend_it():
    line = hanging(15)
    chains = RopeChains.free([line], constants(tension_sweeps=1))
    _, _, cold, _ = run(chains, line, 1 / 60, 1)
    assert cold[1] < 3 * GRAVITY
    _, _, warm, _ = run(chains, line, 1 / 60, 600)
    assert warm[1] == pytest.approx(14 * GRAVITY, rel=0.01)


def test_a_thrown_up_bead_leaves_its_taut_rope_at_once():
    start = np.array([[0, 0, 0], [0, -1.0, 0]])
    chains = RopeChains.free([start], constants())
    path, *_ = run(chains, start, 1 / 60, 12, velocities=np.array([[0, 0, 0], [0, 2.0, 0]]))
    t = np.arange(13) / 60
    np.testing.assert_allclose(path[:, 1, 1], -1 + 2 * t - 0.5 * GRAVITY * t * t, atol=1e-12)


@pytest.mark.parametrize(
    ("rate", "swings"), [(60, (9, 7)), (30, (9, 7)), (120, (9, 7)), (24, (9, 7)), (60, (5, 7)), (60, (15, 11))]
)
def test_excess_after_contact_is_gone_within_three_frames(rate, swings):
    chains, start = swinging_chain(**ALL_FORCES)
    kind, shape = round_cone_shape(np.array([-0.4, -0.2, 0.05]), np.array([0.4, -0.2, 0.05]), 0.06, 0.06)
    primitives = BodyPrimitives.from_primitives([(0, (kind, shape))], np.zeros((1, 3)))

    def way(t):
        shift = [[2.0 * np.sin(swings[0] * t)], [0.3 * np.sin(swings[1] * t)], [0]]
        return np.concatenate([np.eye(3), shift], axis=1)[None].copy()

    path, _, _, touched = run(chains, start, 1 / rate, 4 * rate, primitives=primitives, frames=way)
    excess = chains.excess(path[1:])
    # beyond a fifth a push-out is given up for a free place within the rope's length
    assert touched.any() and excess.max() <= 0.2 + 1e-9
    for k, nodes in enumerate(path[1:, chains.parents >= 0], 1):
        assert primitives.distances(nodes, way(k / rate))[0].min() >= chains.constants.margin - 2e-9
    free = ~touched & ~np.roll(touched, 1, axis=1)
    assert excess[free].max() <= 1e-5
    quiet = np.lib.stride_tricks.sliding_window_view(touched.any(1), 3).any(1)
    assert (~quiet).any() and excess[2:][~quiet].max() <= 1e-5


def test_a_rope_whose_node_above_is_buried_deeper_than_its_length_leaves_the_body_all_the_same():
    kind, shape = round_cone_shape(np.zeros(3), np.zeros(3), 0.5, 0.5)
    primitives = BodyPrimitives.from_primitives([(0, (kind, shape))], np.zeros((1, 3)))
    line = hanging(3) + [0.1, 0, 0]
    chains = RopeChains.free([line], constants())
    path, *_ = run(chains, line, 1 / 60, 10, primitives=primitives)
    assert np.linalg.norm(path[1:, 1:], axis=-1).min() >= 0.5 - 2e-9
    # no place within the length is free; that of the node below is, as soon as the one above it is out
    assert chains.excess(path[1:])[:, 1].min() > 0.2 >= chains.excess(path[1:])[:, 2].max()


@pytest.mark.parametrize("dt", [1 / 24, 1 / 8, 1 / 4])
def test_a_long_frame_is_as_fine_as_the_short_ones_that_it_stands_for(dt):
    """The number of substeps is limited for a frame of 1/24 s; a frame that stands for six of those may take six times
    as many. With fewer, a chain whose root is shaken would be thrown about.
    """
    line = hanging(8, 0.05)
    chains = RopeChains.free([line], RopeConstants(**QUIET))
    shaken = 100 * GRAVITY
    assert chains.substeps(1 / 24, shaken) == chains.constants.substep_limit  # or the limit is not what counts
    assert chains.substeps(dt, shaken) == round(24 * dt) * chains.constants.substep_limit


@pytest.mark.parametrize("dt", [1 / 8, 1 / 4])
def test_a_long_frame_swings_as_many_short_ones_do(dt):
    angle = np.radians(40)
    rope = np.array([np.sin(angle), -np.cos(angle), 0.0])
    start = 0.05 * np.arange(7)[:, None] * rope
    chains = RopeChains.free([start], RopeConstants(**QUIET))
    fine, long = (run(chains, start, step, round(0.5 / step))[0][-1] for step in (1 / 480, dt))
    np.testing.assert_allclose(long, fine, atol=0.01)

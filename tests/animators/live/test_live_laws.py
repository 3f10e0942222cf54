"""What a garment that is simulated in real time must do, whatever the body does. The contract runs on it, too."""

import numpy as np
import pytest

from hemline import garments, motions
from hemline.animators.live import Live, LiveConfig
from hemline.animators.live.model import CLOSE_STRETCH
from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.simulated_proxy import SLACK, trail_behind
from hemline.animators.teleport import is_teleport
from hemline.errors import SimulationFailed
from hemline.meshes import edge_strains
from hemline.motions.motion import Pose
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix
from hemline.playback import Player, play
from hemline.sim.small_steps.spring_cloth import SpringCloth
from hemline.sim.step.dressed_body import DressedBody
from tests.animators import made_coarse as made

DT = 1 / 30


def put(pose, way=(0.0, 0.0, 0.0), yaw=0.0):
    """The same pose elsewhere, turned about the vertical."""
    rotations = pose.rotations.astype(np.float64)
    rotations[0] = multiply(from_axis_angle(np.array([0.0, yaw, 0.0])), rotations[0])
    return Pose(rotations, pose.translation + np.float32(way))


@pytest.fixture(scope="module")
def poses():
    motion = made.body().placed(motions.load("run"))
    return [motion[index] for index in range(6)]


@pytest.fixture(scope="module")
def run(poses):
    """The cape on some frames of a run."""
    live = made.live_cape()
    state = live.start(made.body().posed(poses[0]))
    for pose in poses[1:]:
        state, vertices = live.step(state, made.body().posed(pose), DT)
    return state, vertices


def stretched(animator, vertices):
    """How much too long the edges are: p99. Shorter than cut is how cloth folds between coarse vertices."""
    garment = animator.garment
    return float(np.percentile(edge_strains(vertices, garment.faces, garment.rest_edges), 99))


def test_at_rest_it_stays_as_it_has_settled():
    live, posed = made.exact_cape(), made.body().posed(made.body().rest_pose)
    state = live.start(posed)
    before = state.cloth.positions.copy()
    for _ in range(5):
        state, _ = live.step(state, posed, DT)
    assert np.linalg.norm(state.cloth.positions - before, axis=1).mean() < 2e-3


def test_a_body_that_is_put_elsewhere_takes_its_cloth_along(run, poses):
    state, vertices = run
    there = made.body().posed(put(poses[-1], (40.0, 0.0, -7.0), 2.0))
    after, moved = made.live_cape().step(state, there, DT)
    stays, still = made.live_cape().step(state, made.body().posed(poses[-1]), DT)
    way = RigidTransform.between(made.body().posed(poses[-1]).transforms[0], there.transforms[0])
    # poses are float32 at 40 m from the origin
    assert np.linalg.norm(moved - way.points(still), axis=1).mean() < 1e-3
    assert np.linalg.norm(after.cloth.velocities - way.vectors(stays.cloth.velocities), axis=1).mean() < 0.05
    assert np.linalg.norm(still - vertices, axis=1).max() < 0.3


@pytest.mark.parametrize(
    ("way", "yaw", "seconds", "expected"),
    [
        ((0.3, 0, 0), 0.0, DT, False),  # a fast run
        ((1.2, 0, 0), 0.0, DT, True),
        ((1.2, 0, 0), 0.0, 0.2, False),  # the same in a longer time
        ((0, 0, 0), 2.5, DT, True),
        ((0, 0, 0), 2.5, 0.5, False),
    ],
)
def test_which_motions_are_teleports(way, yaw, seconds, expected):
    pose = made.body().rest_pose
    assert is_teleport(pose, put(pose, way, yaw), seconds) == expected


def test_rigid_motions_of_a_joint():
    turn = to_matrix(from_axis_angle(np.array([0.2, 1.0, -0.4])))
    first = np.concatenate([np.eye(3), [[0.0], [1.0], [0.0]]], axis=1)
    second = np.concatenate([turn, [[2.0], [0.0], [1.0]]], axis=1)
    way, points = RigidTransform.between(first, second), np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(way.points(points @ first[:, :3].T + first[:, 3]), points @ turn.T + second[:, 3])
    np.testing.assert_allclose(way.vectors(points), points @ turn.T)
    np.testing.assert_allclose(way.back(way.points(points)), points)
    pose = Pose(np.tile(from_axis_angle(np.array([0.5, 0.1, 0.0])), (24, 1)), points[0])
    back, level = way.pose_back(pose), from_axis_angle(np.array([0.2, 1.0, -0.4]))
    np.testing.assert_allclose(multiply(level, back.rotations[0].astype(np.float64)), pose.rotations[0], atol=1e-6)
    np.testing.assert_allclose(way.points(back.translation), pose.translation, atol=1e-6)


@pytest.mark.parametrize("dt", [1e-6, 1 / 500, 0.09, 30.0])
def test_any_time_is_taken(run, poses, dt):
    state, vertices = run
    _, after = made.live_cape().step(state, made.body().posed(poses[-1]), dt)
    assert np.isfinite(after).all()
    assert np.linalg.norm(after - vertices, axis=1).max() < 0.6


@pytest.mark.parametrize("exact", [False, True])
def test_where_no_step_can_be_taken_the_cloth_is_carried_and_comes_back_to_its_drape(poses, exact, monkeypatch):
    def fails(*args, **options):
        raise SimulationFailed("a step")

    live = made.exact_cape() if exact else made.live_cape()
    state = live.start(made.body().posed(poses[0]))
    state, _ = live.step(state, made.body().posed(poses[1]), DT)
    with monkeypatch.context() as patch:
        patch.setattr(DressedBody, "simulate_frame", fails)
        patch.setattr(SpringCloth, "advance", fails)
        once, _ = live.step(state, made.body().posed(poses[0]), DT)
        lost = once
        for index in range(6):
            lost, vertices = live.step(lost, made.body().posed(put(poses[0], (0.1 * index, 0, 0))), DT)
    assert (once.failed_frames, lost.failed_frames) == (1, 7)
    assert np.isfinite(vertices).all() and np.isfinite(lost.cloth.velocities).all()
    # all the way: as it settled, on the neck
    neck = made.body().posed(lost.pose).transforms[12].astype(np.float64)
    drape = live.rest @ neck[:, :3].T + neck[:, 3]
    apart = np.linalg.norm(lost.cloth.positions - drape, axis=1)
    assert np.median(apart) < 1e-3  # but for what the projection moves
    again, _ = live.step(lost, made.body().posed(put(poses[0], (0.5, 0, 0))), DT)
    assert again.failed_frames == 0


@pytest.mark.parametrize("exact", [False, True])
def test_far_from_the_origin_it_moves_as_it_does_near_it(poses, exact):
    """A kilometre away; the local origin follows the body."""
    live, ends = made.exact_cape() if exact else made.live_cape(), []
    for way in ((0.0, 0.0, 0.0), (1000.0, 0.0, 0.0)):
        state = live.start(made.body().posed(poses[0]))
        # the body runs there in steps that are too long to be simulated
        for step in range(1, 17):
            state, _ = live.step(state, made.body().posed(put(poses[0], np.array(way) * step / 16)), 1.0)
        for pose in poses[1:3]:
            state, vertices = live.step(state, made.body().posed(put(pose, way)), DT)
        ends.append(vertices.astype(np.float64) - way)
    assert np.linalg.norm(ends[1] - ends[0], axis=1).mean() < 0.02


def test_a_pose_that_jumps_makes_no_mess(run, poses):
    """From a run into a T-pose and back from one frame to the next."""
    live, (state, _) = made.live_cape(), run
    t_pose = Pose(np.tile([1.0, 0, 0, 0], (24, 1)), poses[-1].translation)
    for pose in (t_pose, poses[-1], t_pose, poses[-1]):
        state, vertices = live.step(state, made.body().posed(pose), DT)
        assert np.isfinite(vertices).all()
        assert np.linalg.norm(vertices - pose.translation, axis=1).max() < 2.5


def test_wind_blows_the_cloth_its_way():
    still = made.live_cape()
    windy = Live(LiveConfig(fewest=150, most=200, wind=(0.0, 0.0, -8.0))).animator_for(still.garment, made.body())
    posed, ends = made.body().posed(made.body().rest_pose), []
    for live in (still, windy):
        state = live.start(posed)
        for _ in range(8):
            state, vertices = live.step(state, posed, DT)
        ends.append(vertices)
    assert (ends[1] - ends[0])[:, 2].mean() < -0.02


def test_a_shirt_on_a_body_that_stops_in_a_dance_comes_to_rest():
    """It lies close as a whole, so one loop holds it near the skin; whole cloth and cover would tremble."""
    shirt = Live().animator_for(garments.load("tshirt-light"), made.body())
    assert shirt.close and shirt.stretch_limit == CLOSE_STRETCH
    player, motion, moved = Player.prepare(shirt, made.body()), motions.load("dance"), []
    assert player.whole is None and len(player.close) == 1
    state = player.start(motion[0])
    for frame in range(1, 52):
        state, shown = player.step(state, motion[frame], DT)
    for frame in range(60):
        last, (state, shown) = shown, player.step(state, motion[51], DT)
        if frame >= 45:
            moved.append(np.linalg.norm(shown.vertices - last.vertices, axis=1))
    assert np.mean(moved) < 2e-5


def test_what_trembles_is_not_shown_to_move():
    """Cloth is shown at most a millimetre behind, and where it moves back and forth by less, it stands still."""
    rng = np.random.default_rng(0)
    place = rng.normal(size=(50, 3))
    shown = place.copy()
    for _ in range(20):
        positions = place + 0.4 * SLACK * rng.uniform(-1, 1, size=place.shape)
        after = trail_behind(shown, positions)
        assert np.array_equal(after, shown)
        shown = after
    moving = shown.copy()
    for frame in range(30):
        after = trail_behind(moving, place + [0.0, 0.0, 0.01 * frame])
        assert np.linalg.norm(after - (place + [0.0, 0.0, 0.01 * frame]), axis=1).max() < SLACK * (1 + 1e-6)
        assert np.linalg.norm(after - moving, axis=1).max() < 0.01 + 2 * SLACK
        moving = after
    np.testing.assert_allclose(place[:, 2] + 0.29 - moving[:, 2], SLACK, rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "clip"),
    [
        ("cape-light", "kick"),
        ("cape-light", "dance"),
        ("skirt-light", "kick"),
        ("skirt-light", "dance"),
        ("dress-light", "kick"),
        ("dress-light", "dance"),
    ],
)
def test_nothing_explodes_in_600_frames(name, clip):
    live, played = Live().animator_for(garments.load(name), made.body()), 0
    motion = made.body().untangle_motion(motions.load(clip))  # as `hemline animate` plays it
    fps = max(30.0, 600 / motion.seconds)
    for frame in play(live, made.body(), motion, fps=fps):
        played += 1
        assert np.isfinite(frame.vertices).all()
        assert stretched(live, frame.vertices) < 0.3
    assert played >= 590

"""What cloth that is simulated in small steps does on a body: laws, and the offline simulator as a second route."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.animators.live import Live
from hemline.collide import inside
from hemline.errors import SimulationFailed
from hemline.meshes import edge_strains
from hemline.motions.motion import Pose
from hemline.sim.settings import SimSettings
from hemline.sim.small_steps.spring_cloth import SpringCloth, SpringState
from hemline.sim.step.dressed_body import DressedBody, make_garment_sheet
from tests.animators import made_coarse as made

FRAME = 1 / 30
SETTINGS = SimSettings(substeps=64)


@pytest.fixture(scope="module")
def body():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def cape():
    """The proxy of a light cape, 200 vertices, and where it has settled."""
    live = made.live_cape()
    return live.coarse[0], live.rest.astype(np.float64)


@pytest.fixture(scope="module")
def shirt(body):
    """The proxy of a light T-shirt, which has no pins, and where it has settled."""
    live = Live().animator_for(garments.load("tshirt-light"), body)
    return live.coarse[0], live.rest.astype(np.float64)


def elsewhere(pose, way):
    return Pose(pose.rotations, pose.translation + np.float32(way))


def play(cloth, body, poses, positions, seconds=FRAME):
    state, before = cloth.start(positions), body.posed(poses[0])
    for pose in poses[1:]:
        after = body.posed(pose)
        state = cloth.advance(state, before, after, seconds)
        before = after
    return state


def test_it_falls_as_things_fall(body, shirt):
    """Without air, and far above the body: g t^2 / 2, in frames of two lengths."""
    garment, rest = shirt
    cloth = SpringCloth(garment, body, replace(SETTINGS, air_density=0.0))
    start, pose = rest + [0.0, 3.0, 0.0], body.rest_pose
    for frames in (6, 24):
        state = play(cloth, body, [pose] * (frames + 1), start, 0.2 / frames)
        fallen = np.average(state.positions - start, axis=0, weights=make_garment_sheet(garment).mass)
        assert fallen[1] == pytest.approx(-0.5 * 9.81 * 0.2**2, rel=0.01)
        assert np.abs(fallen[[0, 2]]).max() < 1e-4
        assert state.time == pytest.approx(0.2)


def test_a_body_and_its_cloth_that_move_evenly_do_not_notice_it(body, cape):
    garment, rest = cape
    cloth, pose, speed = (
        SpringCloth(garment, body, replace(SETTINGS, air_density=0.0)),
        body.rest_pose,
        np.array([2.0, 0, 1]),
    )
    ends = []
    for way in (np.zeros(3), speed):
        state = replace(cloth.start(rest), velocities=np.tile(way, (len(rest), 1)))
        before = body.posed(pose)
        for frame in range(1, 7):
            after = body.posed(elsewhere(pose, way * frame * FRAME))
            state = cloth.advance(state, before, after, FRAME)
            before = after
        ends.append((state.positions - way * 6 * FRAME, state.velocities - way))
    assert np.linalg.norm(ends[1][0] - ends[0][0], axis=1).mean() < 5e-4
    assert np.linalg.norm(ends[1][1] - ends[0][1], axis=1).mean() < 0.02


def test_it_hangs_a_little_lower_than_the_exact_cloth_and_comes_to_rest(body, cape):
    garment, rest = cape
    cloth = SpringCloth(garment, body, SETTINGS)
    state = play(cloth, body, [body.rest_pose] * 61, rest)
    low = np.argsort(rest[:, 1])[:20]
    lower, length = (rest - state.positions)[low, 1].mean(), np.ptp(rest[:, 1])
    assert 0 < lower < 0.01 * length
    assert np.linalg.norm(state.velocities, axis=1).mean() < 0.01
    assert not inside(body.posed(body.rest_pose).vertices, body.body.faces, state.positions.astype(np.float32)).any()


def test_what_lies_on_the_shoulders_stays_there(body, shirt):
    """A T-shirt has no pins: friction and contact carry it."""
    garment, rest = shirt
    cloth, posed = SpringCloth(garment, body, SETTINGS), body.posed(body.rest_pose)
    state = play(cloth, body, [body.rest_pose] * 61, rest)
    assert np.median(np.linalg.norm(state.positions - rest, axis=1)) < 0.005
    assert inside(posed.vertices, posed.faces, state.positions.astype(np.float32)).mean() < 0.002


def test_it_moves_as_the_offline_simulator_moves_it(body):
    """Half a second of a run from standing; carried by the key joint alone it would miss by several times as much."""
    motion, ends = body.placed(motions.load("run")), []
    for live in (made.live_cape(), made.exact_cape()):
        state = live.start(body.posed(motion[0]))
        for frame in range(1, 16):
            state, vertices = live.step(state, body.posed(motion[frame]), FRAME)
        ends.append(vertices)
    key = body.posed(motion[15]).transforms[12]
    carried = live.garment.vertices @ key[:, :3].T + key[:, 3]
    error = np.linalg.norm(ends[0] - ends[1], axis=1).mean()
    assert error < 0.2 * np.linalg.norm(carried - ends[1], axis=1).mean()
    assert error < 0.05


def test_the_same_input_gives_the_same_bits_and_a_state_is_not_changed(body, cape):
    garment, rest = cape
    motion, ends = body.placed(motions.load("run")), []
    for _ in range(2):
        cloth = SpringCloth(garment, body, SETTINGS)
        state = play(cloth, body, [motion[frame] for frame in range(4)], rest)
        kept = [each.copy() for each in (state.positions, state.velocities, state.faces)]
        for _ in range(2):
            after = cloth.advance(state, body.posed(motion[3]), body.posed(motion[4]), FRAME)
            ends.append(after.positions)
        for now, before in zip((state.positions, state.velocities, state.faces), kept, strict=True):
            np.testing.assert_array_equal(now, before)
    for end in ends[1:]:
        np.testing.assert_array_equal(end, ends[0])


def test_wind_carries_it_as_far_as_the_offline_simulator_says(body, cape):
    garment, rest = cape
    windy = replace(SETTINGS, wind=(0.0, 0.0, -5.0))
    fast = play(SpringCloth(garment, body, windy), body, [body.rest_pose] * 13, rest).positions
    dressed = DressedBody(garment, body, replace(windy, substeps=4, self_contact=False))
    state = dressed.stepper.start(rest)
    for _ in range(12):
        state = dressed.simulate_frame(state, body.rest_pose, body.rest_pose).state
    moved = [(each - rest)[:, 2].mean() for each in (fast, state.positions)]
    assert moved[1] < -0.02
    assert moved[0] == pytest.approx(moved[1], rel=0.15)


def test_pins_that_jump_by_a_metre_make_no_mess(body, cape):
    garment, rest = cape
    cloth, pose = SpringCloth(garment, body, SETTINGS), body.rest_pose
    away = elsewhere(pose, [0.7, 0.7, 0.0])
    state = play(cloth, body, [pose] + [away] * 10, rest)
    # it flies on by its length, and is whole
    assert np.linalg.norm(state.positions - rest - [0.7, 0.7, 0.0], axis=1).max() < 2.0
    assert np.percentile(edge_strains(state.positions, garment.faces, garment.rest_edges), 99) < 0.1
    assert np.abs(state.velocities).max() < 20


def test_cloth_that_is_not_finite_is_an_error(body, cape):
    garment, rest = cape
    cloth, posed = SpringCloth(garment, body, SETTINGS), body.posed(body.rest_pose)
    state = cloth.start(rest)
    broken = SpringState(rest, np.full_like(rest, np.nan), state.faces)
    with pytest.raises(SimulationFailed, match="positions of the cloth must be finite"):
        cloth.advance(broken, posed, posed, FRAME)

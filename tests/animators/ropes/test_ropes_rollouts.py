"""Training of learned bones, on bones that hang on springs behind a body that turns and walks."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies
from hemline.animators.ropes.bones.body_inputs import BODY_INPUT_COUNT, REST_INPUTS, BodyAtRest, body_inputs
from hemline.animators.ropes.bones.learned_bones import LearnedBones, LearnedBonesState
from hemline.animators.ropes.config import RopesConfig
from hemline.animators.ropes.fit.sequences import Sequences
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.errors import BadDataset
from hemline.motions.quaternions import multiply

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
KEY, H, FRAMES = 12, 1 / 30, 90
REST = np.array([[x, 1.2 - 0.3 * k, -0.3 - 0.05 * k] for x in (-0.2, 0.2) for k in range(3)])
"""Free bones at rest behind the neck [m]."""
SMALL = RopesConfig(
    bones_hidden=48,
    bones_epochs=16,
    bones_batch=16,
    rollout_frames=10,
    rollout_noise=0.005,
    body_noise=0.05,
    checkpoint_epochs=5,
    threads=1,
)
BRIEF = replace(SMALL, bones_epochs=4, checkpoint_epochs=2)


def shaped():
    return bodies.load("anny24").shaped()


def transforms(clip: int) -> np.ndarray:
    """The body turns from side to side while it goes, in each clip in another direction."""
    t, body = np.arange(FRAMES) / 30 + clip, shaped()
    rotations = np.repeat(body.rest_pose.rotations[None], FRAMES, axis=0).astype(np.float64)
    half = 0.4 * np.sin((2 + 0.2 * clip) * t)
    turn = np.stack([np.cos(half), 0 * t, np.sin(half), 0 * t], axis=1)
    rotations[:, 0] = multiply(turn, rotations[:, 0])
    travel = np.stack([0.2 * np.sin(1.5 * t), 0.05 * np.sin(5 * t), 0.7 * t], axis=1)
    places = (body.rest_pose.translation + travel).astype(np.float32)
    return body.transforms_of(rotations.astype(np.float32), places)[0].astype(np.float64)


def on_springs(frames: np.ndarray) -> np.ndarray:
    """Bones (frames, free, 3) pulled to where they would hang by springs that stiffen [m]."""
    keys = frames[:, KEY]
    hung = np.einsum("fab,nb->fna", keys[:, :, :3], REST) + keys[:, None, :, 3]
    x, v, found = hung[0].copy(), np.zeros_like(hung[0]), [hung[0]]
    for k in range(1, len(frames)):
        for step in range(1, 9):
            goal = hung[k - 1] + (hung[k] - hung[k - 1]) * step / 8
            direction = goal - x
            v = v + ((60 + 6e4 * (direction * direction).sum(1, keepdims=True)) * direction - 6 * v) * H / 8
            x = x + v * H / 8
        found.append(x)
    return np.stack(found)


def sequences_of(clips: range) -> Sequences:
    body = BodyAtRest(KEY, shaped().joints.astype(np.float64))
    columns = []
    for clip in clips:
        frames = transforms(clip)
        keys, count = frames[:, KEY], len(frames)
        inputs = np.zeros((count, BODY_INPUT_COUNT))
        inputs[2:] = body_inputs(body, frames[:-2], frames[1:-1], frames[2:], H, H)
        bones = (on_springs(frames) - keys[:, None, :, 3]) @ keys[:, :, :3] - REST
        turns, shifts = np.zeros((count, 3, 3)), np.zeros((count, 3))
        turns[1:] = np.swapaxes(keys[1:, :, :3], 1, 2) @ keys[:-1, :, :3]
        shifts[1:] = np.einsum("fab,fa->fb", keys[1:, :, :3], keys[:-1, :, 3] - keys[1:, :, 3])
        first = FRAMES * (clip - clips.start)
        side = 0 if clip % 10 < 8 else clip % 10 - 7
        full = [np.full(count, each, np.int32) for each in (first, first + count - 1, side, 0)]
        columns.append((inputs, bones, turns, shifts, *full))
    inputs, bones, turns, shifts, *full = (np.concatenate(each) for each in zip(*columns, strict=True))
    floats = [each.astype(np.float32) for each in (inputs, bones, turns, shifts)]
    nothing = BodyPrimitives.none(24).colliders
    stacked = nothing._replace(shapes=nothing.shapes[None], centres=nothing.centres[None], pivots=nothing.pivots[None])
    still, rest = np.zeros((len(inputs), 24, 3, 4), np.float32), REST[None].astype(np.float32)
    margins = np.zeros(len(REST))
    return Sequences(*floats, *full[:3], rest, full[3], margins, still, stacked, H)


@pytest.fixture(scope="module")
def data() -> Sequences:
    return sequences_of(range(10))


def trained(data: Sequences, config: RopesConfig = SMALL, **others):
    from hemline.animators.ropes.fit.rollouts import train_rollouts

    given = {"seed": 0, "mark": "m", "progress": lambda *at: None, "folder": None} | others
    return train_rollouts(data, np.eye(3 * len(REST), dtype=np.float32), config, **given)


@pytest.fixture(scope="module")
def network(data):
    return trained(data)


def learned(trained) -> LearnedBones:
    return LearnedBones(np.eye(3 * len(REST), dtype=np.float32), *trained, H, 0.0)


def played(network, clip: int, frames: int = FRAMES) -> tuple[np.ndarray, np.ndarray]:
    """Bones that go on from the third simulated frame, and the simulated ones."""
    body, seen = BodyAtRest(KEY, shaped().joints.astype(np.float64)), transforms(clip)
    truth, bones, found = on_springs(seen), learned(network), []
    state = LearnedBonesState(truth[1:3], np.stack([seen[1], seen[2], seen[2]]), np.zeros(()))
    for frame in seen[3:frames]:
        made = bones.step(state, body, REST, np.zeros(len(REST)), BodyPrimitives.none(24).colliders, frame, H)
        state = made.state
        found.append(made.positions)
    return np.stack(found), truth[3:frames]


def test_what_plays_is_what_was_trained(data, network):
    from hemline.animators.ropes.fit.rollouts import RolloutObjective
    from hemline.learning.fit.network import through

    objective = RolloutObjective(data, np.eye(3 * len(REST), dtype=np.float32), SMALL, 0)
    layers = [tuple(map(torch.from_numpy, each)) for each in zip(network[0].weights, network[0].biases, strict=True)]
    objective.network = lambda inputs: through(layers, inputs)  # type: ignore[assignment]
    start = np.array([9 * FRAMES + 2])
    with torch.no_grad():
        rolled = objective.rollout(start, 40).numpy()[:, 0].reshape(40, -1, 3)
    found, _ = played(network, 9, 43)
    keys = transforms(9)[3:43, KEY]
    local = (found - keys[:, None, :, 3]) @ keys[:, :, :3] - REST
    np.testing.assert_allclose(local, rolled, atol=2e-4)


def test_on_an_unseen_clip_bones_stay_with_the_simulated_ones(network):
    for clip in (8, 9):
        found, truth = played(network, clip)
        keys = transforms(clip)[3:, KEY]
        stiff = np.einsum("fab,nb->fna", keys[:, :, :3], REST) + keys[:, None, :, 3]
        off, lag = (np.linalg.norm(each - truth, axis=2) for each in (found, stiff))
        assert off.mean() < 0.4 * lag.mean()
        assert off[-20:].mean() < 3 * off[20:40].mean() + 1e-3  # nor do they drift away


def test_the_drape_is_an_equilibrium_of_what_was_trained(network):
    seen = np.concatenate([REST_INPUTS, np.zeros(len(network[1]) - BODY_INPUT_COUNT, np.float32)])
    assert np.abs(network[0](seen)).max() < 1e-6
    assert ((network[1] <= seen) & (seen <= network[2])).all()
    body, still = BodyAtRest(KEY, shaped().joints.astype(np.float64)), shaped().posed(shaped().rest_pose).transforms
    bones, frame, shove = learned(network), still.astype(np.float64), np.array([0.03, 0.0, -0.03])
    for moved, most in ((0.0, 1e-4), (1.0, 1e-2)):
        state = LearnedBonesState(np.stack([REST, REST + moved * shove]), np.stack([frame] * 3), np.zeros(()))
        for _ in range(150):
            state = bones.step(
                state, body, REST, np.zeros(len(REST)), BodyPrimitives.none(24).colliders, frame, H
            ).state
        assert np.linalg.norm(state.positions[1] - REST, axis=1).max() < most


def test_rollouts_teach_more_than_the_line_that_they_begin_as(data, network):
    line = trained(data, replace(SMALL, bones_rate=0.0, bones_epochs=1))
    errors = [
        np.mean([np.linalg.norm(np.subtract(*played(each, k)), axis=2).mean() for k in (8, 9)])
        for each in (network, line)
    ]
    assert errors[0] < 0.8 * errors[1]


def test_a_killed_training_goes_on_to_the_same_end(tmp_path):
    data = sequences_of(range(6, 10))

    def killed(done, at):
        if done == at:
            raise KeyboardInterrupt

    for at in (3, 7, 11):
        with pytest.raises(KeyboardInterrupt):
            trained(data, BRIEF, folder=tmp_path, progress=lambda done, total, at=at: killed(done, at))
    seen = []
    end = trained(data, BRIEF, folder=tmp_path, progress=lambda done, total: seen.append((done, total)))
    assert seen[0] == (11, 12)
    for one, two in zip(trained(data, BRIEF)[0].weights, end[0].weights, strict=True):
        np.testing.assert_array_equal(one, two)


def test_takes_too_short_for_learned_bones_are_refused():
    from hemline.animators.ropes.fit import learn_bones

    assert sequences_of(range(2)).longest == FRAMES - 3
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(learn_bones, "SHORTEST_ROLLOUT", FRAMES)
        patch.setattr(learn_bones, "sequences", lambda *_, **__: sequences_of(range(2)))
        with pytest.raises(BadDataset, match="learned bones need takes of 93 frames.*got none longer than 90 frames"):
            learn_bones.learn_bones(None, None, SMALL, seed=0)  # type: ignore[arg-type]


def test_windows_have_two_frames_before_them_and_stay_within_their_take(data):
    for length in (1, 30):
        windows = data.windows(1, length)
        assert (data.side[windows] == 1).all()
        assert (data.first[windows] == data.first[windows - 2]).all()
        assert (data.last[windows] == data.last[windows + length]).all()
        assert len(windows) == FRAMES - 2 - length

"""A recurrent network for each chain, on bones that hang on springs behind a body that turns and goes."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.animators.ropes.bones.body_inputs import BodyAtRest
from hemline.animators.ropes.bones.bones import bones_of_mesh, rest_bones
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.errors import BadDataset
from hemline.learning.key_frame import to_key_frame
from hemline.motions import Pose
from hemline.motions.quaternions import multiply
from papers.rope_chains.baselines import ChainGrus
from papers.rope_chains.baselines.gru import WARM_UP, GruCells, chain_slots
from papers.rope_chains.baselines.motion_inputs import COLUMNS, MOTION_INPUT_COUNT, motion_inputs
from papers.rope_chains.baselines.sequences import Sequences

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
KEY, H, FRAMES = 12, 1 / 30, 90
REST = np.array([[x, 1.2 - 0.3 * k, -0.3 - 0.05 * k] for x in (-0.2, 0.2) for k in range(3)])
"""Free bones at rest behind the neck [m]."""
SLOTS = np.array([[0, 1, 2], [3, 4, 5]], np.int32)
TRAINED, HELD_OUT = range(8), (8, 9)


def options(**changes):
    from papers.rope_chains.baselines.gru_training import GruOptions

    small = GruOptions(hidden=24, epochs=150, batch=4, rate=1e-2, checkpoint_epochs=5)
    return replace(small, **changes)


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
    body, columns = BodyAtRest(KEY, shaped().joints.astype(np.float64)), []
    for clip in clips:
        frames = transforms(clip)
        keys, count = frames[:, KEY], len(frames)
        inputs = np.zeros((count, MOTION_INPUT_COUNT), np.float32)
        inputs[2:] = motion_inputs(body, frames[:-2], frames[1:-1], frames[2:], H)
        bones = (on_springs(frames) - keys[:, None, :, 3]) @ keys[:, :, :3] - REST
        first = FRAMES * (clip - clips.start)
        side = 0 if clip % 10 < 8 else clip % 10 - 7
        full = [np.full(count, each, np.int32) for each in (first, first + count - 1, side)]
        columns.append((inputs, bones.astype(np.float32), *full))
    return Sequences(*(np.concatenate(each) for each in zip(*columns, strict=True)), H)


@pytest.fixture(scope="module")
def data():
    return sequences_of(range(10))


def trained(data, **others) -> GruCells:
    from papers.rope_chains.baselines.gru_training import train_cells

    given = {"seed": 0, "mark": "m", "progress": lambda *at: None, "folder": None} | others
    return train_cells(data, SLOTS, given.pop("options", options()), **given)


@pytest.fixture(scope="module")
def cells(data) -> GruCells:
    return trained(data)


def played(cells: GruCells, data, clip: int) -> np.ndarray:
    """Bones of a whole clip after the warm-up, from a blank hidden state at its third frame [m]."""
    hidden, found = cells.initial_state, []
    for frame in range(FRAMES * clip + 3, FRAMES * (clip + 1)):
        hidden, moved = cells.step(hidden, data.body[frame])
        found.append(moved)
    return np.stack(found)[WARM_UP:]


def errors_mm(cells: GruCells, data, clips) -> tuple[float, float]:
    """Returns the errors of the networks and of the rigidly moved drape."""
    found, stiff = [], []
    for clip in clips:
        truth = data.bones[FRAMES * clip + 3 + WARM_UP : FRAMES * (clip + 1)]
        found.append(np.linalg.norm(played(cells, data, clip) - truth, axis=2).mean())
        stiff.append(np.linalg.norm(truth, axis=2).mean())
    return 1e3 * float(np.mean(found)), 1e3 * float(np.mean(stiff))


def test_a_step_is_that_of_torch(cells, data):
    random = np.random.default_rng(3)
    hidden = random.uniform(-1, 1, cells.initial_state.shape).astype(np.float32)
    body = data.body[40]
    after, moved = cells.step(hidden, body)
    x = torch.from_numpy((body - cells.mean) / cells.spread)
    for chain in range(len(SLOTS)):
        cell = torch.nn.GRUCell(len(body), hidden.shape[1])
        ours = (cells.input_weights, cells.hidden_weights, cells.input_bias, cells.hidden_bias)
        with torch.no_grad():
            for theirs, each in zip(cell.parameters(), ours, strict=True):
                theirs.copy_(torch.from_numpy(each[chain]))
            wanted = cell(x[None], torch.from_numpy(hidden[chain])[None])[0].numpy()
        np.testing.assert_allclose(after[chain], wanted, atol=1e-5)
        shown = cells.output_weights[chain] @ wanted + cells.output_bias[chain]
        np.testing.assert_allclose(moved[SLOTS[chain]].reshape(-1), shown, atol=1e-5)


def test_what_plays_is_what_was_trained(data):
    from papers.rope_chains.baselines.gru_training import GruObjective

    slots = np.array([[4, 5, -1, -1], [0, 1, 2, 3]], np.int32)  # of two lengths, in another order than the bones
    objective = GruObjective(data, slots, options(), 1)
    steps = FRAMES - 3 - WARM_UP
    with torch.no_grad():
        rolled = objective.roll_out(np.array([9 * FRAMES + 2]), steps).numpy()[:, :, 0].reshape(steps, *slots.shape, 3)
    found = played(objective.cells(), data, 9)
    np.testing.assert_allclose(found[:, [4, 5]], rolled[:, 0, :2], atol=1e-5)
    np.testing.assert_allclose(found[:, :4], rolled[:, 1], atol=1e-5)


def test_it_learns_the_clips_it_is_trained_on_and_is_worse_on_others(cells, data):
    known, stiff = errors_mm(cells, data, TRAINED)
    unseen, stiff_unseen = errors_mm(cells, data, HELD_OUT)
    print(f"trained on: {known:.1f} mm of {stiff:.1f}; held out: {unseen:.1f} mm of {stiff_unseen:.1f}")
    assert known < 0.3 * stiff
    assert unseen > 1.2 * known


def test_a_chain_does_not_depend_on_the_others(data):
    from papers.rope_chains.baselines.gru_training import GruObjective

    objective = GruObjective(data, SLOTS, options(), 0)
    random = np.random.default_rng(0)
    objective.wanted[:, 1] += 1.0
    one = torch.autograd.grad(objective.loss(objective.samples[:4], random, slice(None)), objective.parameters)
    objective.wanted[:, 1] -= 1.0
    other = torch.autograd.grad(objective.loss(objective.samples[:4], random, slice(None)), objective.parameters)
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a[0].numpy(), b[0].numpy())
    assert not np.array_equal(one[4][1].numpy(), other[4][1].numpy())


def test_a_killed_training_goes_on_to_the_same_end(data, tmp_path):
    def killed(done, total):
        if done == 7:
            raise KeyboardInterrupt

    short = options(epochs=12)
    whole = trained(data, options=short)
    with pytest.raises(KeyboardInterrupt):
        trained(data, options=short, folder=tmp_path, progress=killed)
    seen = []
    end = trained(data, options=short, folder=tmp_path, progress=lambda done, total: seen.append((done, total)))
    assert seen[0] == (6, 12)
    for name in ("input_weights", "hidden_weights", "output_weights", "output_bias"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(end, name))


def test_the_printed_networks_see_the_pose_and_no_velocity(data):
    from papers.rope_chains.baselines.gru_training import PRINTED, GruObjective

    seen = trained(data, options=options(inputs=PRINTED.inputs, epochs=1))
    assert seen.input_weights.shape[2] == len(seen.mean) == len(COLUMNS["pose"])
    # a body that only moves faster changes velocities and nothing else
    at_rest, frames = BodyAtRest(0, np.zeros((24, 3))), np.zeros((3, 24, 3, 4))
    frames[:, :, :, :3] = np.eye(3)
    frames[1, :, 2, 3], frames[2, :, 2, 3] = 0.1, 0.2
    slow = motion_inputs(at_rest, frames[0], frames[0], frames[0], H)
    fast = motion_inputs(at_rest, *frames, H)
    np.testing.assert_array_equal(slow[COLUMNS["pose"]], fast[COLUMNS["pose"]])
    assert not np.array_equal(slow, fast)
    objective = GruObjective(data, SLOTS, options(inputs=PRINTED.inputs), 0)
    assert objective.roll_out(objective.samples[:2], 3).shape[0] == 3


def test_a_training_can_be_limited_to_some_frames(data):
    from papers.rope_chains.baselines.gru_training import GruObjective

    every = GruObjective(data, SLOTS, options(), 0).samples
    some = GruObjective(data, SLOTS, options(frames=5 * options().window), 0).samples
    assert len(some) == 5 and set(some) <= set(every)
    assert some[0] == every[0] and some[-1] == every[-1]  # spread over all takes
    np.testing.assert_array_equal(GruObjective(data, SLOTS, options(frames=10**6), 0).samples, every)


def test_chains_are_found_from_root_to_tip():
    # an unattached bone, then chains of two and of one free bone
    parents = np.array([-1, -1, 1, 2, -1, 4])
    np.testing.assert_array_equal(chain_slots(parents), [[0, 1], [2, -1]])


def test_takes_shorter_than_a_window_are_refused(data):
    with pytest.raises(BadDataset, match="windows of 80 steps need takes of 98 frames.*got none longer than 90 frames"):
        trained(data, options=options(window=80))


def test_bones_of_a_garment_come_from_body_and_networks(cells):
    """Roots are where the body carries them; free bones are what the cells say, step by step, at any frame rate."""
    body = bodies.load("anny24").shaped()
    garment = garments.make_cape(body, rows=12, columns=14)
    garment = replace(garment, chains=tuple(tuple(14 * row + column for row in (1, 4, 7, 10)) for column in (3, 10)))
    ropes = build_ropes(garment, body)
    free, rest = ropes.parents >= 0, rest_bones(ropes, garment.vertices, body)
    np.testing.assert_array_equal(chain_slots(ropes.parents), SLOTS)
    grus = ChainGrus(ropes, cells, 1 / 30, COLUMNS["motion"])
    pose = body.rest_pose
    posed = [body.posed(pose), body.posed(Pose(pose.rotations, pose.translation + np.float32([0.05, 0, 0])))]
    start = grus.start(posed[0])
    hidden, bodies_before = start.hidden.copy(), start.bodies.copy()
    one, moved = grus.step(start, posed[1], 1 / 30, rest)
    _, again = grus.step(start, posed[1], 1 / 60, rest)
    np.testing.assert_array_equal(moved, again)
    np.testing.assert_array_equal(start.hidden, hidden)
    np.testing.assert_array_equal(start.bodies, bodies_before)
    wanted = to_key_frame(posed[1].transforms[ropes.key_index], bones_of_mesh(ropes, garment.vertices, posed[1])) - rest
    moved = moved.reshape(-1, 3)
    np.testing.assert_allclose(moved[~free], wanted[~free], atol=1e-5)
    still, now = (each.transforms.astype(np.float64) for each in posed)
    at_rest = BodyAtRest(ropes.key_index, body.joints.astype(np.float64))
    inputs = motion_inputs(at_rest, still, still, now, H)
    after, shown = cells.step(hidden, inputs)
    np.testing.assert_allclose(moved[free], shown, atol=1e-5)
    np.testing.assert_allclose(one.hidden, after, atol=1e-5)

"""Training of both networks, on a cape that sways by a formula."""

from dataclasses import replace

import numpy as np
import pytest

from hemline.animators.ropes.config import RopesConfig
from hemline.animators.ropes.fit.frames import KeyFrames
from hemline.animators.ropes.fit.learn import Learned, learn
from hemline.animators.ropes.fit.linear import SMALL_NOISE
from hemline.errors import BadInput, BadModel
from hemline.learning.collision import Clearances, shortfall
from hemline.learning.fit.batches import SMALLEST_DEVIATION
from hemline.learning.ridge import ridge
from tests.animators.swaying import NODES, VERTICES, swaying_frames

pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
SMALL = RopesConfig(
    components=12,
    shape_components=12,
    hidden=64,
    epochs=48,
    batch=64,
    collision_vertices=100,
    skinning_rate=3e-3,
    shape_rate=1e-3,
    second_columns=3,
    checkpoint_epochs=5,
    threads=1,
)


@pytest.fixture(scope="module")
def frames():
    return swaying_frames()


@pytest.fixture(scope="module")
def floor(frames) -> Clearances:
    """A wall behind the cape, which touches it nowhere but lies 4 mm behind every true vertex."""
    normals = np.zeros((len(frames.side), VERTICES, 3), np.float16)
    normals[..., 2] = 1
    return Clearances(normals, np.full(normals.shape[:2], 0.004, np.float16))


@pytest.fixture(scope="module")
def bulging(frames) -> KeyFrames:
    """The cape bulges between its bones, where they swing aside, to the left as to the right."""
    sideways = frames.bones.reshape(len(frames.side), -1, 3)[:, -1, 0]
    pattern = np.ones((VERTICES, 1)) * [0.0, 0.0, 0.3]
    pattern[NODES] = 0
    bulge = np.abs(sideways)[:, None, None] * pattern
    return replace(frames, displacements=frames.displacements + bulge.reshape(len(bulge), -1).astype(np.float32))


@pytest.fixture(scope="module")
def learned(frames, floor) -> Learned:
    return learn(frames, floor, SMALL, seed=0)


def played(learned: Learned, bones: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (frames, rows) after the first network, and after both."""
    first = learned.skinning.many(bones) @ learned.skinning_basis.unpack()
    return first, first + learned.shape.many(bones) @ learned.shape_basis.unpack()


def mean_mm(displacements: np.ndarray) -> float:
    return 1e3 * float(np.linalg.norm(displacements.reshape(len(displacements), -1, 3), axis=2).mean())


def test_fitting_brings_the_error_down_and_the_second_network_further(learned, frames):
    for side, chosen in (("train", frames.train), ("test", frames.test)):
        truth = frames.displacements[chosen]
        first, both = (truth - guess for guess in played(learned, frames.bones[chosen]))
        assert mean_mm(first) < mean_mm(truth) / 4, side
        assert mean_mm(both) < mean_mm(first), side


def test_figures_are_what_they_say(learned, frames):
    for side, chosen in (("train", frames.train), ("val", frames.val), ("test", frames.test)):
        first, both = (frames.displacements[chosen] - guess for guess in played(learned, frames.bones[chosen]))
        assert learned.figures[f"{side}_skinning_mm"] == pytest.approx(mean_mm(first), rel=1e-4)
        assert learned.figures[f"{side}_error_mm"] == pytest.approx(mean_mm(both), rel=1e-4)
        assert learned.figures[f"{side}_frames"] == len(chosen)


def line(frames, wanted: np.ndarray) -> np.ndarray:
    """Returns the output of a ridge regression from the bones for the training frames."""
    noise = np.where(frames.free > 0, SMALL.bone_noise, SMALLEST_DEVIATION)
    matrix, offset = ridge(frames.bones[frames.train], wanted.astype(np.float64), noise)
    return frames.bones[frames.train] @ matrix.T + offset


def test_first_basis_is_the_svd_of_what_a_line_says_of_the_truth(learned, frames):
    _, _, vectors = np.linalg.svd(line(frames, frames.displacements[frames.train]), full_matrices=False)
    basis = learned.skinning_basis.unpack()[:6]
    cosines = np.abs((basis * vectors[:6]).sum(axis=1) / np.linalg.norm(basis, axis=1))
    assert cosines.min() > 0.9995  # 8 bits


def test_second_basis_is_the_svd_of_what_a_line_says_of_what_the_trained_first_network_left(learned, frames):
    bones = frames.bones[frames.train]
    first, _ = played(learned, bones)
    matrix, offset = ridge(bones, first.astype(np.float64), np.full(bones.shape[1], SMALL_NOISE))
    said = line(frames, frames.displacements[frames.train]) - (bones @ matrix.T + offset)
    _, values, vectors = np.linalg.svd(said, full_matrices=False)
    basis = learned.shape_basis.unpack()
    apart = [k for k in range(6) if values[k + 1] < 0.97 * values[k] and (k == 0 or values[k] < 0.97 * values[k - 1])]
    assert len(apart) >= 3
    cosines = np.abs((basis * vectors[: len(basis)]).sum(axis=1) / np.linalg.norm(basis, axis=1))
    assert cosines[apart].min() > 0.999
    held = ((said @ basis.T) ** 2).sum() / (values[:12] ** 2).sum()
    assert held == pytest.approx(1, abs=2e-3)


def test_the_baseline_is_the_ridge_regression_from_bones_to_vertices(learned, frames):
    noise = np.where(frames.free > 0, SMALL.bone_noise, SMALLEST_DEVIATION)
    matrix, offset = ridge(frames.bones[frames.train], frames.displacements[frames.train], noise)
    for side, chosen in (("train", frames.train), ("val", frames.val), ("test", frames.test)):
        said = frames.bones[chosen] @ matrix.T + offset
        assert learned.figures[f"{side}_ridge_mm"] == pytest.approx(
            mean_mm(frames.displacements[chosen] - said), rel=1e-2
        )


def test_a_network_is_kept_where_it_finds_more_than_a_line(bulging):
    """Cloth between the bones bulges as these swing to either side: a training that does nothing fails here."""
    found, linear = learn(bulging, None, SMALL, seed=0), learn(bulging, None, replace(SMALL, epochs=0), seed=0)
    assert len(found.skinning.weights) == 3 and len(linear.skinning.weights) == len(linear.shape.weights) == 1
    for side in ("val", "test"):
        assert found.figures[f"{side}_error_mm"] < 0.8 * linear.figures[f"{side}_error_mm"], side


@pytest.mark.parametrize("rate", [0.0, 0.3])
def test_a_line_is_kept_where_training_finds_nothing(frames, rate):
    """Without a step, and with steps so wide that they only do harm, the result is the linear map."""
    idle = learn(frames, None, replace(SMALL, skinning_rate=rate, shape_rate=rate, epochs=2), seed=0)
    linear = learn(frames, None, replace(SMALL, epochs=0), seed=0)
    assert len(idle.skinning.weights) == len(idle.shape.weights) == 1
    assert idle.figures == linear.figures
    bones, truth = frames.bones[frames.train], frames.displacements[frames.train]
    basis = linear.skinning_basis.unpack()
    wanted = line(frames, truth @ basis.T)
    np.testing.assert_allclose(linear.skinning.many(bones), wanted, atol=2e-3 * np.abs(wanted).max())


def test_the_same_seed_gives_the_same_bits_and_another_does_not(learned, frames, floor):
    again = learn(frames, floor, SMALL, seed=0)
    other = learn(frames, floor, SMALL, seed=1)
    for one, two in zip(learned.skinning.weights, again.skinning.weights, strict=True):
        np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(learned.shape_basis.digits, again.shape_basis.digits)
    assert (other.skinning.weights[0] != learned.skinning.weights[0]).any()


def test_a_killed_training_goes_on_to_the_same_end(learned, frames, floor, tmp_path):
    def killed_at(stage, epoch):
        def progress(now, done, total):
            if (now, done) == (stage, epoch):
                raise KeyboardInterrupt

        return progress

    for stage, epoch in (
        ("skinning network", 17),
        ("skinning network", 44),
        ("shape network", 3),
        ("shape network", 44),
    ):
        with pytest.raises(KeyboardInterrupt):
            learn(frames, floor, SMALL, seed=0, folder=tmp_path, progress=killed_at(stage, epoch))
    seen: list[tuple[str, int]] = []
    end = learn(frames, floor, SMALL, seed=0, folder=tmp_path, progress=lambda s, d, n: seen.append((s, d)))
    assert ("skinning network", 10) not in seen and ("shape network", 20) not in seen  # done before
    assert seen[-1] == ("shape network", 48)
    for one, two in zip(
        learned.shape.weights + learned.skinning.weights,
        end.shape.weights + end.skinning.weights,
        strict=True,
    ):
        np.testing.assert_array_equal(one, two)


def test_a_checkpoint_of_another_fit_is_not_used(bulging, tmp_path):
    short = replace(SMALL, epochs=8, checkpoint_epochs=1)
    fresh = learn(bulging, None, short, seed=5)
    learn(bulging, None, short, seed=4, folder=tmp_path)
    after = learn(bulging, None, short, seed=5, folder=tmp_path)
    np.testing.assert_array_equal(fresh.skinning.weights[1], after.skinning.weights[1])


def test_the_collision_term_takes_vertices_out_of_the_body(frames, floor):
    # so few components that the cape cannot be met everywhere: the wall is cut unless it is worth more
    coarse = replace(SMALL, components=2, shape_components=1, second_columns=0, epochs=20, collision_weight=0.0)

    def inside(config: RopesConfig) -> int:
        train = frames.train
        offsets = played(learn(frames, floor, config, seed=0), frames.bones[train])[1] - frames.displacements[train]
        offsets = offsets.reshape(len(train), -1, 3)
        return int((shortfall(offsets, *floor.rows(train, np.arange(VERTICES)), 0.0) > 0).sum())

    without, with_term = inside(coarse), inside(replace(coarse, collision_weight=100.0))
    assert without > 50
    assert with_term < 0.75 * without


def test_order_of_the_frames_changes_only_the_luck_of_the_batches(learned, frames):
    order = np.random.default_rng(3).permutation(len(frames.side))
    shuffled = learn(swaying_frames(order=order), None, SMALL, seed=0)
    straight = learn(frames, None, SMALL, seed=0)
    np.testing.assert_allclose(shuffled.skinning_basis.unpack(), straight.skinning_basis.unpack(), atol=2e-3)
    # each frame stands alone: the error is the same but for the order in which batches are drawn
    assert shuffled.figures["test_error_mm"] == pytest.approx(straight.figures["test_error_mm"], rel=0.4)


def test_sampled_collision_loss_is_unbiased(frames, floor):
    import torch

    from hemline.animators.ropes.fit.networks import CoefficientObjective
    from hemline.animators.ropes.fit.training_set import CollisionTerm, TrainingSet
    from hemline.learning.pca import principal_of_map

    rows = 3 * VERTICES
    found = principal_of_map(np.eye(rows), np.zeros(rows), frames.displacements, 12)
    training = TrainingSet(
        "skinning",
        frames.bones,
        frames.free,
        frames.displacements @ found.basis.T,
        found.deviations,
        frames.train,
        frames.val,
        VERTICES,
    )
    contact = CollisionTerm(found.basis, frames.displacements, None, floor)
    chosen = frames.train[::10]
    guess = torch.from_numpy(np.float32(1.2) * training.coefficients[chosen])

    def losses(count: int, draws: int) -> np.ndarray:
        objective = CoefficientObjective(training, contact, replace(SMALL, collision_vertices=count), 0)
        random = np.random.default_rng(0)
        return np.array([float(objective.collision(chosen, guess, random)) for _ in range(draws)])

    exact, sampled = losses(VERTICES, 1)[0], losses(30, 400)
    assert exact > 0
    assert abs(sampled.mean() - exact) < 4 * sampled.std() / np.sqrt(400)


def test_divergence_is_said(frames):
    with pytest.raises(BadModel, match="diverged"):
        learn(frames, None, replace(SMALL, skinning_rate=9e5, data_weight=9e5), seed=0)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"components": 0}, "'components' must be positive; got 0; give a whole number above 0"),
        ({"epochs": 2.5}, "'epochs' must be a whole number; got 2.5"),
        ({"epochs": True}, "'epochs' must be a whole number; got True"),
        ({"mirror": 1}, "'mirror' must be a switch; got 1; use true or false"),
        ({"second_columns": -1}, "must not be negative; got -1; give a whole number of at least 0"),
        (
            {"bone_noise": float("nan")},
            "'bone_noise' must not be negative; got nan; give a finite number of at least 0",
        ),
        ({"skinning_rate": -1.0}, "'skinning_rate' must not be negative; got -1.0"),
    ],
)
def test_options_that_make_no_sense_are_refused(change, complaint):
    with pytest.raises(BadInput, match=complaint):
        replace(SMALL, **change)

"""The paper's two networks, as printed: the collision term, and what training with it and without it does."""

import numpy as np
import pytest

from hemline.learning.collision import Clearances

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")

from papers.rope_chains.printed_networks import (  # noqa: E402
    EXPANSION,
    Frames,
    Training,
    collision_distances,
    error_mm,
    inside_percent,
    train_both,
)

UP = np.float32([0.0, 1.0, 0.0])


def distance(offset, height: float) -> float:
    """The distance for one vertex above a floor, whose ground truth is at a height."""
    offsets, normals = torch.tensor(np.float32([offset])), torch.from_numpy(UP[None])
    return float(collision_distances(offsets, normals, torch.tensor([height]))[0])


def test_a_vertex_in_the_body_is_drawn_along_the_line_to_its_ground_truth_until_it_is_clear():
    # truth 2 cm up, the vertex 3 cm lower and 4 cm aside: the line has 5 cm, and is clear 5 mm above the floor
    expected = 0.05 * (0.01 + EXPANSION) / 0.03
    assert distance([0.04, -0.03, 0.0], 0.02) == pytest.approx(expected, rel=1e-5)
    # a truth that is itself too near is the place
    assert distance([0.04, -0.03, 0.0], 0.001) == pytest.approx(0.05, rel=1e-5)
    assert distance([0.04, 0.0, 0.0], 0.001) == pytest.approx(0.04, rel=1e-5)


def test_a_vertex_that_is_clear_or_far_from_the_body_counts_nothing():
    assert distance([0.04, -0.01, 0.0], 0.02) == 0
    assert distance([0.04, -0.5, 0.0], np.inf) == 0


def test_its_gradient_is_parallel_to_that_of_the_data_term():
    random = np.random.default_rng(0)
    offsets = torch.tensor(random.normal(0, 0.02, (50, 3)).astype(np.float32), requires_grad=True)
    heights = torch.full((50,), 0.006)
    distances = collision_distances(offsets, torch.from_numpy(np.tile(UP, (50, 1))), heights)
    (distances**2).sum().backward()
    distances = distances.detach()
    slope, moved, pressed = offsets.grad.numpy(), offsets.detach().numpy(), (distances > 1e-4).numpy()
    assert 10 < pressed.sum() < 50
    np.testing.assert_allclose(np.cross(slope, moved)[pressed], 0, atol=1e-9)
    assert ((slope * moved).sum(axis=1)[pressed] > 0).all()


@pytest.fixture(scope="module")
def frames() -> Frames:
    """Cloth on a floor, a curved function of the bones; a third of the frames each to train, choose and judge."""
    random = np.random.default_rng(0)
    bones = random.normal(0, 0.1, (300, 24)).astype(np.float32)
    mixed = np.tanh(8 * bones @ random.normal(0, 0.3, (24, 24)))
    vertices = (0.05 * mixed @ random.normal(0, 0.3, (24, 90))).astype(np.float32)
    normals, heights = np.tile(UP.astype(np.float16), (300, 30, 1)), np.full((300, 30), 0.004, np.float16)
    return Frames(bones, vertices, np.repeat([0, 1, 2], 100), Clearances(normals, heights))


def test_both_networks_learn_and_the_second_what_the_first_leaves(frames):
    first, both = train_both(frames, Training(epochs=80, rates=(1e-3, 1e-3)))
    train, judge = frames.of(0), frames.of(2)
    assert error_mm(first[train]) < 0.6 * error_mm(frames.vertices[train])
    assert error_mm(both[train]) < error_mm(first[train])
    assert error_mm(first[judge]) < error_mm(frames.vertices[judge])


def test_the_collision_term_leaves_less_in_the_body(frames):
    judge = frames.of(2)
    plain, term = (
        train_both(frames, Training(epochs=60, rates=(1e-3, 1e-3), collision=collision))[1][judge]
        for collision in (False, True)
    )
    assert inside_percent(frames, term, judge) < inside_percent(frames, plain, judge)


def test_overtrained_networks_match_the_training_and_not_the_rest(frames):
    train, judge = frames.of(0), frames.of(2)
    usual, over = (
        train_both(frames, each)[1]
        for each in (
            Training(epochs=80, rates=(1e-3, 1e-3)),
            Training(epochs=400, rates=(1e-3, 1e-3), overtrained=True),
        )
    )
    assert error_mm(over[train]) < 0.5 * error_mm(usual[train])
    assert error_mm(over[judge]) > 2 * error_mm(over[train])

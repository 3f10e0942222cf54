"""Levels of detail, on every animator that has them: the same States, the same vertices, the same file."""

from typing import get_type_hints

import numpy as np
import pytest

from hemline.animators.base import Bounded, Detailed, Driven, Level, Redressing, Settled
from tests.contract.made_models import ANIMATORS, body, walk

DT = 1 / 30


# told by the type that is promised: to make them all takes half a minute, at the start of every run of any test
@pytest.fixture(
    params=[name for name, make in ANIMATORS.items() if issubclass(get_type_hints(make)["return"], Detailed)]
)
def model(request):
    return ANIMATORS[request.param]()


@pytest.fixture(scope="module")
def poses():
    motion = walk(12)
    return [body().posed(motion[index]) for index in range(len(motion))]


def test_a_level_is_asked_for_once(model):
    level = model.at_detail(0.5)
    assert isinstance(level, Level) and level.full is model and model.at_detail(0.5) is level
    assert model.at_detail(1.0) is model and level.at_detail(1.0) is model and level.at_detail(0.5) is level
    assert (level.name, level.body_name, level.body_hash) == (model.name, model.body_name, model.body_hash)
    assert level.figures == model.figures


def test_states_can_be_exchanged(model, poses):
    """Every other frame by the level: the full one goes on as if it had made them all."""
    level = model.at_detail(0.8)
    state = mixed = model.start(poses[0])
    for index, posed in enumerate(poses):
        state, vertices = model.step(state, posed, DT)
        mixed, shown = (level if index % 2 else model).step(mixed, posed, DT)
        np.testing.assert_array_equal(shown, vertices[level.vertex_ids] if index % 2 else vertices)


def test_driven_by_the_truth_it_shows_the_same_vertices(model, poses):
    level, truth = model.at_detail(0.8), model.step(model.start(poses[0]), poses[3], DT)[1]
    assert isinstance(level, Driven) == isinstance(model, Driven)
    state = model.start(poses[0])
    if isinstance(model, Driven):
        full, some = (each.follow(state, poses[3], DT, truth)[1] for each in (model, level))
        np.testing.assert_array_equal(some, full[level.vertex_ids])


def test_what_knows_shapes_knows_them_at_every_level(model, poses):
    level, truth = model.at_detail(0.8), model.step(model.start(poses[0]), poses[3], DT)[1]
    for capability in (Settled, Bounded, Redressing):
        assert isinstance(level, capability) == isinstance(model, capability)
    if not (isinstance(model, Redressing) and isinstance(model, Settled)):
        return
    posed, nominal = body().body.shaped([1.5, -1.0]).posed(poses[3].pose), poses[3]
    state = model.reshape(model.start(poses[0]), posed.shaped)
    full, some = (each.redress(state, posed, DT, truth, nominal)[1] for each in (model, level))
    np.testing.assert_array_equal(some, full[level.vertex_ids])
    np.testing.assert_array_equal(level.drape(posed), model.drape(posed)[level.vertex_ids])
    assert level.beta_range == model.beta_range and level.novelty(state) == pytest.approx(
        model.novelty(state), nan_ok=True
    )


def test_on_another_shape_it_shows_the_same_vertices(model):
    other = body().body.shaped([1.5, -1.0])
    posed, level = other.posed(other.rest_pose), model.at_detail(0.8)
    full, some = (each.step(each.start(posed), posed, DT)[1] for each in (model, level))
    np.testing.assert_array_equal(some, full[level.vertex_ids])


def test_its_file_is_that_of_the_full_one(model, tmp_path):
    model.save(tmp_path / "full.safetensors")
    model.at_detail(0.5).save(tmp_path / "level.safetensors")
    assert (tmp_path / "full.safetensors").read_bytes() == (tmp_path / "level.safetensors").read_bytes()

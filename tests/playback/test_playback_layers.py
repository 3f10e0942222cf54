"""Several garments in one player: models worn together, what is refused, what a frame says."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import hemline
from hemline import animators, bodies, garments, motions
from hemline.animators import AnimatorTogether, Bounded, together
from hemline.cli.main import main
from hemline.collide import LayersReport, inside
from hemline.collide.layers.closed_cloth import ClosedCloth
from hemline.errors import BadInput
from hemline.garments import split_pieces, wear_together


@pytest.fixture(scope="module")
def models():
    return [hemline.load("trousers-light"), hemline.load("tshirt-light")]


def test_pieces_apart_are_the_garments_that_were_worn_together():
    each = [garments.load("trousers-light"), garments.load("cape-light")]
    both = wear_together(each)
    start = 0
    for one, apart in zip(each, split_pieces(both), strict=True):
        np.testing.assert_array_equal(apart.faces, one.faces)
        np.testing.assert_array_equal(apart.rest_edges, one.rest_edges)
        np.testing.assert_array_equal(apart.pins.vertices, one.pins.vertices)
        np.testing.assert_array_equal(apart.vertices, both.vertices[start : start + len(one.vertices)])
        assert apart.name == one.name and apart.material == one.material
        start += len(one.vertices)
    assert split_pieces(each[0]) == (each[0],)


def test_models_together_move_each_garment_as_its_own_model_does(models):
    both, body = together(models), bodies.load("anny24").shaped()
    posed = body.posed(body.placed(motions.load("walk"))[10])
    states, vertices = both.step(both.start(posed), posed, 1 / 30)
    alone = np.concatenate([model.step(model.start(posed), posed, 1 / 30)[1] for model in models])
    np.testing.assert_array_equal(vertices, alone)
    assert isinstance(both, Bounded)
    shares = [m.novelty(s) / m.novelty_limit for m, s in zip(models, states, strict=True) if isinstance(m, Bounded)]
    assert both.novelty(states) == max(shares)
    assert [piece.name for piece in both.garment.pieces] == [model.garment.name for model in models]


def test_a_frame_of_several_garments_has_none_behind_another(models):
    body, walk = bodies.load("anny24").shaped(), motions.load("walk").resample(30)
    player = hemline.Player.prepare(together(models), body)
    state = player.start(walk[0], pre_roll=0.1)
    state, frame = player.step(state, walk[0], 1 / 30)
    assert isinstance(frame.report, LayersReport)
    assert frame.milliseconds["layers"] > 0
    inner, start = split_pieces(player.garment)[0], len(models[0].garment.vertices)
    closed = ClosedCloth.of(start, inner.faces)
    behind = inside(closed.vertices(frame.vertices[:start]), closed.faces, frame.vertices[start:])
    np.testing.assert_array_equal(np.flatnonzero(behind) + start, frame.report.caught)
    alone = hemline.Player.prepare(models[0], body)
    single = alone.step(alone.start(walk[0], pre_roll=0.1), walk[0], 1 / 30)[1]
    np.testing.assert_allclose(frame.vertices[:start], single.vertices, atol=1e-5)
    assert "layers" not in single.milliseconds


def test_what_cannot_be_worn_together_is_refused(models):
    with pytest.raises(BadInput, match="over itself; got 'trousers-light' twice; name another one"):
        together([models[0], models[0]])
    with pytest.raises(BadInput, match="two at least; got 1; name one over the other"):
        together(models[:1])
    other = SimpleNamespace(garment=models[1].garment, body_name="anny24", body_hash="another")
    with pytest.raises(BadInput, match="fitted on the same body; got .* of another make; fit both on one"):
        AnimatorTogether((models[0], other))  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="saved one by one; got 'a.safetensors'; save `parts`"):
        together(models).save("a.safetensors")
    thin = {"animator": together(models), "body": bodies.load("anny24").shaped()}
    for thickness in (0.0, -1.0, 11.0, float("nan")):
        with pytest.raises(BadInput, match="above 0 and at most 10 mm"):
            hemline.Player.prepare(**thin, thickness_mm=thickness)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["trousers-light", "--over", "trousers-light"], "over itself; got 'trousers-light' twice; name another one"),
        (["live", "--garment", "cape", "--over", "cape"], "over itself; got 'cape' twice; name another one"),
        (["trousers-light", "--over", "live"], "not worn over another model; got --over live; name models"),
        (["trousers-light", "--over", "tshirt-light", "--thickness-mm", "0"], "at most 10 mm over each other"),
        (["trousers-light", "--over", "tshirt-lite"], "tshirt-lite"),
    ],
)
def test_the_command_says_in_one_line_what_it_cannot_wear(arguments, told, tmp_path, capsys):
    out = tmp_path / "out.npz"
    assert main(["animate", *arguments, "-m", "walk", "--seconds", "0.05", "-o", str(out)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert told in lines[-1] and not out.exists()


def test_a_garment_of_two_pieces_is_one_animator_of_any_kind(tmp_path):
    body = bodies.load("anny24").shaped()
    each = [garments.load("tshirt-light"), replace(garments.load("cape-light"), name="over")]
    animator = animators.load("live").animator_for(wear_together(each), body)  # type: ignore[union-attr]
    player = hemline.Player.prepare(animator, body)
    assert len(player.projector.layers[1]) == 1  # type: ignore[union-attr]

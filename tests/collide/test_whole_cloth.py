"""Whole cloth: what an animator puts through a limb comes out on one side, in one piece. Each part is needed."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from hemline.collide import GarmentOnBody, Projector, WholeCloth, WholeState
from hemline.errors import BadGarment
from hemline.motions.quaternions import from_axis_angle, rotate
from tests.collide.projection_samples import two_balls
from tests.collide.whole_samples import DT, RADIUS, SMALL, at, prepared, sheet, stepped, stretches

DEEP = -0.03
"""Height of a level sheet that cuts deep through the ball, above its middle plane by less than the cloth's way back."""


def sunk(garment, height):
    """The sheet level at another height: what an animator that knows no body makes."""
    vertices = garment.vertices.copy()
    vertices[:, 1] = height
    return vertices


def lowered(whole, posed, garment, height, frames=12):
    """The sheet sinks into the ball from above, then stays."""
    state = whole.start()
    for share in np.linspace(0, 1, frames):
        state, _ = stepped(whole, state, posed, sunk(garment, 0.12 + share * (height - 0.12)))
    return stepped(whole, state, posed, sunk(garment, height), frames=20)


def out_by(vertices):
    """Lowest distance to the ball's middle, over its radius [m]."""
    return float(np.linalg.norm(vertices, axis=1).min() - RADIUS)


def test_cloth_that_is_put_through_a_ball_lies_over_it_in_one_piece():
    garment = sheet()
    shaped, whole = prepared(garment)
    posed = at(shaped, (0, 0, 0))
    _, held = lowered(whole, posed, garment, 0.03)
    assert out_by(held) > -0.002
    near = np.linalg.norm(garment.vertices[:, [0, 2]], axis=1) < 0.04
    assert (held[near, 1] > 0.08).all()  # all of it above, none came out below
    assert np.percentile(stretches(garment, held), 99) < 0.15
    projector = Projector.prepare(shaped, garment.vertices, garment.faces)
    _, alone, _ = projector.project(projector.start(), posed, sunk(garment, 0.03), dt=DT)
    assert np.percentile(stretches(garment, alone), 99) > 0.5  # each vertex alone: torn


def test_cloth_far_from_the_body_and_not_too_long_is_left_as_it_is():
    garment = sheet()
    shaped, whole = prepared(garment)
    _, held = stepped(whole, whole.start(), at(shaped, (0, -1, 0)), garment.vertices, frames=5)
    np.testing.assert_allclose(held, garment.vertices, atol=1e-6)


def test_cloth_that_rests_close_to_the_skin_is_not_lifted():
    """A waistband: what is 6 mm over the skin at rest stays there; the same cloth from farther up is held higher."""
    close, far = sheet(height=0.106), sheet(height=0.12)
    lifts = []
    for garment in (close, far):
        shaped, whole = prepared(garment)
        _, held = stepped(whole, whole.start(), at(shaped, (0, 0, 0)), close.vertices, frames=5)
        top = np.linalg.norm(garment.vertices[:, [0, 2]], axis=1) < 0.02
        lifts.append(held[top, 1] - 0.106)
    assert np.abs(lifts[0]).max() < 5e-4
    assert lifts[1].min() > 1e-3


def test_it_keeps_its_side_where_the_nearest_skin_is_on_the_other():
    """The sheet sinks below the ball's middle: the nearest way out is down, the cloth stays above."""
    garment = sheet()
    shaped, whole = prepared(garment)
    _, held = lowered(whole, at(shaped, (0, 0, 0)), garment, DEEP)
    middle = np.linalg.norm(garment.vertices[:, [0, 2]], axis=1) < 0.03
    assert (held[middle, 1] > 0.08).all()
    _, jumped = stepped(whole, whole.start(), at(shaped, (0, 0, 0)), sunk(garment, DEEP), frames=20)
    assert (jumped[middle, 1] > 0.08).all()  # by the cloth's outer side, when it was never above


def without_coarse_edges(whole):
    return replace(whole, coarse=whole.coarse._replace(lengths=np.full_like(whole.coarse.lengths, 1e3)))


def without_fine_sweeps(whole):
    return replace(whole, settings=replace(SMALL, fine_sweeps=0))


def without_offsets_kept(whole):
    return replace(whole, settings=replace(SMALL, keep=0.0))


@pytest.mark.parametrize(
    ("without", "worse"), [(without_coarse_edges, 2.0), (without_fine_sweeps, 1.2), (without_offsets_kept, 1.02)]
)
def test_without_a_part_edges_are_longer(without, worse):
    garment = sheet()
    shaped, whole = prepared(garment)
    posed = at(shaped, (0, 0, 0))
    ours, theirs = (
        np.percentile(stretches(garment, lowered(each, posed, garment, 0.0)[1]), 99) for each in (whole, without(whole))
    )
    assert theirs > worse * ours


def test_what_was_pushed_out_comes_back_slowly():
    """When the ball is gone from one frame to the next, cloth falls back at 0.36 m/s; without memory it pops."""
    garment = sheet()
    shaped, whole = prepared(garment)
    forgetful = replace(whole, settings=replace(SMALL, memory=1e-4, speed=1e6, keep=0.0))
    back = []
    for each in (whole, forgetful):
        state, pushed = lowered(each, at(shaped, (0, 0, 0)), garment, 0.03)
        _, after = stepped(each, state, at(shaped, (0, -2, 0)), sunk(garment, 0.03))
        back.append(np.linalg.norm(after - pushed, axis=1).max())
    assert back[0] < 0.02
    assert back[1] > 0.05


def test_pins_are_where_the_body_has_them_whatever_the_animator_makes():
    garment = sheet(pinned=range(41))
    shaped, whole = prepared(garment)
    posed = at(shaped, (0.3, 1.0, -0.2), turn=0.7)
    vertices = garment.vertices @ posed.transforms[0, :, :3].T + posed.transforms[0, :, 3]
    strewn = vertices + np.random.default_rng(0).normal(0, 0.02, vertices.shape)
    _, held = stepped(whole, whole.start(), posed, strewn.astype(np.float32))
    np.testing.assert_allclose(held[:41], garment.pins.on(with_normals(posed)), atol=2e-6)


def with_normals(posed):
    """The ball with normals, as pins of any kind ask for them."""
    posed.normals = np.zeros_like(posed.vertices)
    return posed


def test_nothing_stays_when_the_reason_is_gone():
    garment = sheet()
    shaped, whole = prepared(garment)
    state, pushed = lowered(whole, at(shaped, (0, 0, 0)), garment, 0.03)
    assert np.abs(pushed - sunk(garment, 0.03)).max() > 0.05
    away = at(shaped, (0, -2, 0))
    vertices = sunk(garment, 0.03)
    _, held = stepped(whole, state, away, vertices, frames=150)
    np.testing.assert_allclose(held, vertices, atol=5e-4)


def test_it_does_not_matter_where_in_the_world_it_happens():
    garment = sheet()
    shaped, whole = prepared(garment)
    _, here = lowered(whole, at(shaped, (0, 0, 0)), garment, 0.03)
    moved, turn = at(shaped, (3, -1, 2), turn=1.1), from_axis_angle(np.array([0, 1.1, 0]))
    state = whole.start()
    for share in np.linspace(0, 1, 12):
        vertices = (rotate(turn, sunk(garment, 0.12 - share * 0.09)) + [3, -1, 2]).astype(np.float32)
        state, _ = stepped(whole, state, moved, vertices)
    state, there = stepped(whole, state, moved, vertices, frames=20)
    back = rotate(turn * [1, -1, -1, -1], there - [3, -1, 2])
    assert np.percentile(np.linalg.norm(back - here, axis=1), 95) < 0.004


def test_sixty_frames_a_second_hold_as_thirty_do():
    garment = sheet()
    shaped, whole = prepared(garment)
    posed, state = at(shaped, (0, 0, 0)), whole.start()
    _, thirty = lowered(whole, posed, garment, 0.03)
    for share in np.linspace(0, 1, 24):
        state, _ = stepped(whole, state, posed, sunk(garment, 0.12 - share * 0.09), dt=DT / 2)
    _, sixty = stepped(whole, state, posed, sunk(garment, 0.03), frames=40, dt=DT / 2)
    assert np.linalg.norm(thirty - sixty, axis=1).mean() < 0.004
    assert out_by(sixty) > -0.002


def test_states_are_plain_data_that_is_never_changed():
    garment = sheet()
    shaped, whole = prepared(garment)
    posed, vertices = at(shaped, (0, 0, 0)), sunk(garment, 0.0)
    state, _ = stepped(whole, whole.start(), posed, vertices, frames=3)
    kept: WholeState = copy.deepcopy(state)
    _, first = stepped(whole, state, posed, vertices)
    _, again = stepped(whole, kept, posed, vertices)
    np.testing.assert_array_equal(first, again)


def test_cloth_turned_inside_out_recovers_within_a_second():
    garment = sheet()
    shaped, whole = prepared(garment)
    posed = at(shaped, (0, 0, 0))
    state, _ = stepped(whole, whole.start(), posed, sunk(garment, 0.12), frames=5)
    inside_out = sunk(garment, 0.0) * np.float32([-1, 1, 1])
    state, _ = stepped(whole, state, posed, inside_out, frames=3)
    _, held = stepped(whole, state, posed, sunk(garment, 0.11), frames=30)
    assert stretches(garment, held).max() < 0.3
    assert out_by(held) > -0.002


def test_cloth_that_is_not_finite_or_another_garments_is_refused():
    garment = sheet()
    shaped, whole = prepared(garment)
    posed, broken = at(shaped, (0, 0, 0)), garment.vertices.copy()
    broken[7] = np.nan
    with pytest.raises(BadGarment, match="finite"):
        stepped(whole, whole.start(), posed, broken)
    with pytest.raises(BadGarment, match="another garment"):
        stepped(whole, whole.start(), posed, garment.vertices[:5])


def limbs_that_hold(whole, state):
    """Which of two balls holds each sample: 0 or 1."""
    numbers = whole.limbs.number[whole.on_body.patches.faces[state.memory.faces, 0]]
    return np.searchsorted(np.unique(whole.limbs.number), numbers)


def on_two_balls(garment):
    """The step on a body of two balls, and where its samples are in the sheet."""
    shaped, _ = two_balls(1.0)
    whole = WholeCloth.prepare(shaped, garment, GarmentOnBody.of(shaped, garment.vertices), SMALL)
    return whole, garment.vertices[whole.on_body.order[whole.coarse.samples]]


def test_cloth_that_one_limb_holds_sees_another_limb_come():
    """A ball moves in beside the one that holds the sheet, next to samples that were never away from the first."""
    garment = sheet()
    whole, places = on_two_balls(garment)
    state, _ = lowered(whole, two_balls(0.6)[1], garment, 0.09)
    beside = (places[:, 0] > 0.09) & (places[:, 0] < 0.14) & (abs(places[:, 2]) < 0.06) & ~state.memory.fresh
    assert beside.sum() > 3
    assert (limbs_that_hold(whole, state)[beside] == 0).all()
    state, _ = stepped(whole, state, two_balls(0.15)[1], sunk(garment, 0.09), frames=9)
    assert (limbs_that_hold(whole, state)[beside] == 1).all()


def test_cloth_that_comes_from_afar_finds_the_nearest_skin_at_once():
    garment = sheet()
    whole, places = on_two_balls(garment)
    posed = two_balls(0.6)[1]
    state, _ = stepped(whole, whole.start(), posed, sunk(garment, 0.09), frames=3)
    state, _ = stepped(whole, state, posed, sunk(garment, 0.7))
    over = sunk(garment, 0.115) + np.float32([0.6, 0, 0])
    state, _ = stepped(whole, state, posed, over)
    middle = np.linalg.norm(places[:, [0, 2]], axis=1) < 0.08
    assert (limbs_that_hold(whole, state)[middle] == 1).all()

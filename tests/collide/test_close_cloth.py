"""Close cloth: what is too long becomes shorter, what is in the skin comes out, what stands still stays still."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import hemline
from hemline import metrics
from hemline.animators import together
from hemline.bodies.lifted_arms import FORMER_LIFT_DEG
from hemline.bodies.untangling import untangling
from hemline.collide import CloseCloth, GarmentOnBody, inside
from hemline.collide.close.close_cloth import GAP, NEAR, REST_STRETCH, STRETCH
from hemline.collide.projection import project_frame
from hemline.meshes import ClosestTree, edge_strains, rest_lengths, vertex_normals
from tests.collide.whole_samples import RADIUS, at, ball, sheet

TORN = 120
"""Where a row of the sheet is pulled out of it: one vertex of 1,681."""
CENTRE = 840
"""The vertex of the sheet over the top of the ball."""
MIDDLE = (0.0, 0.0, 0.0)


def prepared(garment):
    """Ball, its posed surface, and the step; the sheet covers nothing."""
    shaped = ball()
    return at(shaped, MIDDLE), CloseCloth.prepare(None, garment, GarmentOnBody.of(shaped, garment.vertices))


def pulled(garment, which=TORN):
    """The sheet with one vertex pulled out by 3 cm, its edges more than three times as long as they are at rest."""
    vertices = garment.vertices.copy()
    vertices[which, 1] += 0.03
    return vertices


def longest(garment, vertices):
    return float(edge_strains(vertices, garment.faces, garment.rest_edges).max())


def test_cloth_within_its_limits_stays_where_it_is():
    garment = sheet()
    posed, close = prepared(garment)
    wider = (garment.vertices * [STRETCH - 0.01, 1, STRETCH - 0.01]).astype(np.float32)
    np.testing.assert_allclose(close.step(posed, wider, garment.vertices)[0], wider, atol=1e-6)


@pytest.mark.parametrize("pinned", [(), (TORN,), (TORN + 1,)])
def test_a_vertex_that_is_pulled_out_comes_back_and_pins_stay(pinned):
    garment = sheet(pinned=pinned)
    posed, close = prepared(garment)
    torn = pulled(garment)
    found, _ = close.step(posed, torn, garment.vertices)
    assert longest(garment, torn) > 2
    assert longest(garment, found) < (1.0 if TORN in pinned else 0.35)
    np.testing.assert_allclose(found[list(pinned)], torn[list(pinned)], atol=1e-6)
    far = np.linalg.norm(garment.vertices - garment.vertices[TORN], axis=1) > 0.1
    np.testing.assert_allclose(found[far], torn[far], atol=1e-6)


def test_pulls_are_equal_and_opposite():
    garment = sheet()
    posed, close = prepared(garment)
    torn = pulled(garment)
    np.testing.assert_allclose(close.step(posed, torn, garment.vertices)[0].mean(axis=0), torn.mean(axis=0), atol=1e-6)


def test_what_the_body_stretches_at_rest_may_be_as_long_up_to_a_limit():
    garment = sheet()
    posed, close = prepared(garment)
    large = (garment.vertices * np.float32([REST_STRETCH - 0.01, 1, REST_STRETCH - 0.01])).astype(np.float32)
    np.testing.assert_allclose(close.step(posed, large, large)[0], large, atol=1e-6)
    assert np.abs(close.step(posed, large, garment.vertices)[0] - large).max() > 0.001
    torn = pulled(garment)
    assert longest(garment, close.step(posed, torn, torn)[0]) < STRETCH * REST_STRETCH - 1 + 0.1


def test_cloth_pressed_into_the_skin_comes_out_and_stays_in_one_piece():
    """The sheet is put 2 cm deep into the ball, each vertex where the animator has it."""
    garment = sheet(height=RADIUS + 0.005)
    posed, close = prepared(garment)
    sunk = garment.vertices - np.float32([0, 0.025, 0])
    found, _ = close.step(posed, sunk, garment.vertices)
    depth = RADIUS - np.linalg.norm(found, axis=1).min()
    assert RADIUS - np.linalg.norm(sunk, axis=1).min() > 0.018
    assert depth < -0.5 * GAP
    assert longest(garment, found) < STRETCH - 1 + 0.1


def test_the_contact_is_that_of_the_nearest_skin():
    garment = sheet(height=RADIUS + 0.004)
    posed, close = prepared(garment)
    found, contact = close.step(posed, garment.vertices, garment.vertices)
    distances = ClosestTree(posed.vertices.astype(np.float64), posed.faces).closest(found).distances
    near = distances < 0.8 * NEAR
    assert near.sum() > 20 and (contact.faces[near] >= 0).all()
    np.testing.assert_allclose(contact.heights[near], distances[near], atol=3e-4)


def test_a_frame_depends_on_no_earlier_one_and_on_no_place_in_the_world():
    garment = sheet(height=RADIUS + 0.005)
    posed, close = prepared(garment)
    sunk = garment.vertices - np.float32([0, 0.025, 0])
    first, _ = close.step(posed, sunk, garment.vertices)
    close.step(posed, pulled(garment, CENTRE), garment.vertices)
    assert np.array_equal(close.step(posed, sunk, garment.vertices)[0], first)
    away = at(ball(), (3.0, -1.0, 2.0), turn=0.7)
    turn, shift = away.transforms[0, :, :3], away.transforms[0, :, 3]
    moved, _ = close.step(away, (sunk @ turn.T + shift).astype(np.float32), garment.vertices)
    np.testing.assert_allclose(moved, first @ turn.T + shift, atol=2e-3)


@cache
def body():
    return hemline.bodies.load("anny24").shaped()


@cache
def played(
    clip: str,
    low: int,
    high: int,
    *,
    whole: bool = True,
    names: tuple[str, ...] = ("tshirt-light",),
    lift_deg: float | None = None,
):
    """The player of garments, and some frames of a clip; with `lift_deg`, hanging arms are lifted for the animator."""
    models = [hemline.load(name) for name in names]
    models = models if lift_deg is None else [replace(model, lift_deg=lift_deg) for model in models]
    motion = body().untangle_motion(hemline.motions.load(clip).resample(30.0))
    player = hemline.Player.prepare(models[0] if len(models) == 1 else together(models), body(), whole=whole)
    state, frames = player.start(motion[low], pre_roll=0.2), []
    for index in range(low, high):
        state, frame = player.step(state, motion[index], 1 / 30)
        frames.append(frame)
    return player, frames


def long_share(player, vertices, limit=0.3):
    return float((edge_strains(vertices, player.garment.faces, player.garment.rest_edges) > limit).mean())


def test_arms_stretched_forwards_hardly_tear_the_back():
    player, (frame,) = played("dance", 62, 63)
    assert long_share(player, frame.animated) > 0.02
    assert long_share(player, frame.before_projection) < 0.5 * long_share(player, frame.animated)
    assert long_share(player, frame.vertices) < 0.6 * long_share(player, frame.animated)
    _, (plain,) = played("dance", 62, 63, whole=False)
    assert np.array_equal(plain.before_projection, plain.animated) and np.array_equal(plain.animated, frame.animated)


def test_a_leg_raised_to_the_head_hardly_tears_the_hem():
    player, (frame,) = played("kick", 30, 31)
    assert long_share(player, frame.vertices) < 0.01
    assert long_share(player, frame.before_projection) < 0.6 * long_share(player, frame.animated)


def test_trousers_in_a_kick_keep_less_than_half_of_the_animator_s_tears():
    player, frames = played("kick", 28, 34, names=("trousers-light",))
    before, after = (
        np.mean([long_share(player, getattr(frame, name), 1.0) for frame in frames])
        for name in ("animated", "vertices")
    )
    assert before > 0.004 and after < 0.3 * before


def test_skin_in_front_of_cloth_is_covered():
    """In the kick, with the steps of the player and with the same steps that cover nothing."""
    player, frames = played("kick", 28, 34, names=("trousers-light",))
    garment, close, shaped = player.garment, player.close[0].cloth, body()
    skin = metrics.skin_under_cloth(garment.vertices, garment.faces, shaped.vertices, shaped.normals)
    none = CloseCloth.prepare(None, garment, close.on_body)
    seen = {step: [] for step in (close, none)}
    for frame in frames[::2]:
        normals = vertex_normals(frame.body.vertices, frame.body.faces)
        for step, percents in seen.items():
            held, _ = step.step(frame.body, frame.animated, garment.vertices)
            percents.append(metrics.skin_through_percent(held, garment.faces, frame.body.vertices, normals, skin))
    assert np.mean(seen[none]) > 1
    assert np.mean(seen[close]) < 0.75 * np.mean(seen[none])


def test_sleeves_between_arms_and_chest_are_not_torn():
    """In a walk the arms cut into the chest; neither steps nor projection may tear what the animator left whole.

    With lifted arms it leaves all whole, since the cloth is not pinched.
    """
    for lift_deg in (None, FORMER_LIFT_DEG):
        player, frames = played("walk", 0, 12, lift_deg=lift_deg)
        shares = [(long_share(player, frame.animated), long_share(player, frame.vertices)) for frame in frames]
        assert np.mean(shares, axis=0)[0] < (0.001 if lift_deg else 0.004) and np.mean(shares, axis=0)[1] < 0.002
        assert max(longest(player.garment, frame.vertices) for frame in frames) < 2.5


def test_a_cuff_that_reaches_over_the_thumb_of_a_small_hand_is_not_torn_apart():
    """The animator has it in the middle of the hand; led out on both sides, its edges were twelve times too long."""
    small = hemline.bodies.load("anny24").shaped((-1.0, 1.0))
    player, walk = hemline.Player.prepare(hemline.load("longsleeve-light"), small), hemline.motions.load("walk")
    walk = small.untangle_motion(walk.resample(30.0))
    state = player.start(walk[0])
    for index in range(24):
        state, frame = player.step(state, walk[index], 1 / 30)
        assert longest(player.garment, frame.before_projection) < 2.0
        assert longest(player.garment, frame.vertices) < 2.5
        found = inside(frame.body.vertices, frame.body.faces, frame.vertices)
        found[frame.report.pinched] = False
        assert not found.any()
        assert len(frame.report.pinched) < 0.015 * len(frame.vertices)


def test_on_a_large_body_nothing_is_torn_that_the_animator_left_whole():
    """A body far from that of the fit: the skin that is a vertex's own is found on the body of the fit."""
    model, large = hemline.load("longsleeve-light"), hemline.bodies.load("anny24").shaped((2.0, -1.0))
    walk = large.untangle_motion(hemline.motions.load("walk").resample(30.0))
    player = hemline.Player.prepare(model, large)
    _, frame = player.step(player.start(walk[0], pre_roll=0.2), walk[0], 1 / 30)
    assert longest(player.garment, frame.animated) < 0.7
    assert longest(player.garment, frame.before_projection) < 0.7
    assert longest(player.garment, frame.vertices) < 1.3


@pytest.mark.parametrize(
    ("name", "clip", "index"),
    [
        ("tshirt-light", "walk", 7),
        ("tshirt-light", "turn", 77),
        ("longsleeve-light", "kick", 42),
        ("trousers-light", "walk", 47),
    ],
)
def test_a_garment_on_a_body_that_stands_still_does_not_move(name, clip, index):
    """The body comes out of a motion and stops; a second later no vertex moves, pinched ones included."""
    player, motion = hemline.Player.prepare(hemline.load(name), body()), hemline.motions.load(clip)
    state, seen = player.start(motion[max(index - 8, 0)]), []
    for step in range(50):
        state, frame = player.step(state, motion[min(max(index - 8, 0) + step, index)], 1 / 30)
        seen.append(frame)
    still = [np.abs(one.animated - other.animated).max() for one, other in pairwise(seen[38:])]
    moved = [np.abs(one.vertices - other.vertices).max() for one, other in pairwise(seen[38:])]
    assert max(still) < 1e-4
    assert max(moved) < 5e-4


def test_the_projection_has_the_last_word():
    _, frames = played("dance", 30, 36)
    for frame in frames:
        found = inside(frame.body.vertices, frame.body.faces, frame.vertices)
        found[frame.report.pinched] = False
        assert not found.any()


def test_the_projection_forgets_where_it_held_vertices_whose_skin_was_found():
    """A state that remembers other skin and wrong displacements makes no difference where the skin is handed over."""
    player, frames = played("dance", 30, 36)
    frame, piece, projector = frames[-1], player.close[0], player.projector
    held, skin = piece.cloth.step(frame.body, frame.animated, player.garment.vertices)
    fresh = projector.start()
    fresh = replace(fresh, frame=5, heights=np.full_like(fresh.heights, 0.001))
    wrong = replace(fresh, anchors=np.roll(fresh.anchors, 700), offsets=fresh.offsets + np.float32(0.004))
    known = skin.faces >= 0

    def projected(state, contact):
        return projector.project(state, frame.body, held, dt=1 / 30, contact=contact)[1][known]

    assert known.mean() > 0.9
    np.testing.assert_allclose(projected(wrong, skin), projected(fresh, skin), atol=1e-6)
    assert np.abs(projected(wrong, None) - projected(fresh, None)).max() > 0.002


def test_the_projection_leads_no_vertex_far_from_the_skin_that_it_is_kept_over(monkeypatch):
    """In the turn, as it was recorded, an arm is wrung: led out one by one, vertices would be torn from neighbours."""
    monkeypatch.setattr(untangling, "steady_arm_twist", lambda motion: motion)
    shares = {}
    for way in (project_frame.LONGEST_WAY, 1.0):
        monkeypatch.setattr(project_frame, "LONGEST_WAY", way)
        player, frames = played.__wrapped__("turn", 70, 80, lift_deg=FORMER_LIFT_DEG)
        shares[way] = np.mean([long_share(player, frame.vertices, 1.0) for frame in frames])
        for frame in frames:
            found = inside(frame.body.vertices, frame.body.faces, frame.vertices)
            found[frame.report.pinched] = False
            assert not found.any()
    near, far = sorted(shares)
    assert shares[near] < 0.95 * shares[far]


def test_of_garments_worn_together_those_that_settle_are_held_so():
    player, (frame,) = played("dance", 62, 63, names=("tshirt-light", "longsleeve-light"))
    assert [piece.high - piece.low for piece in player.close] == [3150, len(frame.vertices) - 3150]
    assert player.cover == ()
    assert long_share(player, frame.before_projection) < 0.6 * long_share(player, frame.animated)


def test_beside_a_cape_only_the_shirt_is_held_so():
    player, (frame,) = played("walk", 3, 4, names=("tshirt-light", "cape"))
    (piece,) = player.close
    assert (piece.low, piece.high) == (0, 3150) and len(player.cover) == 1
    assert np.array_equal(player.held, np.arange(len(frame.vertices)) < 3150)


def test_at_lower_detail_it_holds_the_vertices_that_are_left():
    model, shaped = hemline.load("tshirt-light"), hemline.bodies.load("anny24").shaped((1.0, -1.0))
    kick = shaped.untangle_motion(hemline.motions.load("kick").resample(30.0))
    for detail, covers in ((0.6, True), (0.3, False)):
        player = hemline.Player.prepare(model, shaped, detail=detail)
        _, frame = player.step(player.start(kick[30], pre_roll=0.2), kick[30], 1 / 30)
        assert long_share(player, frame.before_projection) < 0.7 * long_share(player, frame.animated)
        assert bool(len(player.close[0].cloth.model.covered.points)) == covers


def test_edges_between_pins_have_no_limit():
    garment = sheet(pinned=(TORN, TORN + 1))
    posed, close = prepared(garment)
    edges, _ = rest_lengths(garment.faces, garment.rest_edges)
    assert len(close.model.fine.edges) == len(edges) - 1
    torn = pulled(garment)
    np.testing.assert_allclose(close.step(posed, torn, garment.vertices)[0][TORN], torn[TORN], atol=1e-6)


def test_vertices_of_another_garment_are_refused():
    garment = sheet()
    posed, close = prepared(garment)
    with pytest.raises(hemline.errors.BadGarment, match="prepared for another garment"):
        close.step(posed, garment.vertices[:-1], garment.vertices)
    broken = garment.vertices.copy()
    broken[3] = np.nan
    with pytest.raises(hemline.errors.BadGarment, match="finite"):
        close.step(posed, broken, garment.vertices)


def test_it_can_be_left_out():
    player, _ = played("kick", 30, 31, whole=False)
    assert player.close == () and player.cover is None

"""Levels of detail: what a coarser garment shows, costs and keeps when it changes."""

from dataclasses import replace

import igl
import numpy as np
import pytest

import hemline
from hemline.animators.base import Detailed, Level
from hemline.bench.detail import _measure
from hemline.errors import BadInput
from hemline.meshes import ClosestTree
from hemline.playback import PlayerState, level_of, pixels_of

DT = 1 / 30
DETAILS = (1.0, 0.5, 0.25, 0.1)


@pytest.fixture(scope="module")
def cape():
    return hemline.load("cape")


@pytest.fixture(scope="module")
def body():
    return hemline.bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def players(cape, body):
    return {detail: hemline.Player.prepare(cape, body, detail=detail) for detail in DETAILS}


@pytest.fixture(scope="module")
def dance():
    return hemline.motions.load("dance")


@pytest.fixture(scope="module")
def danced(players, dance):
    """State and frame of each level after 40 frames, when cloth hangs around the legs."""
    found = {}
    for detail, player in players.items():
        state = player.start(dance[0])
        for index in range(41):
            state, frame = player.step(state, dance[index], DT)
        found[detail] = state, frame
    return found


def kept(player):
    return getattr(player.animator, "vertex_ids", np.arange(len(player.garment.vertices)))


def test_each_row_is_a_vertex_of_the_full_garment(cape, body, players):
    """While the same bones play, the animator's vertices are those of the full garment, bit for bit."""
    assert isinstance(cape, Detailed) and players[1.0].garment is cape.garment
    assert players[0.5].collider is body and len(players[0.25].collider.vertices) == 3337
    walk = body.placed(hemline.motions.load("walk"))
    levels = [level_of(cape, detail) for detail in (0.9, 0.25, 0.1)]
    states = [each.start(body.posed(walk[0])) for each in (cape, *levels)]
    for index in range(5):
        steps = [
            each.step(state, body.posed(walk[index]), DT) for each, state in zip((cape, *levels), states, strict=True)
        ]
        states, (full, *some) = zip(*steps, strict=True)
        for level, vertices in zip(levels, some, strict=True):
            assert isinstance(level, Level)
            np.testing.assert_array_equal(vertices, full[level.vertex_ids])
    for detail, player in players.items():
        assert len(player.garment.vertices) == round(detail * 12690) and player.garment.faces.max() < len(kept(player))


@pytest.mark.parametrize("detail", [0.5, 0.25, 0.1])
def test_it_looks_like_the_full_garment(players, danced, detail):
    (_, whole), (_, frame) = danced[1.0], danced[detail]
    distances = np.linalg.norm(frame.vertices - whole.vertices[kept(players[detail])], axis=1)
    assert distances.mean() < 0.03
    tree = ClosestTree(frame.vertices.astype(np.float64), players[detail].garment.faces)
    assert np.percentile(tree.closest(whole.vertices).distances, 99) < 0.08


@pytest.mark.parametrize(("detail", "share", "deepest"), [(0.5, 0.0, 0.0), (0.25, 0.001, 0.002), (0.1, 0.005, 0.01)])
def test_hardly_any_vertex_is_inside_the_full_body(players, dance, detail, share, deepest):
    """None at 0.5, by another library; below that, against the coarser body, a few and not deep."""
    player = players[detail]
    state, inside, depth, count = player.start(dance[0]), 0, 0.0, 0
    for index in range(60):
        state, frame = player.step(state, dance[index], DT)
        if index % 6 == 0:
            skin, faces = frame.body.vertices.astype(np.float64), frame.body.faces.astype(np.int64)
            winding = np.abs(igl.winding_number(skin, faces, frame.vertices.astype(np.float64))) > 0.5
            winding[frame.report.pinched] = False
            inside, count = inside + winding.sum(), count + len(winding)
            if winding.any():
                depth = max(depth, ClosestTree(skin, frame.body.faces).closest(frame.vertices[winding]).distances.max())
    assert inside <= share * count and depth <= deepest


@pytest.mark.parametrize(("one", "other"), [(1.0, 0.5), (0.5, 0.25), (0.25, 0.1), (0.1, 0.25), (0.25, 1.0), (0.1, 1.0)])
def test_cloth_does_not_jump_when_the_level_changes(players, dance, danced, one, other):
    """A quarter, at the vertices that both have, of what cloth moves within a frame, and less than from a new state.

    The worst per cent, where cloth may fall on the other side of a fold, jumps by three quarters of that.
    """
    here, there = players[one], players[other]
    state, before = danced[one]
    _, stays = here.step(state, dance[41], DT)
    _, changed = there.step(here.switch_to(state, there), dance[41], DT)
    begun = PlayerState(state.animator, there.whole.start(), there.projector.start())
    _, anew = there.step(begun, dance[41], DT)
    _, mine, theirs = np.intersect1d(kept(here), kept(there), return_indices=True)
    jump, fall = (np.linalg.norm(stays.vertices[mine] - frame.vertices[theirs], axis=1) for frame in (changed, anew))
    moves = np.linalg.norm(stays.vertices[mine] - before.vertices[mine], axis=1)
    assert jump.mean() < min(0.25 * moves.mean(), fall.mean())
    assert np.percentile(jump, 99) < min(0.75 * np.percentile(moves, 99), 0.9 * np.percentile(fall, 99))


def test_the_benchmark_compares_a_level_with_the_same_vertices_of_the_full_garment(players, danced):
    (_, whole), (_, frame), row = danced[1.0], danced[0.25], {}
    _measure(players[0.25], [frame], [whole], row)
    apart = np.linalg.norm(frame.vertices - whole.vertices[kept(players[0.25])], axis=1)
    assert row["error"] == pytest.approx([1e3 * apart.mean()], rel=1e-5)


def test_fine_offsets_of_vertices_that_stay_go_along(players, danced):
    full, quarter = players[1.0], players[0.25]
    state, _ = danced[1.0]
    before, after = np.empty((12690, 3)), np.empty((3172, 3))
    before[full.projector.on_body.order] = state.whole.offsets
    after[quarter.projector.on_body.order] = full.switch_to(state, quarter).whole.offsets
    np.testing.assert_array_equal(after, before[kept(quarter)])
    assert np.abs(after).max() > 1e-3


def test_there_and_back_goes_on(players, dance, danced):
    state, _ = danced[1.0]
    full, quarter = players[1.0], players[0.25]
    back = quarter.switch_to(full.switch_to(state, quarter), full)
    assert full.switch_to(state, full) is state
    for index in range(41, 56):
        state, stays = full.step(state, dance[index], DT)
        back, went = full.step(back, dance[index], DT)
    assert np.linalg.norm(stays.vertices - went.vertices, axis=1).mean() < 0.01


def test_a_crowd_of_mixed_levels_shows_what_each_shows_alone(players, dance, all_threads):
    mixed = [players[detail] for detail in (0.1, 1.0, 0.25, 0.1)]
    states = [player.start(dance[0], pre_roll=0.0) for player in mixed]
    _, together = hemline.crowd(mixed, states, [dance[1]] * 4, DT)
    for player, state, frame in zip(mixed, states, together, strict=True):
        np.testing.assert_array_equal(frame.vertices, player.step(state, dance[1], DT)[1].vertices)


def test_a_level_is_measured_where_the_garment_hangs(players, cape):
    errors = [players[detail].error for detail in DETAILS]
    assert errors[0] == 0 and errors == sorted(errors) and errors[-1] < 0.01


def test_the_coarsest_level_that_is_not_seen():
    errors = {1.0: 0.0, 0.5: 0.002, 0.1: 0.006}
    chosen = [hemline.detail_for(distance, errors, pixels=1.0) for distance in (0.5, 1.8, 1.9, 5.6, 5.7, 40.0)]
    assert chosen == [1.0, 1.0, 0.5, 0.5, 0.1, 0.1]  # 1080 / (2 tan 30 deg) = 935 pixels a radian
    assert hemline.detail_for(0.1, {0.5: 0.002, 0.1: 0.006}) == 0.5
    assert pixels_of(0.01, 10.0, height_px=1000, field_of_view=np.pi / 2) == pytest.approx(0.5)


def test_wrong_input_is_refused(cape, body, players, dance):
    for detail in (0.0, -0.5, 1.01, float("nan")):
        with pytest.raises(BadInput, match="a level of detail is above 0 and at most 1; got detail ="):
            hemline.Player.prepare(cape, body, detail=detail)
    with pytest.raises(BadInput, match="garment 'cape' needs 50 vertices or more; got 0.001 of 12690; keep 0.0039"):
        hemline.Player.prepare(cape, body, detail=0.001)
    for distance, height in ((0.0, 1080), (float("nan"), 1080), (5.0, 0)):
        with pytest.raises(BadInput, match="a camera sees at a distance"):
            hemline.detail_for(distance, {1.0: 0.0}, height_px=height)
    with pytest.raises(BadInput, match="a level is chosen from some"):
        hemline.detail_for(5.0, {})


def test_a_state_goes_on_only_on_the_same_animator_and_body(cape, body, players, danced):
    state, _ = danced[1.0]
    tall = hemline.bodies.load("anny24").shaped([1.0])
    others = (
        hemline.Player.prepare(cape, tall, detail=0.1),
        hemline.Player.prepare(replace(cape), body, detail=0.1),
        hemline.Player.prepare(cape, body, detail=0.1, whole=False),
    )
    for other in others:
        with pytest.raises(BadInput, match="a state goes on at another level of the same animator on the same body"):
            players[1.0].switch_to(state, other)


def test_an_animator_without_levels_says_so(body):
    class Plain:
        name, body_name, garment = "plain", "anny24", hemline.garments.load("cape-light")

    with pytest.raises(BadInput, match="animator 'plain' has no levels of detail; got detail = 0.5; play it at 1"):
        hemline.Player.prepare(Plain(), body, detail=0.5)  # type: ignore[arg-type]
    assert level_of(Plain(), 1.0).name == "plain"  # type: ignore[arg-type]

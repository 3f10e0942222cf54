"""How the time of a run is divided, and which clips are simulated."""

import itertools
import json
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from hemline import sim
from hemline.errors import BadInput
from hemline.make.clips import FPS, clean_part, open_clips, posed_clips, requests
from hemline.make.plan import (
    BODIES,
    BODY_FRAMES,
    DERIVATIVE_FRAMES,
    DRAPE_FRAMES,
    ENOUGH_POSES,
    FEWEST_ANCHORS,
    FEWEST_POSES,
    MOST_POSES,
    POSE_FRAMES,
    RESERVE,
    DataPlan,
    agentdress_seconds,
    plan_data,
    ropes_seconds,
)
from hemline.make.settings import METHODS, MakeSettings
from hemline.make.simulations import shorten_check
from hemline.motions import load, names, varied_clips

CASES = list(itertools.product([0.0, 0.1, 0.3, 0.6, 0.9, 1.0], [0.01, 0.1, 0.6], [30.0, 500.0, 30000.0], [1, 2, 16]))


MANY = 10**6
"""More frames than any of these plans has time for."""


def make_plan(methods, hanging, frame_s, left, jobs, *, slowness=1.0, most_frames=MANY, most_poses=MANY):
    bounds = {"most_frames": most_frames, "most_poses": most_poses}
    return plan_data(methods, hanging, frame_s, left, jobs, slowness=slowness, **bounds)


@pytest.mark.parametrize("slowness", [0.5, 1.0, 6.0])
@pytest.mark.parametrize(("hanging", "frame_s", "left", "jobs"), CASES)
def test_a_plan_keeps_to_its_time_and_says_what_it_leaves_out(hanging, frame_s, left, jobs, slowness):
    plan = make_plan(METHODS, hanging, frame_s, left, jobs, slowness=slowness)
    planned = sum(plan.seconds(frame_s, jobs, slowness).values())
    assert planned <= (1 - RESERVE) * left + 1e-9
    assert set(plan.methods) >= {"skinned", "lag", "swingar", "live"}  # these need no data
    assert (plan.frames > 0) == ("ropes" in plan.methods)
    assert (plan.poses > 0) == ("agentdress" in plan.methods)
    assert plan.poses > 0 or (plan.anchors, plan.random) == (0, 0)
    out = {reason.split()[0] for reason in plan.left_out}
    assert out == set(METHODS) - set(plan.methods)


def test_more_time_buys_more_of_everything():
    short, long = (make_plan(METHODS, 0.5, 0.1, minutes * 60, 2) for minutes in (60, 360))
    assert short.frames > 0
    assert short.anchors > 0
    assert 5 < long.frames / short.frames < 7
    assert long.anchors > 3 * short.anchors
    assert long.poses == short.poses == MOST_POSES
    assert long.random > short.random


def test_cloth_that_hangs_gets_clips_and_cloth_that_lies_close_gets_drapes():
    skirt, shirt = (make_plan(METHODS, hanging, 0.1, 600, 2) for hanging in (0.95, 0.05))
    assert (skirt.frames > 0, skirt.drapes) == (True, 0)
    assert (shirt.frames, shirt.drapes > 3 * BODIES) == (0, True)


def test_a_method_that_was_asked_for_is_used_whatever_hangs():
    assert make_plan(("ropes",), 0.0, 0.1, 600, 2).methods == ("ropes",)
    assert make_plan(("agentdress",), 1.0, 0.1, 600, 2).methods == ("agentdress",)


def test_no_more_frames_are_planned_than_the_clips_have():
    plan = make_plan(METHODS, 0.5, 0.02, 36000, 2, most_frames=3630)
    free = make_plan(METHODS, 0.5, 0.02, 36000, 2)
    assert plan.frames == 3630 < free.frames
    assert plan.drapes > free.drapes  # the time that is left over


@pytest.mark.parametrize("minutes", [60, 600, 6000])
@pytest.mark.parametrize("hanging", [0.05, 0.5])
def test_no_more_drapes_are_planned_than_the_clips_have_poses(minutes, hanging):
    poses = len(np.unique(sim.sample_poses(posed_clips(open_clips([]))), axis=0))
    assert poses > 400  # those of many people, and those of the clips
    plan = make_plan(METHODS, hanging, 0.05, 60 * minutes, 2, most_poses=poses)
    assert 0 <= plan.anchors <= 150
    assert max(plan.poses, plan.random) <= poses
    if minutes > 60:
        assert plan.poses == MOST_POSES < poses
        assert plan.anchors > 0


@pytest.mark.parametrize("minutes", [10, 60, 600])
@pytest.mark.parametrize("frame_s", [0.05, 0.2, 1.0])
def test_time_that_the_clips_do_not_take_is_planned_for_drapes(minutes, frame_s):
    plan = make_plan(METHODS, 0.4, frame_s, 60 * minutes, 2, most_frames=3630)
    if plan.anchors:
        cost = frame_s * DRAPE_FRAMES / 2 + 1
        planned = sum(plan.seconds(frame_s, 2, 1.0).values())
        assert planned == pytest.approx((1 - RESERVE) * 60 * minutes, abs=cost * BODIES + 2)


def test_a_machine_at_half_the_pace_fits_to_fewer_frames():
    alone, busy = (make_plan(("ropes",), 1.0, 0.1, 600, 2, slowness=slowness) for slowness in (1.0, 2.0))
    assert busy.frames < alone.frames
    assert ropes_seconds(busy.frames, 2.0) > ropes_seconds(busy.frames, 1.0)


def test_a_fit_to_more_takes_longer():
    assert ropes_seconds(2000, 1.0) > ropes_seconds(1000, 1.0) > 0
    assert 30 < ropes_seconds(1000, 1.0) < 60  # measured: 25 to 53 s for 800 to 1000 frames, beside other programs
    assert agentdress_seconds(150, 1.0) == pytest.approx(15, abs=4)  # measured: 12 to 15 s


def test_a_plan_comes_back_from_its_file():
    plan = make_plan(METHODS, 0.9, 0.1, 600, 2)
    assert DataPlan.of_entries(json.loads(json.dumps(plan.entries()))) == plan


def test_clips_are_cut_to_the_frames_that_there_is_time_for():
    clips = open_clips([])
    assert {clip.name for clip in clips} == (set(names()) - {"dance"}) | {clip.name for clip in varied_clips()}
    for wanted in (600, 1200, 2000):
        found = requests(clips, wanted)
        assert abs(sum(len(each.motion) for each in found) - wanted) <= len(clips)
        longest = max(len(each.motion) for each in found)
        for each, clip in zip(found, clips, strict=True):
            assert len(each.motion) in (len(clip), longest, longest - 1)  # whole, or cut like the others


def test_more_frames_than_there_are_come_from_other_speeds():
    clips = open_clips(["walk", "run"])
    available = sum(map(len, clips))
    found = requests(clips, 2 * available)
    assert {each.motion.name for each in found} == {"walk", "run", "walk x0.8", "run x0.8"}
    assert {each.subject for each in found} == {"06", "02"}


def test_a_clip_at_twice_the_speed_takes_the_same_way_in_half_the_time():
    walk = clean_part(load("walk"))
    fast = walk.at_speed(2.0)
    assert fast.fps == walk.fps == FPS
    assert len(fast) == (len(walk) + 1) // 2
    np.testing.assert_allclose(fast.translations, walk.translations[::2][: len(fast)], atol=1e-5)
    dots = np.abs((fast.rotations * walk.rotations[::2][: len(fast)]).sum(axis=-1))
    np.testing.assert_allclose(dots, 1, atol=1e-5)


@pytest.mark.parametrize(("clips", "match"), [(["dance"], "dance"), (["walk", "walk"], "walk")])
def test_clips_that_would_spoil_the_comparison_are_refused(clips, match):
    with pytest.raises(BadInput, match=f"clips must differ; got {match}"):
        open_clips(clips)


def test_a_small_budget_has_the_fewest_poses_and_no_bodies_of_other_shapes():
    cost = 0.05 * POSE_FRAMES + agentdress_seconds(1, 1.0)
    first = 0.05 * (BODY_FRAMES + DERIVATIVE_FRAMES + DRAPE_FRAMES) + agentdress_seconds(1, 1.0)
    least = (FEWEST_POSES * cost + first) / (1 - RESERVE)
    enough, too_little = (make_plan(METHODS, 0.05, 0.05, factor * least, 1) for factor in (1.01, 0.99))
    assert (enough.poses, "agentdress" in enough.methods) == (FEWEST_POSES, True)
    assert (enough.anchors, enough.drapes) == (0, FEWEST_POSES + 1)
    assert too_little.poses == 0
    assert any(reason.startswith("agentdress needs about") for reason in too_little.left_out)


def test_bodies_of_other_shapes_wait_until_there_are_enough_poses():
    plans = [make_plan(METHODS, 0.05, 0.1, 60 * minutes, 2, most_poses=560) for minutes in (3, 6, 15, 30, 60, 600)]
    assert [plan.poses for plan in plans] == sorted(plan.poses for plan in plans)
    assert all(plan.poses >= ENOUGH_POSES for plan in plans if plan.anchors)
    assert plans[0].anchors == 0 < FEWEST_ANCHORS <= plans[-2].anchors < plans[-1].anchors


def test_a_garment_that_half_hangs_gets_the_fewest_poses_before_more_clips():
    short, long = (make_plan(METHODS, 0.5, 0.1, minutes * 60, 2) for minutes in (2.5, 24))
    assert FEWEST_POSES <= short.poses < 1.3 * FEWEST_POSES < long.poses
    assert 150 <= short.frames < long.frames / 5


def test_time_is_shared_as_the_area_is():
    plans = [make_plan(METHODS, hanging, 0.05, 3600, 2) for hanging in (0.25, 0.55)]
    spent = [ropes_seconds(plan.frames, 1.0) + plan.seconds(0.05, 2, 1.0)["simulate"] for plan in plans]
    assert spent[1] / spent[0] == pytest.approx(0.55 / 0.25, rel=0.05)


def test_the_comparison_is_shortened_for_meshes_that_are_slow_to_simulate():
    @dataclass(frozen=True)
    class Run:
        clock: SimpleNamespace
        check: range

    run = Run(SimpleNamespace(total_s=600.0), range(91))
    lengths = [len(shorten_check(run, frame_s).check) for frame_s in (0.2, 1.5, 60.0)]
    assert lengths == [91, 60, 31]  # whole, 15 % of the time, and never less than a second
    assert [MakeSettings(minutes=minutes).check_seconds for minutes in (5, 10, 60)] == [3, 3, 18]

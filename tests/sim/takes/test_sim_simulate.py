"""A small cape on the shipped body."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from hemline import bodies, motions
from hemline.bodies.lead_in import Stance, interpolate_poses, lead_in
from hemline.datasets import read_take, write_take
from hemline.errors import BadGarment, BadInput, SimulationFailed
from hemline.garments import Pins, make_cape
from hemline.motions.motion import JOINT_NAMES
from hemline.sim import SimSettings, Stepper, rest_drape, simulate
from hemline.sim.step.state import ClothState, StepRejected
from hemline.sim.takes.simulate import _end_state, _state

SETTINGS = SimSettings(lead_in=0.2, settle=1.0)


@cache
def stage():
    shaped = bodies.load("anny24").shaped()
    cape = make_cape(shaped, vertex_count=500)
    run = shaped.placed(motions.load(motions.names()[0]).resample(30))[:10]
    return cape, shaped, run, rest_drape(cape, shaped, SETTINGS)


@cache
def unbroken():
    cape, shaped, run, rest = stage()
    return simulate(cape, shaped, run, SETTINGS, start=rest)


def test_the_rest_drape_is_one_settled_frame_outside_the_body():
    igl = pytest.importorskip("igl")
    cape, shaped, _, rest = stage()
    assert rest.kind == "rest"
    assert rest.vertices.shape == (1, len(cape.vertices), 3)
    winding = igl.fast_winding_number(
        shaped.vertices.astype(float), shaped.body.faces.astype(np.int64), rest.vertices[0].astype(float)
    )
    assert (winding < 0.5).all()
    assert rest.figures["edge_strain_p99"] < 0.2


def test_a_take_has_its_lead_in_its_poses_and_its_figures():
    _, _, run, rest = stage()
    take = unbroken()
    assert take.failed is None
    assert take.lead_in.tolist() == [True] * 6 + [False] * 10
    assert np.array_equal(take.motion.rotations[6:], run.rotations)
    assert np.array_equal(take.motion.translations[6:], run.translations)
    assert {
        "edge_strain_p50",
        "edge_strain_p99",
        "edge_strain_max",
        "edge_tension_p99",
        "edge_compression_p99",
        "inside",
        "deepest_mm",
        "pinched",
        "residual_share",
        "self_crossing_percent",
        "self_crossing_percent_max",
    } == set(take.figures)
    assert take.inputs["motion"] == run.hash
    # the first frame is the rest drape, moved rigidly
    first, settled = (
        each - each.mean(axis=0) for each in (take.vertices[0].astype(float), rest.vertices[0].astype(float))
    )
    assert np.allclose(np.linalg.svd(first)[1], np.linalg.svd(settled)[1], rtol=1e-4)


def test_no_vertex_is_inside_at_the_end_of_a_frame():
    igl = pytest.importorskip("igl")
    _, shaped, _, _ = stage()
    take = unbroken()
    for frame in range(0, len(take.vertices), 3):
        posed = shaped.posed(take.motion[frame])
        winding = igl.fast_winding_number(
            posed.vertices.astype(float), posed.faces.astype(np.int64), take.vertices[frame].astype(float)
        )
        assert (winding > 0.5).sum() <= take.pinched[frame]


def test_a_resumed_take_is_bit_equal_to_the_unbroken_one(tmp_path):
    cape, shaped, run, rest = stage()
    whole = unbroken()
    first = simulate(cape, shaped, run[:4], SETTINGS, start=rest)
    write_take(tmp_path / "first.safetensors", first)
    state = read_take(tmp_path / "first.safetensors").end_state
    second = simulate(cape, shaped, run[4:], SETTINGS, resume=state)
    assert not second.lead_in.any()
    assert np.array_equal(whole.vertices, np.concatenate([first.vertices, second.vertices]))
    assert all(np.array_equal(whole.end_state[name], second.end_state[name]) for name in whole.end_state)


def test_the_same_input_gives_the_same_bits():
    cape, shaped, run, rest = stage()
    assert np.array_equal(simulate(cape, shaped, run[:2], SETTINGS, start=rest).vertices, unbroken().vertices[:8])


def test_a_clip_that_jumps_is_marked_with_the_frame_and_keeps_those_before():
    cape, shaped, run, rest = stage()
    jump = run.translations.copy()
    jump[3:] += [1.0, 0, 0]
    seen = []
    take = simulate(
        cape,
        shaped,
        replace(run, translations=jump),
        SETTINGS,
        start=rest,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert take.failed is not None
    assert take.failed.startswith("frame 9: the clip jumps, the pelvis moves at 3")
    assert take.failed.endswith("m/s; cut it there, see motions.longest_clean")
    assert len(take.vertices) == len(take.motion) == 9
    assert np.isfinite(take.vertices).all()
    assert seen[-1] == (9, 16)


def test_a_take_that_fails_keeps_its_frames_and_says_when_and_why(monkeypatch):
    cape, shaped, run, rest = stage()
    good = Stepper.step

    def step(self, state, h, then, now):
        if state.time > 0.27:
            raise StepRejected("a vertex moves at 99 m/s")
        return good(self, state, h, then, now)

    monkeypatch.setattr(Stepper, "step", step)
    take = simulate(cape, shaped, run, replace(SETTINGS, halvings=1), start=rest)
    assert take.failed == "frame 9: a vertex moves at 99 m/s in a step of 4.17 ms"
    assert len(take.vertices) == len(take.motion) == 9
    assert np.isfinite(take.vertices).all()


def test_a_users_wind_with_nan_stops_with_its_time_and_count():
    cape, shaped, run, rest = stage()
    wind = lambda seconds, positions: np.full_like(positions, np.nan if seconds > 0.1 else 1.0)  # noqa: E731
    with pytest.raises(BadInput, match=r"wind must be finite; got NaN or infinity at 0.1\d* s for \d+ of \d+ vertices"):
        simulate(cape, shaped, run, SETTINGS, start=rest, wind=wind)


def test_gusts_of_the_settings_blow_and_are_part_of_the_inputs():
    cape, shaped, run, rest = stage()
    calm = unbroken()
    blown = replace(SETTINGS, wind=(2.0, 0.0, 0.0), gusts=1.0, gust_seed=3)
    take = simulate(cape, shaped, run, blown, start=rest)
    assert np.abs(take.vertices[-1] - calm.vertices[-1]).max() > 0.02
    assert (take.inputs["settings"]["gusts"], take.inputs["settings"]["gust_seed"]) == (1.0, 3)
    first = simulate(cape, shaped, run[:4], blown, start=rest)
    second = simulate(cape, shaped, run[4:], blown, resume=first.end_state)
    assert np.array_equal(take.vertices, np.concatenate([first.vertices, second.vertices]))


def test_a_part_that_fails_at_once_keeps_the_frame_it_came_from():
    cape, shaped, run, _ = stage()
    jump = replace(run, translations=run.translations + np.float32([300, 0, 0]))
    take = simulate(cape, shaped, jump[:2], SETTINGS, resume=unbroken().end_state)
    assert take.failed is not None
    assert take.failed.startswith("frame 0: the clip jumps")
    assert take.lead_in.tolist() == [True]


def test_pins_on_a_joint_go_with_it_and_soft_ones_hang_near():
    cape, shaped, run, _ = stage()
    ids = cape.pins.vertices
    neck = JOINT_NAMES.index("neck")
    pins = Pins.on_joint(ids, cape.vertices[ids], neck, shaped.joints)
    stiffness = np.where(np.arange(len(ids)) % 2, np.inf, 500.0).astype(np.float32)
    hung = replace(cape, pins=replace(pins, stiffness=stiffness))
    take = simulate(hung, shaped, run[:4], SETTINGS, start=stage()[3])
    posed = shaped.posed(run[3])
    wanted = cape.vertices[ids] @ posed.transforms[neck, :, :3].T + posed.transforms[neck, :, 3]
    away = np.linalg.norm(take.end_state["positions"][ids] - wanted, axis=1)
    hard = np.isinf(stiffness)
    assert away[hard].max() < 2e-6
    # each spring carries some tens of grams, up to a few times their weight while running
    assert 1e-4 < np.median(away[~hard]) < 0.02


def test_pins_of_another_bodys_mesh_are_refused():
    cape, shaped, run, _ = stage()
    faces = np.full(len(cape.pins), len(shaped.body.faces), np.int32)
    with pytest.raises(BadGarment, match="pins name a body face that does not exist; got .* anny24 has"):
        simulate(replace(cape, pins=replace(cape.pins, body_faces=faces)), shaped, run, SETTINGS)


def test_a_garment_that_cannot_be_settled_is_refused_with_the_reason():
    cape, shaped, _, _ = stage()
    heap = replace(
        cape,
        vertices=np.where(np.arange(len(cape.vertices))[:, None] % 2, cape.vertices, cape.vertices + np.float32(9)),
    )
    with pytest.raises(SimulationFailed, match="settling 'cape.*': a vertex moves at "):
        rest_drape(heap, shaped, replace(SETTINGS, halvings=0))


def test_another_garments_start_is_refused():
    cape, shaped, run, rest = stage()
    with pytest.raises(BadInput, match="'start' must belong to garment"):
        simulate(cape, shaped, run, SETTINGS, start=replace(rest, vertices=rest.vertices[:, :-1]))
    with pytest.raises(BadInput, match="'resume' must belong to garment"):
        simulate(cape, shaped, run, SETTINGS, resume={})


def test_the_lead_in_starts_still_and_ends_at_the_speed_of_the_clip():
    _, shaped, run, _ = stage()
    leading, _ = lead_in(shaped, run, 30)
    speed = np.linalg.norm(np.diff(leading.translations, axis=0), axis=1) * 30
    first = np.linalg.norm((run.translations[1] - run.translations[0]) * [1, 0, 1]) * 30
    assert speed[0] < 0.1 * first + 1e-3
    assert np.linalg.norm(run.translations[0] - leading.translations[-1]) * 30 == pytest.approx(first, rel=0.05)
    # the head is turned where the clip's is
    turned = shaped.posed(leading[0]).transforms[0, :, :3] @ [0, 0, 1]
    heading = shaped.posed(run[0]).transforms[0, :, :3] @ [0, 0, 1]
    assert np.dot(turned[[0, 2]], heading[[0, 2]]) / np.linalg.norm(heading[[0, 2]]) == pytest.approx(1, abs=1e-3)


def test_a_placement_moves_points_with_the_body():
    _, shaped, run, _ = stage()
    placement = Stance.of(shaped, run[0], np.array([1.0, 0, -2]))
    posed = shaped.posed(placement.pose(shaped.rest_pose))
    assert np.abs(placement.points(shaped.vertices) - posed.vertices).max() < 1e-5


def test_poses_between_two_meet_them():
    _, _, run, _ = stage()
    first, second = run[0], run[1]
    assert interpolate_poses(first, second, 0.0) is first
    assert interpolate_poses(first, second, 1.0) is second
    assert np.allclose(
        interpolate_poses(run[0], run[1], 0.5).translation, 0.5 * (run.translations[0] + run.translations[1]), atol=1e-6
    )


def test_the_end_state_brings_back_all_that_the_next_step_depends_on():
    rng = np.random.default_rng(0)
    arrays = (rng.normal(size=(4, 3)) for _ in range(3))
    history = np.array([[3, -1], [-1, -1], [7, 2], [1, 0]], np.int32)
    state = ClothState(*arrays, rng.uniform(size=4), np.array([True, False, False, True]), history, time=0.3)
    pose = bodies.load("anny24").shaped().rest_pose
    end = _end_state(state, pose)
    back = _state(end)
    for each in fields(state):
        assert np.array_equal(getattr(back, each.name), getattr(state, each.name)), each.name
    # takes made before cloth had a contact history can be gone on with
    assert (
        _state({name: array for name, array in end.items() if name != "contact_history"}).contact_history == -1
    ).all()

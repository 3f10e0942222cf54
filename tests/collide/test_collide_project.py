"""The promise of the final projection, by winding numbers from another library."""

import dataclasses

import numpy as np
import pytest

from hemline import garments, motions
from hemline.collide import ProjectionSettings, Projector
from hemline.collide.surface.patches import dominant_joints, limbs
from hemline.collide.winding.numbers import winding_numbers
from hemline.errors import BadGarment
from hemline.meshes import ClosestTree
from tests.collide.projection_samples import Skintight, clip, inside_count, sheet_behind, two_balls

NO_FACES = np.empty((0, 3), np.int32)


def run(projector, poses, frames, fps):
    """Project frames one after the other."""
    state, projected, reports = projector.start(), [], []
    for posed, vertices in zip(poses, frames, strict=True):
        state, out, report = projector.project(state, posed, vertices, dt=1 / fps)
        projected.append(out)
        reports.append(report)
    return np.array(projected), reports


@pytest.fixture(scope="module")
def tight():
    """Three thin layers over the whole skin of a dancer, 30 frames a second."""
    shaped, poses, fps = clip("dance", frames=20, first=20)
    cloth = Skintight(shaped, 1500, layers=(0.0, -0.002, -0.006))
    frames = np.array([cloth.over(posed, i / fps) for i, posed in enumerate(poses)])
    projector = Projector.prepare(shaped, cloth.rest, NO_FACES)
    return shaped, poses, frames, projector, *run(projector, poses, frames, fps), cloth


@pytest.fixture(scope="module")
def loose():
    """A sheet behind someone who turns, that sways into back, arms and legs."""
    shaped, poses, fps = clip("turn", frames=40)
    rest, carried = sheet_behind(shaped)
    frames = np.array([carried(posed, i / fps) for i, posed in enumerate(poses)])
    projector = Projector.prepare(shaped, rest, NO_FACES)
    return shaped, poses, frames, projector, *run(projector, poses, frames, fps)


@pytest.mark.parametrize("case", ["tight", "loose"])
def test_no_vertex_is_inside_unless_pinched(case, request):
    _, poses, _, _, projected, reports, *_ = request.getfixturevalue(case)
    assert max(report.inside_before for report in reports) > 100
    for posed, vertices, report in list(zip(poses, projected, reports, strict=True))[::8]:
        assert inside_count(posed, vertices, report.pinched) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", motions.names())
def test_no_vertex_of_the_shipped_cape_is_inside_in_any_excerpt(name):
    cape = garments.load("cape")
    shaped, poses, fps = clip(name, frames=100)
    projector, low = (
        Projector.prepare(shaped, cape.vertices, cape.faces),
        cape.vertices[:, 1].max() - cape.vertices[:, 1],
    )
    frames = []
    for i, posed in enumerate(poses):
        sway = 0.05 * low * np.sin(2 * np.pi * 0.8 * i / fps + 5 * cape.vertices[:, 0])
        local = cape.vertices + sway[:, None] * [0, 0, 1]
        frames.append((local @ posed.transforms[9, :, :3].T + posed.transforms[9, :, 3]).astype(np.float32))
    projected, reports = run(projector, poses, frames, fps)
    assert sum(report.inside_before for report in reports) > 1000
    for posed, vertices, report in zip(poses, projected, reports, strict=True):
        assert inside_count(posed, vertices, report.pinched) == 0


@pytest.mark.parametrize("betas", [(2.5, -2.0, 1.5), (-2.5, 2.0, 0, 2.0)])
def test_any_betas(betas):
    shaped, poses, fps = clip("kick", betas, frames=3, step=9, first=20)
    cloth = Skintight(shaped, 2000, seed=4)
    frames = [cloth.over(posed, i / 5) for i, posed in enumerate(poses)]
    projected, reports = run(Projector.prepare(shaped, cloth.rest, NO_FACES), poses, frames, fps)
    for posed, vertices, report in zip(poses, projected, reports, strict=True):
        assert inside_count(posed, vertices, report.pinched) == 0


def test_any_input():
    shaped, poses, fps = clip("turn", frames=4)
    random, body = np.random.default_rng(8), poses[0].vertices
    joints = poses[0].joints
    garbage = np.concatenate(
        [
            random.uniform(body.min(0), body.max(0), (1500, 3)),  # anywhere
            joints[random.integers(0, 24, 500)] + random.normal(0, 0.01, (500, 3)),  # deep
            joints[[20, 21, 22, 23]].repeat(100, axis=0) + random.normal(0, 0.03, (400, 3)),  # wrists and fingers
            body[random.integers(0, len(body), 500)],  # on the skin itself
            random.normal(0, 100, (50, 3)),
            np.full((50, 3), 1e6),
        ]
    ).astype(np.float32)
    rest = random.uniform(shaped.vertices.min(0), shaped.vertices.max(0), garbage.shape).astype(np.float32)
    frames = [garbage, random.permutation(garbage), garbage, garbage[::-1].copy()]
    projected, reports = run(Projector.prepare(shaped, rest, NO_FACES), poses, frames, fps)
    for posed, vertices, report in zip(poses, projected, reports, strict=True):
        assert np.isfinite(vertices).all()
        assert report.inside_before > 500
        assert inside_count(posed, vertices, report.pinched) == 0
        assert len(report.pinched) < 0.05 * len(vertices)


def test_a_vertex_is_pinched_only_where_the_body_cuts_itself(tight):
    shaped, poses, _, projector, projected, reports, _ = tight
    joint = dominant_joints(shaped.body.weight_indices, shaped.body.weights)
    limb_of_face = limbs(shaped.body.parents)[joint[shaped.body.faces]].max(axis=1)
    seen, lifts = 0, []
    for posed, vertices, report in list(zip(poses, projected, reports, strict=True))[::4]:
        seen += len(report.pinched)
        # the anchor, 2 mm over the skin, is inside
        assert (winding_numbers(posed.vertices, posed.faces, report.pinched_anchors) != 0).all()
        limb = projector.on_body.limb[np.argsort(projector.on_body.order)][report.pinched]
        for each in np.unique(limb):
            tree = ClosestTree(posed.vertices.astype(float), posed.faces[limb_of_face == each])
            anchors = report.pinched_anchors[limb == each]
            skin = tree.closest(anchors)
            lifts += skin.distances.tolist()
            # and the vertex is on that side of its own limb
            over = ((vertices[report.pinched[limb == each]] - skin.positions) * (anchors - skin.positions)).sum(axis=1)
            assert (over > 0).mean() > 0.95
    assert seen > 20
    assert np.median(lifts) == pytest.approx(0.002, abs=1e-4)
    assert np.max(lifts) < 0.0021


def test_two_balls_pinch_between_them_and_nowhere_else():
    shaped, posed = two_balls(0.1)
    half = len(shaped.vertices) // 2
    projector = Projector.prepare(shaped, shaped.vertices[:half], NO_FACES)
    _, out, report = projector.project(projector.start(), posed, posed.vertices[:half] * np.float32(0.99), dt=1 / 30)
    depth = 0.1 - np.linalg.norm(posed.vertices[:half] * 1.02 - [0.1, 0, 0], axis=1)
    pinched = np.isin(np.arange(half), report.pinched)
    assert report.inside_before == half
    assert pinched[depth > 0.001].all()
    assert not pinched[depth < -0.001].any()
    assert np.linalg.norm(out, axis=1).min() > 0.1
    assert report.deepest_mm == pytest.approx(1, abs=0.3)


def test_report_by_a_second_route(tight):
    _, poses, frames, _, projected, reports, _ = tight
    for i in (0, 7, 13):
        winding = winding_numbers(poses[i].vertices, poses[i].faces, frames[i])
        assert reports[i].inside_before == np.count_nonzero(winding)
        assert reports[i].moved == np.count_nonzero((projected[i] != frames[i]).any(axis=1))
        tree = ClosestTree(poses[i].vertices.astype(float), poses[i].faces)
        deepest = tree.closest(frames[i][winding != 0]).distances.max() * 1000
        assert reports[i].deepest_mm == pytest.approx(deepest, rel=0.02, abs=0.05)
        assert reports[i].exact


def test_layers_keep_their_order_along_the_normal(tight):
    _, poses, frames, _, projected, reports, cloth = tight
    kept = total = 0
    for posed, before, after, report in zip(poses, frames, projected, reports, strict=True):
        normals, free = cloth.normals(posed.normals), np.ones(len(after), bool)
        free[report.pinched] = False
        layers, moved = after.reshape(3, -1, 3), (after != before).any(axis=1).reshape(3, -1)
        for upper, lower in ((0, 1), (1, 2)):
            counted = moved[lower] & free.reshape(3, -1)[[upper, lower]].all(axis=0)
            height = ((layers[upper] - layers[lower]) * normals).sum(axis=1)
            kept += np.count_nonzero(height[counted] > 0)
            total += np.count_nonzero(counted)
    assert total > 10_000
    assert kept / total >= 0.95


@pytest.mark.parametrize("case", ["tight", "loose"])
def test_adds_little_jerk(case, request):
    _, _, frames, _, projected, *_ = request.getfixturevalue(case)
    moved = (projected != frames).any(axis=2)
    around = moved[:-3] | moved[1:-2] | moved[2:-1] | moved[3:]
    before, after = (np.linalg.norm(np.diff(each.astype(float), 3, axis=0), axis=2) for each in (frames, projected))
    assert around.sum() > 1000
    assert after[around].mean() <= 1.5 * before[around].mean()


def test_a_displacement_fades_when_it_is_no_longer_needed():
    shaped, posed = two_balls(1.0)
    point = np.array([[0, 0.09, 0]], np.float32)
    projector = Projector.prepare(shaped, point, NO_FACES)
    state, displaced, _ = projector.project(projector.start(), posed, point, dt=1 / 60)
    away = np.array([[0, 0.12, 0]], np.float32)
    lifts = []
    for _ in range(40):
        state, out, _ = projector.project(state, posed, away, dt=1 / 60)
        lifts.append(float(out[0, 1] - away[0, 1]))
    first = displaced[0, 1] - point[0, 1]
    assert lifts[0] == pytest.approx(first * np.exp(-1 / 60 / 0.05), rel=0.05)
    assert np.diff(lifts).max() <= 0
    assert lifts[-1] == 0


def test_far_vertices_come_back_bit_for_bit_and_inputs_are_left_alone(loose):
    _, poses, frames, projector, projected, reports = loose
    assert np.mean([report.moved for report in reports]) < 0.5 * len(frames[0])
    same = (projected == frames).all(axis=2)
    assert same.mean() > 0.5
    state, given = projector.start(), frames[3].copy()
    copies = {field.name: np.copy(getattr(state, field.name)) for field in dataclasses.fields(state)}
    projector.project(state, poses[3], given, dt=1 / 30)
    assert (given == frames[3]).all()
    assert all((copies[name] == getattr(state, name)).all() for name in copies)


def test_same_input_same_bits_and_a_state_can_be_rolled_back(loose):
    _, poses, frames, projector, projected, _ = loose
    state, kept = projector.start(), None
    for i in range(6):
        if i == 3:
            kept = state
        state, out, _ = projector.project(state, poses[i], frames[i], dt=1 / 30)
        assert (out == projected[i]).all()
    again, out, _ = projector.project(kept, poses[3], frames[3], dt=1 / 30)
    assert (out == projected[3]).all()
    assert (again.anchors == projector.project(kept, poses[3], frames[3], dt=1 / 30)[0].anchors).all()


def test_unmeasured_gives_the_same_bits(loose):
    _, poses, frames, projector, *_ = loose
    quiet = dataclasses.replace(projector, measure=False)
    again, reports = run(quiet, poses[:8], frames[:8], 30)
    measured, _ = run(projector, poses[:8], frames[:8], 30)
    assert (again == measured).all()
    assert all(report.inside_before is None and np.isnan(report.deepest_mm) for report in reports)


def test_fast_displaces_but_does_not_claim(tight):
    shaped, poses, frames, *_ = tight
    projector = Projector.prepare(shaped, frames[0], NO_FACES, guarantee="fast")
    projected, fast = run(projector, poses[:3], frames[:3], 30)
    before = np.count_nonzero(winding_numbers(poses[2].vertices, poses[2].faces, frames[2]))
    after = np.count_nonzero(winding_numbers(poses[2].vertices, poses[2].faces, projected[2]))
    assert after < 0.3 * before
    assert fast[2].inside_before is None
    assert not fast[2].exact
    assert len(fast[2].pinched) == 0


def test_thin_margins_keep_the_promise(tight):
    shaped, poses, frames, *_ = tight
    settings = ProjectionSettings(margin=0.001, gap=0.0003, release=0.001)
    projector = Projector.prepare(shaped, frames[0], NO_FACES, settings=settings)
    projected, reports = run(projector, poses[:4], frames[:4], 30)
    assert inside_count(poses[3], projected[3], reports[3].pinched) == 0


def test_bad_garments():
    shaped, posed = two_balls(1.0)
    with pytest.raises(BadGarment, match=r"needs a garment; got 0 vertices"):
        Projector.prepare(shaped, np.empty((0, 3), np.float32), NO_FACES)
    projector = Projector.prepare(shaped, shaped.vertices, NO_FACES)
    with pytest.raises(BadGarment, match=r"prepared for another garment; got vertices \(5, 3\)"):
        projector.project(projector.start(), posed, shaped.vertices[:5], dt=1 / 30)
    broken = shaped.vertices.copy()
    broken[3, 1] = np.nan
    with pytest.raises(BadGarment, match=r"must be finite; got NaN or infinity"):
        projector.project(projector.start(), posed, broken, dt=1 / 30)


def nearest_face(posed, point):
    middles = posed.vertices[posed.faces].mean(axis=1)
    return int(np.linalg.norm(middles - point, axis=1).argmin())


def placed(posed, projector, point, place, frames=1):
    """Where one vertex goes that was held off from a face (-1: none), and whether it is pinched; the last frame."""
    places = np.full(2, place)
    vertices = np.array([point, [0, 3, 0]], np.float32)
    state = projector.start()
    for _ in range(frames):
        state, out, report = projector.project(state, posed, vertices, dt=1 / 30, places=places)
    return out[0], 0 in report.pinched


@pytest.mark.parametrize("frames", [1, 5])
def test_a_vertex_with_a_place_is_led_out_over_it_however_near_other_skin_is(frames):
    """5 cm below the middle of a ball of 10 cm, held off from its top."""
    shaped, posed = two_balls(1.0)
    point, top = np.array([0.0, -0.05, 0.0]), nearest_face(two_balls(1.0)[1], [0, 0.1, 0])
    projector = Projector.prepare(shaped, np.array([point, [0, 3, 0]], np.float32), NO_FACES)
    for place, upwards in ((-1, False), (top, True)):
        out, pinched = placed(posed, projector, point, place, frames)
        assert not pinched and (out[1] > 0) == upwards
        assert np.linalg.norm(out) == pytest.approx(0.1, abs=0.005)


def test_a_vertex_whose_place_is_inside_another_part_stays_and_is_pinched():
    """5 mm below the skin of the left ball, whose right side is deep inside the right one."""
    shaped, posed = two_balls(0.12)
    point = np.array([0.0889, 0.0338, 0.0])
    projector = Projector.prepare(shaped, np.array([point, [0, 3, 0]], np.float32), NO_FACES)
    out, pinched = placed(posed, projector, point, nearest_face(posed, [0.0935, 0.0356, 0.0]))
    assert pinched and np.linalg.norm(out - point) < 1e-6

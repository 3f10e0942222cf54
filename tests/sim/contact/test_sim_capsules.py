"""Cloth and the bones of limbs: cloth on a limb stays around its bones, whatever the skin does."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from hemline import bodies, garments
from hemline.meshes.segment_crossing_kernels import crossings_of_segments
from hemline.motions import JOINT_NAMES
from hemline.sim import SimSettings, Stepper, StepScene, rest_drape
from hemline.sim.contact.pairs.capsule_kernels import SEARCH_RADII, nearest_on_triangle, segment_hits_triangle
from hemline.sim.contact.pairs.capsules import BONES, CAPSULE_STIFFNESS, Capsules
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.model import make_model
from hemline.tryon.skeleton import Skeleton
from tests.sim.sim_poses import kick_motion

KNEE, ANKLE = JOINT_NAMES.index("left_knee"), JOINT_NAMES.index("left_ankle")
SHIN = BONES.tolist().index([KNEE, ANKLE])


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def capsules(shaped):
    return Capsules.of(shaped)


def with_shin(shaped, ends):
    """The joints at rest, but for the two of the left shin; the thigh goes up from it."""
    joints = shaped.joints.astype(np.float64)
    joints[[KNEE, ANKLE]] = ends
    joints[JOINT_NAMES.index("left_hip")] = ends[0] + [0, 5.0, 0]
    return joints


def nearest(triangle, ends):
    """Share of a segment, and distance, where it is nearest to a triangle: convex along the segment."""

    def away(share):
        point = (1 - share) * ends[0] + share * ends[1]
        return float(np.linalg.norm(trimesh.triangles.closest_point(triangle[None], point[None])[0] - point))

    found: Any = minimize_scalar(away, bounds=(0, 1), method="bounded", options={"xatol": 1e-10})
    return min(((away(share), share) for share in (float(found.x), 0.0, 1.0)), key=lambda each: each[0])


def scattered(count, ends, seed):
    """Small triangles around a segment, each with vertices of its own."""
    rng = np.random.default_rng(seed)
    middle = (
        ends[0] + rng.uniform(-0.15, 1.15, (count, 1)) * (ends[1] - ends[0]) + rng.normal(scale=0.03, size=(count, 3))
    )
    corners = middle[:, None] + rng.normal(scale=0.012, size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def test_rows_are_those_of_a_search_triangle_by_triangle(shaped, capsules):
    """Second route: trimesh for the triangle, scipy along the axis and for the axis' turn."""
    then = np.array([[0.1, -0.4, 0.0], [0.15, -0.8, 0.05]])
    now = then + [[0.02, 0.01, 0.0], [-0.03, 0.06, 0.2]]
    x, faces = scattered(400, then, 4)
    limb = np.where(np.arange(400) % 3 == 0, -1, capsules.limb[SHIN])
    stiffness = np.random.default_rng(5).uniform(100, 200, len(x))
    rows = capsules.rows(x, faces, limb, with_shin(shaped, then), with_shin(shaped, now), stiffness)
    radius, way = capsules.radius[SHIN], then[1] - then[0]
    across = np.cross(way, now[1] - now[0])
    turn = Rotation.align_vectors([now[1] - now[0], across], [way, across])[0]
    found = {}
    for row in range(rows.size):
        share = np.linalg.norm(rows.carried[row] - now[0]) / np.linalg.norm(now[1] - now[0])
        thick = radius[0] + share * (radius[1] - radius[0])
        # the thigh ends in the same knee, thicker
        if np.allclose(rows.carried[row], now[0] + share * (now[1] - now[0])) and np.isclose(
            rows.thickness[row], thick
        ):
            found[int(rows.corners[row, 0]) // 3] = (row, share)
    expected = 0
    for face, corners in enumerate(x[faces]):
        away, share = nearest(corners, then)
        thick = radius[0] + share * (radius[1] - radius[0])
        if limb[face] < 0 or segment_hits_triangle(*then, *corners) or away > SEARCH_RADII * thick:
            assert face not in found
            continue
        expected += 1
        row, at = found[face]
        on = rows.weights[row] @ x[rows.corners[row]]
        assert np.linalg.norm(on - then[0] - share * way) == pytest.approx(away, abs=1e-6)
        assert at == pytest.approx(share, abs=1e-3) and rows.thickness[row] == pytest.approx(thick, rel=1e-3)
        outward = turn.apply((on - then[0] - at * way) / np.linalg.norm(on - then[0] - at * way))
        assert np.abs(rows.normal[row] - outward).max() < 1e-6
        assert rows.reach[row] == pytest.approx(rows.normal[row] @ rows.carried[row] + rows.thickness[row])
        assert rows.stiffness[row] == pytest.approx(
            CAPSULE_STIFFNESS * rows.weights[row] @ stiffness[rows.corners[row]]
        )
    assert expected == len(found) > 100 and not rows.limit.any()


def test_a_triangle_that_the_bone_goes_through_is_let_go(shaped, capsules):
    ends = np.array([[0.0, 0.2, 0.0], [0.0, -0.2, 0.0]])
    corners = np.array([[0.01, 0.0, 0.0], [-0.01, 0.0, 0.01], [-0.01, 0.0, -0.01]])
    for beside in (0.0, 0.02):
        joints, through = with_shin(shaped, ends), beside == 0
        rows = capsules.rows(
            corners + [beside, 0, 0], np.array([[0, 1, 2]]), capsules.limb[[SHIN]], joints, joints, np.ones(3)
        )
        assert segment_hits_triangle(*ends, *(corners + [beside, 0, 0])) == through
        assert rows.size == (0 if through else 1)


def test_triangles_at_pins_or_between_limbs_are_left_alone(square):
    sheet, _ = square(3)
    model = make_model(sheet, pinned=np.array([0]), rest_limb=np.array([1, 1, 1, 1, 1, 1, 2, 2, 2]))
    for face, limb in zip(sheet.faces, model.limb_of_face, strict=True):
        of = {1 if vertex < 6 else 2 for vertex in face}
        assert limb == (-1 if 0 in face or len(of) > 1 else of.pop())
    assert set(model.limb_of_face) == {-1, 1}


@pytest.mark.parametrize("end", [0, 1])
def test_a_bone_that_points_at_a_triangle_is_held_off_at_its_end(end):
    ends = np.array([[0.0, 0.01, 0.0], [0.0, 0.31, 0.0]])[:: 1 - 2 * end]
    below = np.array([[0.03, 0.0, 0.0], [-0.02, 0.0, 0.02], [-0.02, 0.0, -0.02]])
    share, v, w, square = nearest_on_triangle(*ends, *below)
    assert share == end and square == pytest.approx(1e-4)
    assert [1 - v - w, v, w] @ below == pytest.approx(np.zeros(3), abs=1e-12)


def test_all_are_found_where_there_are_many(shaped, capsules):
    ends = np.array([[0.1, -0.4, 0.0], [0.1, -0.8, 0.0]])
    middle = np.linspace(ends[0], ends[1], 1000) + [0.01, 0, 0]
    corners = middle[:, None] + np.array([[0, 0, 0], [0.001, 0, 0], [0, 0, 0.001]])
    joints, limb = with_shin(shaped, ends), np.full(1000, capsules.limb[SHIN])
    faces = np.arange(3000).reshape(-1, 3)
    rows = capsules.rows(corners.reshape(-1, 3), faces, limb, joints, joints, np.ones(3000))
    assert set(rows.corners[:, 0] // 3) == set(range(1000))


@pytest.mark.parametrize("betas", [(), (3.0, -1.0, 2.0), (-3.0, 1.0, 1.0, -2.0), (0.0, 3.0, -3.0, 2.0)])
def test_the_capsules_are_deep_inside_the_body_at_rest(betas):
    """So nothing touches them that is worn, but where the skin is folded into itself."""
    shaped = bodies.load("anny24").shaped(betas)
    for ends, radii in zip(shaped.joints[BONES], Capsules.of(shaped).radius, strict=True):
        way = ends[1] - ends[0]
        share = np.clip((shaped.vertices - ends[0]) @ way / (way @ way), 0, 1)
        distance = np.linalg.norm(shaped.vertices - ends[0] - share[:, None] * way, axis=1)
        assert (distance / (radii[0] + share * (radii[1] - radii[0]))).min() > 1.3
        assert radii[0] >= radii[1] > 0.01


@pytest.mark.parametrize("worn", ["on the limb", "on another", "being dressed"])
def test_a_bone_carries_the_cloth_of_its_limb_and_no_other(square, shaped, capsules, worn):
    """A shin rises at 1 m/s through a sheet that lies 4 cm over it; there is no skin at all."""
    sheet, x = square(13, 0.24, density=0.15, young=120.0, damping=0.003)
    rest_limb = np.full(len(x), capsules.limb[SHIN] if worn != "on another" else 0)
    stepper = Stepper(sheet, capsules=capsules, rest_limb=rest_limb, settings=SimSettings(self_contact=False))
    state = stepper.start(x - [0.12, 0, 0.12])
    state = replace(state, contact_history=None) if worn == "being dressed" else state
    ends, steps, h = np.array([[0.0, -0.04, -0.2], [0.0, -0.04, 0.2]]), 24, 1 / 240

    def shin(time):
        return with_shin(shaped, ends + [0, time, 0])

    for step in range(steps):
        scene = lambda share, step=step: StepScene(np.zeros((0, 3)), joints=shin((step + share) * h))  # noqa: E731
        state, _ = stepper.advance(state, h, scene)
    over = state.positions[np.abs(x[:, 0] - 0.12) < 1e-6, 1] - (steps * h - 0.04)
    assert over.min() > 0.01 if worn == "on the limb" else over.max() < -0.02


@pytest.mark.parametrize("guarded", [True, False])
def test_a_trouser_leg_stays_around_a_knee_that_is_folded_as_far_as_it_goes(shaped, guarded):
    trousers, motion = garments.load("trousers-light"), kick_motion(shaped, 12)
    settings = SimSettings(lead_in=0.0)
    dressed = DressedBody(trousers, shaped, settings)
    if not guarded:
        dressed.stepper.model = replace(dressed.model, capsules=None)
    state = dressed.stepper.start(rest_drape(trousers, shaped, settings).vertices[0])
    worst = 0
    for frame in range(len(motion) - 1):
        simulated = dressed.simulate_frame(state, motion[frame], motion[frame + 1])
        state, posed = simulated.state, simulated.posed
        skeleton = Skeleton.of(posed.joints)
        through = np.empty(len(skeleton.limbs), np.int64)
        crossings_of_segments(skeleton.points, skeleton.limbs, state.positions, trousers.faces, through)
        worst = max(worst, int(through.sum()))
    assert (worst == 0) == guarded

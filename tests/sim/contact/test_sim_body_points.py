"""Vertices of the body against triangles of the cloth."""

from dataclasses import replace

import igl
import numpy as np
import pytest
import trimesh

from hemline import bodies
from hemline.bench.simulator import make_shirt
from hemline.bodies.velocities import reshaping_velocity
from hemline.sim import BodySurface, MovingSkin, Sensitivities, SimSettings, Stepper, StepScene, settle
from hemline.sim.cloth.join import join_sheets
from hemline.sim.contact.pairs import body_points
from hemline.sim.contact.pairs.body_point_kernels import MAX_POINT_DEPTH
from hemline.sim.rest.static_step import StaticStep
from hemline.sim.step.step import Step

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops

RADIUS = 0.008
"""Of the ball that stands for a finger: it fits through a triangle of 3 cm."""


def finger(height, *, at=(0.12, 0.12)):
    """A small ball whose middle is that high."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=RADIUS)
    vertices = np.asarray(ball.vertices, np.float32)
    moved = vertices + np.array([at[0], height, at[1]], np.float32)
    return MovingSkin(moved, vertices / np.float32(RADIUS)), np.asarray(ball.faces)


def step_of(stepper, state, h, then, now):
    """A step whose contact has been found, not solved yet."""
    scenes = (StepScene(np.zeros((0, 3)), skin) for skin in (then, now))
    return Step(stepper.model, stepper.workspace, state, h, *scenes)


def points_of(stepper, x, skin):
    """The points of cloth at rest over a body at rest."""
    return step_of(stepper, stepper.start(x), 1e-6, skin, skin).pair_contacts.points


def rim(x, size):
    """Vertices at the edge of a square sheet."""
    return np.flatnonzero((np.abs(x[:, [0, 2]] - size / 2) > size / 2 - 1e-6).any(axis=1))


def heights_above(skin, x, faces):
    """How high the cloth is above each vertex of the body, by libigl."""
    _, _, closest = igl.point_mesh_squared_distance(skin.vertices.astype(float), x, faces.astype(np.int64))[:3]
    return closest[:, 1] - skin.vertices[:, 1]


# offset of the finger from a corner of the 3 cm grid: inside a triangle, on a long edge, on a short one
@pytest.mark.parametrize("offset", [(0.01, 0.02), (0.015, 0.015), (0.0, 0.015)])
def test_a_finger_lifts_the_triangle_that_it_comes_up_under(square, offset):
    sheet, x = square(9, 0.24, density=0.15, young=120.0, damping=0.003, friction=0.3)
    at, pins = (0.12 + offset[0], 0.12 + offset[1]), rim(x, 0.24)
    stepper = Stepper(sheet, pinned=pins, surface=BodySurface(finger(0.0)[1], reach=0.04))
    state, steps = stepper.start(x), 60

    def scene(time):
        # the top starts 5 mm below the sheet and rises by 3 cm in half a second
        return StepScene(x[pins], finger(0.03 * time - RADIUS - 0.005, at=at)[0])

    for step in range(steps):
        state, _ = stepper.advance(state, 1 / 120, lambda share, step=step: scene((step + share) / steps))
    skin = scene(1.0).skin
    above = heights_above(skin, state.positions, sheet.faces)
    top = skin.vertices[:, 1].argmax()
    assert skin.vertices[top, 1] == pytest.approx(0.025)
    # pressed in by the load, but by less than half of the distance that vertices keep
    assert above[top] > -0.0015
    assert (above < -0.0015).sum() == 0


def test_points_are_where_libigl_finds_body_vertices_behind_the_cloth(square):
    sheet, x = square(9, 0.24)
    skin, faces = finger(-RADIUS + 0.002, at=(0.13, 0.14))
    points, vertices = (
        points_of(Stepper(sheet, surface=BodySurface(faces, reach=0.04)), x, skin),
        skin.vertices.astype(float),
    )
    squared, _, closest = igl.point_mesh_squared_distance(vertices, x, sheet.faces.astype(np.int64))[:3]
    slack = points.distance + body_points.POINT_MARGIN
    # the ball's top stands 2 mm out; how far the cloth is from the ball itself, negative inside
    height = np.einsum("vi,vi->v", skin.normals, closest - vertices)
    gap = igl.signed_distance(closest, vertices, faces.astype(np.int64))[0]
    near = (np.sqrt(squared) < MAX_POINT_DEPTH) & (np.abs(height) < MAX_POINT_DEPTH) & (height < slack)
    # planes are those of interpolated normals, the triangles of the ball are not smooth: 0.2 mm
    sure, possible = (set(np.flatnonzero(near & (gap < slack + more))) for more in (-2e-4, 2e-4))
    assert 10 < len(sure) < 60 and sure <= set(points.body_vertex) <= possible
    assert points.at(x) == pytest.approx(closest[points.body_vertex], abs=1e-6)


def test_forces_are_the_slope_of_the_energy(square):
    sheet, x = square(9, 0.24, density=0.15, young=120.0, friction=0.5)
    then, faces = finger(-RADIUS + 0.001, at=(0.13, 0.14))
    now, _ = finger(-RADIUS + 0.0015, at=(0.1305, 0.14))
    stepper = Stepper(sheet, surface=BodySurface(faces, reach=0.04))
    step = step_of(stepper, stepper.start(x), 1 / 120, then, now)
    potential, rows = step.potential, step.potential.pairs.pairs.rows
    assert rows.size > 5 and (rows.limit > 0).any()
    gradient, middle = stepper.workspace.evaluation.gradient.copy(), potential.x
    rng, way = np.random.default_rng(4), 1e-8
    for _ in range(5):
        direction = np.zeros_like(x)
        direction[np.unique(rows.corners)] = rng.normal(size=(len(np.unique(rows.corners)), 3))
        ends = []
        for sign in (1, -1):
            potential.evaluate(middle + sign * way * direction)
            ends.append(potential.energy)
        slope = (ends[0] - ends[1]) / (2 * way)
        assert slope == pytest.approx((gradient * direction).sum(), rel=1e-4)


def test_each_of_two_pieces_meets_the_finger(square):
    sheet, x = square(9, 0.24)
    both, points = join_sheets([sheet, sheet]), np.concatenate([x, x + [0.0, 0.0004, 0.0]])
    skin, faces = finger(-RADIUS + 0.002, at=(0.13, 0.14))
    stepper = Stepper(both, surface=BodySurface(faces, reach=0.04), settings=SimSettings(self_contact=False))
    found = points_of(stepper, points, skin)
    piece = both.piece[found.corners[:, 0]]
    assert len(np.intersect1d(found.body_vertex[piece == 0], found.body_vertex[piece == 1])) > 10


def test_cloth_that_falls_fast_meets_the_near_side_alone(square):
    sheet, x = square(9, 0.24)
    skin, faces = finger(-RADIUS - 0.001, at=(0.13, 0.14))
    stepper = Stepper(sheet, surface=BodySurface(faces, reach=0.04))
    state = replace(stepper.start(x), velocities=np.tile([0.0, -3.0, 0.0], (len(x), 1)))
    points = step_of(stepper, state, 1 / 120, skin, skin).pair_contacts.points
    # in this step it would fall by 25 mm, through all of the ball
    height = skin.normals[points.body_vertex, 1]
    # those just below the equator are as near as the cloth is above them: 5 mm along their normals at most
    assert len(height) > 10 and height.min() > -0.5


def test_no_thickness_no_points(square):
    sheet, x = square(9, 0.24)
    skin, faces = finger(-RADIUS + 0.002, at=(0.13, 0.14))
    stepper = Stepper(
        sheet, surface=BodySurface(faces, reach=0.04), settings=SimSettings(thickness=0.0, self_contact=False)
    )
    step = step_of(stepper, stepper.start(x), 1e-6, skin, skin)
    assert step.potential.pairs is None and step.pair_contacts.points is None


@pytest.mark.slow
def test_what_a_growing_body_does_to_the_points_is_in_the_derivatives(monkeypatch):
    # a wide distance, so that a shirt of coarse triangles is held by points all over
    monkeypatch.setattr(body_points, "DISTANCE_RATIO", 0.6)
    shaped = bodies.load("anny24").shaped()
    settings = SimSettings(self_contact=False)
    rest = settle(make_shirt(shaped), shaped, settings=settings)
    derivatives = Sensitivities(rest)
    posed, way = shaped.posed(rest.pose), 1e-5
    velocity, ends = reshaping_velocity(posed, 1), []
    for sign in (1, -1):
        # the same points, each on its triangle of the changed body: what a step finds, as long as none changes sides
        skin = MovingSkin(posed.vertices.astype(float) + sign * way * velocity, posed.normals.astype(float))
        step = StaticStep(
            derivatives._dressed.model,
            derivatives._dressed.stepper.workspace,
            rest.positions,
            rest.pinched,
            StepScene(np.zeros((0, 3)), skin),
            rest.friction_anchors,
            crease_face=rest.face,
        )
        ends.append(step.potential.workspace.pressed.copy())
    loaded = len(derivatives._step.pair_contacts.points)
    assert loaded > 100
    # `pressed` holds the gradient of pairs alone, as the shirt is flat
    wanted = -(ends[0] - ends[1]) / (2 * way)
    skins = [posed.vertices.astype(float) + sign * way * velocity for sign in (1, -1)]
    found = [derivatives._point_forces(MovingSkin(each, posed.normals.astype(float))) for each in skins]
    difference = (found[0] - found[1]) / (2 * way)
    assert np.linalg.norm(difference - wanted) < 0.05 * np.linalg.norm(wanted)

"""Cloth between parts of a body that go through each other: it comes out on the side that it went in on."""

import numpy as np
import pytest
import trimesh

from hemline.sim import BodySurface, MovingSkin, SimSettings, Stepper, StepScene
from hemline.sim.contact.history.contact_history import ContactHistory
from hemline.sim.contact.history.history_kernels import (
    FORGET_HEIGHT,
    MAX_DEPTH,
    MAX_SKEW,
    share_no_corner,
    walk_downhill,
)

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops

STEPS, H = 120, 1 / 240


def block(size, centre, detail=0.012):
    """A box with edges of about that length."""
    box = trimesh.creation.box(extents=size)
    vertices, faces = trimesh.remesh.subdivide_to_size(box.vertices, box.faces, detail)
    mesh = trimesh.Trimesh(vertices, faces)
    mesh.merge_vertices()
    return np.asarray(mesh.vertices) + np.array(centre), np.asarray(mesh.faces), np.asarray(mesh.vertex_normals)


class Blocks:
    """Two boxes above each other as one body; the upper one moves down and up again."""

    def __init__(self, lower, upper):
        (self.low, faces, first), (self.high, others, second) = lower, upper
        self.normals = np.concatenate([first, second]).astype(np.float32)
        self.faces = np.concatenate([faces, others + len(self.low)]).astype(np.int32)
        self.limb = np.repeat([0, 1], [len(faces), len(others)])

    def skin(self, down):
        moved = np.concatenate([self.low, self.high - [0, down, 0]])
        return MovingSkin(moved.astype(np.float32), self.normals)


def press_and_release(square, body, way, *, limb=None):
    """The sheet at height 0 after the upper block went along that way over time, from 0 to 1."""
    sheet, x = square(13, 0.12, density=0.15, young=120.0, damping=0.003, friction=0.3)
    x = x - [0.06, 0, 0.06]
    surface = BodySurface(body.faces, reach=0.04, limb=limb)
    settings = SimSettings(gravity=(0.0, -1.0, 0.0), self_contact=False)
    stepper = Stepper(sheet, surface=surface, settings=settings)
    state = stepper.start(x)
    for step in range(STEPS):
        state, _ = stepper.advance(
            state, H, lambda share, step=step: StepScene(np.zeros((0, 3)), body.skin(way((step + share) / STEPS)))
        )
    return state.positions


def test_cloth_comes_out_of_a_fold_where_it_went_in(square):
    """Plates of 3 cm are pressed 2 cm into each other: the closest skin to cloth between them is a far side."""
    plate = (0.2, 0.03, 0.2)
    body = Blocks(block(plate, (0, -0.02, 0)), block(plate, (0, 0.03, 0)))
    # 2 cm apart at first, 2 cm inside each other halfway
    end = press_and_release(square, body, lambda time: 0.04 * np.sin(np.pi * time))
    assert end[:, 1].min() > -0.006 and end[:, 1].max() < 0.016


@pytest.mark.parametrize("limbs", [True, False])
def test_what_goes_through_a_limb_does_not_take_its_cloth_along(square, limbs):
    """A bar falls on cloth that lies on a block, through the block, and on."""
    body = Blocks(block((0.2, 0.04, 0.2), (0, -0.025, 0)), block((0.3, 0.03, 0.03), (0, 0.04, 0)))
    end = press_and_release(square, body, lambda time: 0.2 * time, limb=body.limb if limbs else None)
    dragged = (end[:, 1] < -0.02).sum()
    # where nothing tells the bar from the block, it does
    assert dragged == 0 if limbs else dragged > 10


def test_the_first_place_is_the_closest_one_where_nothing_overlaps():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    vertices = np.asarray(ball.vertices, np.float32)
    skin, surface = MovingSkin(vertices, vertices / np.float32(0.3)), BodySurface(np.asarray(ball.faces), reach=0.06)
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(300, 3))
    points = 0.31 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    fixed, rest_limb = np.zeros(300, bool), np.zeros(300, np.int64)
    history = ContactHistory.from_faces(np.full((300, 2), -1, np.int32), surface)
    for _ in range(5):
        points = points + rng.normal(scale=0.004, size=points.shape)
        found = surface.closest(points, skin, fixed)
        history = ContactHistory.from_faces(history.faces, surface).advance(surface, points, skin, found, rest_limb)
        assert np.array_equal(history.first.face, found.face)
        # slid over a ball, a place is the closest one
        assert not (history.second.face >= 0).any()


def test_a_place_that_was_left_is_kept_until_it_is_far(square):
    """Between two plates: the one that the cloth came from first, then the other; then the first is out of reach."""
    plate = (0.2, 0.03, 0.2)
    body = Blocks(block(plate, (0, -0.02, 0)), block(plate, (0, 0.03, 0)))
    surface, skin = BodySurface(body.faces, reach=0.04), body.skin(0.0)
    points, fixed, rest_limb = np.zeros((1, 3)), np.zeros(1, bool), np.zeros(1, np.int64)
    history = ContactHistory.from_faces(np.full((1, 2), -1, np.int32), surface)
    seen = []
    for height in (0.0, 0.002, 0.008, 0.009, 0.0145, 0.003):
        points[0, 1] = height
        history = history.advance(surface, points, skin, surface.closest(points, skin, fixed), rest_limb)
        seen.append([-1 if face < 0 else int(body.limb[face]) for face in history.faces[0]])
    lower, upper, none = 0, 1, -1
    assert seen == [[lower, none], [lower, none], [upper, lower], [upper, lower], [upper, none], [lower, upper]]


@pytest.mark.parametrize("rest_limb", [0, 1])
def test_only_its_own_limb_takes_a_vertex_back_from_another_one_in_flesh(rest_limb):
    """A bar that came with it has taken the vertex 8 mm into the block, past the bar's own lower side."""
    body = Blocks(block((0.2, 0.04, 0.2), (0, -0.025, 0)), block((0.3, 0.03, 0.03), (0, 0.04, 0)))
    surface, skin = BodySurface(body.faces, reach=0.04, limb=body.limb), body.skin(0.055)
    points, fixed = np.array([[0.0, -0.013, 0.0]]), np.zeros(1, bool)
    found = surface.closest(points, skin, fixed)
    under = np.flatnonzero((body.limb == 1) & (body.low.shape[0] <= body.faces.min(axis=1)))
    centres = skin.vertices[body.faces[under]].mean(axis=1)
    bar = under[np.linalg.norm(centres - [0.0, -0.03, 0.0], axis=1).argmin()]
    history = ContactHistory.from_faces(np.array([[bar, -1]], np.int32), surface)
    assert body.limb[found.face[0]] == 0, "the block's top is closest"
    moved = history.advance(surface, points, skin, found, np.array([rest_limb]))
    assert body.limb[moved.first.face[0]] == rest_limb
    assert (moved.second.face[0] >= 0) == (rest_limb == 0)


def test_a_place_slides_over_the_skin_to_where_it_is_closest():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    vertices = np.asarray(ball.vertices, np.float32)
    skin, surface = MovingSkin(vertices, vertices / np.float32(0.3)), BodySurface(np.asarray(ball.faces), reach=0.06)
    direction = np.random.default_rng(9).normal(size=(200, 3))
    points = 0.31 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    nobody = np.zeros(200, bool)
    before = surface.closest(points, skin, nobody)
    # 8 cm farther: five edges of the ball
    later = points + 0.08 * np.cross(points, [0.0, 0.0, 1.0]) / 0.31
    later *= 0.31 / np.linalg.norm(later, axis=1, keepdims=True)
    closest = surface.closest(later, skin, nobody)
    assert not np.array_equal(before.face, closest.face)
    mesh = surface.mesh(skin)
    for i, vertex in enumerate(before.nearest):
        _, face, v, w = walk_downhill(later, i, vertex, mesh)
        assert face == closest.face[i] and (v, w) == pytest.approx(closest.weights[i])


def first_after(body, came, point):
    """Whether a vertex that was held off by that face still is where it is now; and whether other skin is closer."""
    surface, skin = BodySurface(body.faces, reach=0.04), body.skin(0.0)
    points = np.array([point])
    found = surface.closest(points, skin, np.zeros(1, bool))
    history = ContactHistory.from_faces(np.array([[came, -1]], np.int32), surface)
    first = history.advance(surface, points, skin, found, np.zeros(1, np.int64)).first
    return not share_no_corner(surface.faces, first.face[0], came), share_no_corner(surface.faces, found.face[0], came)


def face_near(body, point):
    return np.linalg.norm(body.skin(0.0).vertices[body.faces].mean(axis=1) - point, axis=1).argmin()


def test_thin_flesh_is_not_left_on_its_other_side():
    body = Blocks(block((0.1, 0.008, 0.1), (0, 0, 0)), block((0.1, 0.02, 0.1), (0, 0.2, 0)))
    assert first_after(body, face_near(body, (0.0, 0.004, 0.0)), (0.0, -0.001, 0.0)) == (True, True)


def test_skin_that_looks_the_same_way_is_not_taken_from_deep_below_it():
    body = Blocks(block((0.1, 0.03, 0.1), (0, 0, 0)), block((0.1, 0.04, 0.1), (0, 0.025, 0)))
    came = face_near(body, (0.0, 0.015, 0.0))
    # 20 mm over the lower top, 10 mm below the upper one
    assert first_after(body, came, (0.0, 0.035, 0.0)) == (True, True)


def reference_places(surface, points, skin, found, rest_limb, history):
    """First and second faces of each vertex, one after the other, by the words of `contact_history`."""
    mesh = surface.mesh(skin)

    def slid(i, place):
        return walk_downhill(points, i, history.nearest[place, i], mesh)[1:]

    def over(i, face, v, w):
        corners, weights = surface.faces[face], np.array([1 - v - w, v, w])
        normal = weights @ skin.normals[corners].astype(float)
        way = points[i] - weights @ skin.vertices[corners].astype(float)
        return way @ normal / np.linalg.norm(normal), np.linalg.norm(way), normal

    result = []
    for i in range(len(points)):
        closest = (int(found.face[i]), *found.weights[i])
        came = slid(i, 0) if history.face[0, i] >= 0 else None
        left = slid(i, 1) if history.face[1, i] >= 0 else None
        jumps = came is not None and share_no_corner(surface.faces, history.face[0, i], closest[0])
        jumps = jumps and share_no_corner(surface.faces, came[0], closest[0])
        first, second = closest, left
        if jumps:
            across = over(i, *closest)[2] @ over(i, *came)[2] < 0
            known = left is not None and not share_no_corner(surface.faces, left[0], closest[0])
            returns = surface.limb[closest[0]] == rest_limb[i] != surface.limb[came[0]]
            height = over(i, *closest)[0]
            if height < 0 and (across or height < -MAX_DEPTH) and not returns and not known:
                first = came
            else:
                second = came
        if second is not None:
            height, distance, _ = over(i, *second)
            kept = (
                share_no_corner(surface.faces, first[0], second[0])
                and height < FORGET_HEIGHT
                and distance < MAX_SKEW * abs(height) + MAX_DEPTH
            )
            second = second if kept else None
        result.append([first[0], -1 if second is None else second[0]])
    return np.array(result)


def test_places_equal_those_of_the_plain_reference():
    """Cloth that is stirred between two plates, which are in each other half of the time."""
    plate, rng = (0.2, 0.03, 0.2), np.random.default_rng(11)
    body = Blocks(block(plate, (0, -0.02, 0)), block(plate, (0, 0.03, 0)))
    surface = BodySurface(body.faces, reach=0.04, limb=body.limb)
    points = rng.uniform([-0.08, 0.0, -0.08], [0.08, 0.01, 0.08], (300, 3))
    fixed, rest_limb = np.zeros(300, bool), rng.integers(0, 2, 300)
    history, seen = ContactHistory.from_faces(np.full((300, 2), -1, np.int32), surface), np.zeros(3, int)
    for step in range(12):
        skin = body.skin(0.02 + 0.025 * np.sin(step))
        points = points + rng.normal(scale=0.004, size=points.shape)
        found = surface.closest(points, skin, fixed)
        expected = reference_places(surface, points, skin, found, rest_limb, history)
        history = history.advance(surface, points, skin, found, rest_limb)
        assert np.array_equal(history.faces, expected)
        seen += [(expected[:, 1] >= 0).sum(), (expected[:, 0] != found.face).sum(), (expected[:, 1] < 0).sum()]
    assert (seen > 100).all()


def test_the_other_limb_yields_where_both_press():
    """Of five vertices: on its own limb alone; between both, free; pressed; pinched; on another limb alone, pinched."""
    plate = (0.2, 0.03, 0.2)
    body = Blocks(block(plate, (0, -0.02, 0)), block(plate, (0, 0.03, 0)))
    surface, skin = BodySurface(body.faces, reach=0.04, limb=body.limb), body.skin(0.0)
    lower, upper = face_near(body, (0, -0.005, 0)), face_near(body, (0, 0.015, 0))
    faces = np.array([[lower, -1], [lower, upper], [upper, lower], [lower, upper], [upper, -1]], np.int32)
    middle = np.array([skin.vertices[body.faces[lower]].mean(axis=0)] * 5, float)
    middle[:, 1] = [-0.002, -0.002, -0.009, -0.002, 0.01]
    pinched = np.array([False, False, False, True, True])
    history = ContactHistory.from_faces(faces, surface)
    history.weights[:] = 1 / 3
    shared = history.stiffnesses(surface, middle, skin, np.zeros(5, np.int64), pinched, np.full(5, 10.0), 0.02)
    assert pytest.approx(np.array([[10, 10], [10, 10], [0.2, 10], [10, 0.2], [0.2, 10]])) == shared.T

"""The rasteriser against closed forms and plain NumPy."""

import numpy as np
import pytest
import trimesh
from scipy.ndimage import uniform_filter

from hemline.errors import BadInput
from hemline.meshes import vertex_normals
from hemline.pictures import Camera, ShadedSurface, linear, picture_kernels, render

FRONT = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), field_of_view=0.7)
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
TWO = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def ball(radius=0.5, centre=(0, 0, 0), subdivisions=4):
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return (np.array(mesh.vertices) + centre).astype(np.float32), np.array(mesh.faces, np.int32)


def brightness(picture):
    return picture.astype(int).sum(axis=-1)


def rasterised(screen, faces, shape):
    depth, seen = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
    picture_kernels.rasterise(screen, faces, depth, seen)
    return depth, seen


def rasterised_plainly(screen, faces, shape):
    depth, seen = np.zeros(shape), np.full(shape, -1)
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    for index, (a, b, c) in enumerate(screen[faces].astype(np.float64)):
        if min(a[2], b[2], c[2]) <= 0:
            continue
        weights = np.linalg.solve(
            [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [1, 1, 1]], [x.ravel(), y.ravel(), np.ones(x.size)]
        )
        z = (weights.T @ [a[2], b[2], c[2]]).reshape(shape)
        nearer = (weights.min(axis=0).reshape(shape) >= 0) & (z > depth)
        depth[nearer], seen[nearer] = z[nearer], index
    return depth, seen


def test_the_visibility_buffer_is_that_of_plain_numpy():
    rng = np.random.default_rng(0)
    screen = np.concatenate([rng.uniform(-10, 60, (90, 2)), rng.uniform(-0.1, 1, (90, 1))], axis=1).astype(np.float32)
    faces = np.arange(90, dtype=np.int32).reshape(30, 3)
    depth, seen = rasterised(screen, faces, (40, 50))
    plain_depth, plain_seen = rasterised_plainly(screen, faces, (40, 50))
    assert (seen >= 0).mean() > 0.5
    assert (seen != plain_seen).mean() < 0.002  # pixels within rounding of an edge
    same = seen == plain_seen
    np.testing.assert_allclose(depth[same], plain_depth[same], atol=2e-5)


def test_two_triangles_that_share_an_edge_leave_no_gap():
    screen = np.array([[3.3, 2.1, 1], [44.7, 5.2, 1], [40.2, 36.6, 1], [5.9, 33.3, 1]], np.float32)
    whole = rasterised(screen, TWO, (40, 50))[1] >= 0
    y, x = np.mgrid[:40, :50] + 0.5
    for start, end in zip(screen, np.roll(screen, -1, axis=0), strict=True):
        side = (end[0] - start[0]) * (y - start[1]) - (end[1] - start[1]) * (x - start[0])
        assert whole[(side > 30) & whole].all()
        assert not whole[side < -0.1].any()
    inner = np.zeros_like(whole)
    inner[8:30, 9:38] = True
    assert whole[inner].all()


def test_a_ball_covers_the_disc_that_geometry_says():
    vertices, faces = ball()
    empty = render([], FRONT, (400, 400), ground=None)
    covered = (render([ShadedSurface(vertices, faces)], FRONT, (400, 400), ground=None) != empty).any(axis=-1)
    radius = 0.5 / np.sqrt(3.0**2 - 0.5**2) * 200 / np.tan(0.35)
    assert covered.sum() == pytest.approx(np.pi * radius**2, rel=0.015)
    y, x = np.nonzero(covered)
    assert (x.mean(), y.mean()) == (pytest.approx(199.5, abs=0.3), pytest.approx(199.5, abs=0.3))


def test_the_nearer_surface_hides_the_other_in_either_order():
    near, far = (
        ShadedSurface(SQUARE * 0.3 + np.array([0, 0, 0.5], np.float32), TWO, (0, 0, 1)),
        ShadedSurface(SQUARE, TWO, (1, 0, 0)),
    )
    for order in ([near, far], [far, near]):
        red, _, blue = render(order, FRONT, (64, 64), ground=None)[32, 32].tolist()
        assert blue > red + 50


def test_the_inside_has_another_colour():
    outside = render(
        [ShadedSurface(SQUARE, TWO, (0.8, 0.4, 0.4), inside=(0.05, 1.0, 0.05))], FRONT, (64, 64), ground=None
    )
    turned = TWO[:, ::-1].copy()
    inside = render(
        [ShadedSurface(SQUARE, turned, (0.8, 0.4, 0.4), inside=(0.05, 1.0, 0.05))], FRONT, (64, 64), ground=None
    )
    assert outside[32, 32, 0] > outside[32, 32, 1] + 30
    assert inside[32, 32, 1] > inside[32, 32, 0] + 30


def test_colours_at_vertices_are_interpolated():
    colours = np.array([[1, 0, 0], [0, 0, 1], [0, 0, 1], [1, 0, 0]], np.float32)
    row = render([ShadedSurface(SQUARE, TWO, colours=colours, sheen=0.0)], FRONT, (64, 64), ground=None)[32]
    left, right = row[8].astype(int), row[56].astype(int)
    assert left[0] > left[2] + 50
    assert right[2] > right[0] + 50


def test_a_ball_above_a_plate_shades_it():
    plate = np.array([[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], np.float32)
    camera = Camera((0.0, 4.0, 6.0), (0.0, 0.0, 0.0))
    alone = render([ShadedSurface(plate, TWO, (0.8, 0.8, 0.8))], camera, (128, 128), ground=None)
    both = render(
        [ShadedSurface(plate, TWO, (0.8, 0.8, 0.8)), ShadedSurface(*ball(0.3, (0, 0.8, 0)), (0, 0, 1))],
        camera,
        (128, 128),
        ground=None,
    )
    grey = np.abs(both[..., 0].astype(int) - both[..., 2]) < 40
    darker = (brightness(both) < brightness(alone) - 60) & grey
    assert darker.sum() > 50
    x = np.nonzero(darker)[1]
    assert x.mean() < 60  # the light comes from the right


def test_the_ground_gets_a_shadow_and_hides_nothing_above_it():
    camera = Camera((0.0, 2.0, 6.0), (0.0, 0.3, 0.0))
    empty = render([], camera, (128, 128), ground=None)
    with_ball = render([ShadedSurface(*ball(0.3, (0, 0.4, 0)), (0.8, 0.2, 0.2))], camera, (128, 128), ground=0.0)
    without = render([ShadedSurface(*ball(0.3, (0, 0.4, 0)), (0.8, 0.2, 0.2))], camera, (128, 128), ground=None)
    ball_seen = (without != empty).any(axis=-1)
    same_ball = (with_ball == without).all(axis=-1)
    assert same_ball[ball_seen].mean() > 0.9  # all but its outline
    assert brightness(with_ball)[~ball_seen].min() < 0.75 * np.median(brightness(with_ball)[~ball_seen])


def test_what_is_behind_the_camera_is_left_out():
    behind = ShadedSurface(SQUARE + np.array([0, 0, 10], np.float32), TWO)
    np.testing.assert_array_equal(
        render([behind], FRONT, (32, 32), ground=None), render([], FRONT, (32, 32), ground=None)
    )


def test_equal_scenes_give_equal_bytes():
    surfaces = [ShadedSurface(*ball()), ShadedSurface(SQUARE, TWO)]
    np.testing.assert_array_equal(render(surfaces, FRONT, (80, 60)), render(surfaces, FRONT, (80, 60)))


def test_normals_are_those_of_the_meshes_room():
    vertices, faces = ball()
    vertices += np.random.default_rng(0).normal(size=vertices.shape).astype(np.float32) * 0.01
    ours = np.empty_like(vertices)
    picture_kernels.accumulate_normals(vertices, faces, ours)
    ours /= np.linalg.norm(ours, axis=1, keepdims=True)
    np.testing.assert_allclose(ours, vertex_normals(vertices, faces), atol=1e-4)


def test_box_blur_is_that_of_scipy():
    image = np.random.default_rng(0).random((30, 40)).astype(np.float32)
    blurred, scratch = np.empty_like(image), np.empty_like(image)
    picture_kernels.box_blur(image, 3, scratch, blurred)
    np.testing.assert_allclose(blurred, uniform_filter(image, 7, mode="constant"), atol=1e-5)


def test_linear_light():
    np.testing.assert_allclose(linear((0.0, 0.5, 1.0)), [0, 0.21404, 1], atol=1e-4)


def test_refusals():
    with pytest.raises(BadInput, match="a face points past the last vertex; got face indices 0 to 4 for 4 vertices"):
        render([ShadedSurface(SQUARE, np.array([[0, 1, 4]], np.int32))], FRONT, (32, 32))
    with pytest.raises(BadInput, match="vertices must be finite"):
        render([ShadedSurface(SQUARE * np.nan, TWO)], FRONT, (32, 32))

"""Kernels against plain NumPy versions, finite differences and other libraries."""

import numpy as np
import pytest
from scipy.linalg import cholesky_banded, solveh_banded
from scipy.sparse.linalg import spsolve

from hemline.sim import BodySurface, MovingSkin, Stepper
from hemline.sim.cloth.air_kernels import TriangleAir, air_at_vertices, air_by_triangle
from hemline.sim.cloth.rows import Rows
from hemline.sim.contact.body.body_contact import SEARCH_AGAIN_DISTANCE, ClosestContact
from hemline.sim.contact.body.load_kernels import contact_terms, slip_terms
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.touch_kernels import BLOCK_STRIDE, SEARCH_BLOCK, mark_turned_inside
from hemline.sim.solver.conjugate_kernels import factorise, solve_band
from hemline.sim.step.newton import newton_step
from hemline.sim.step.state import StepScene
from hemline.sim.step.step import Step
from tests.sim.sim_matrices import assemble_matrix, vectors

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops


def crumple(positions, amount=0.03, seed=1):
    return positions + amount * np.random.default_rng(seed).normal(size=positions.shape)


def reference_energy(sheet, x):
    """St. Venant-Kirchhoff and isometric bending, in plain NumPy."""
    edges = np.stack([x[sheet.faces[:, 1]] - x[sheet.faces[:, 0]], x[sheet.faces[:, 2]] - x[sheet.faces[:, 0]]], 2)
    frame = edges @ sheet.shape[:, 1:]
    strain = 0.5 * (frame.transpose(0, 2, 1) @ frame - np.eye(2))
    density = 0.5 * sheet.lame * np.trace(strain, axis1=1, axis2=2) ** 2 + sheet.shear * (strain**2).sum(axis=(1, 2))
    angle_free = 0.0
    for rows, values in ((sheet.ring, sheet.ring_bending), (sheet.far, sheet.far_bending)):
        i = np.repeat(np.arange(len(x)), np.diff(rows.starts))
        angle_free -= 0.25 * (values * ((x[i] - x[rows.columns]) ** 2).sum(axis=1)).sum()
    return (sheet.area * density).sum() + angle_free


def test_energy_equals_that_of_the_plain_reference(square):
    sheet, positions = square(7, young=40.0, poisson=0.2, bending=1e-3)
    x = crumple(positions)
    assert Stepper(sheet).energy(x) == pytest.approx(reference_energy(sheet, x), rel=1e-12)


@pytest.mark.parametrize("curved", [0.0, 0.2])
def test_forces_are_the_gradient_of_the_energy(square, curved):
    sheet, positions = square(6, curved=curved, young=5.0, bending=0.05)
    stepper, x = Stepper(sheet), crumple(positions)
    gradient = stepper.gradient(x)
    for seed in range(3):
        direction = np.random.default_rng(seed).normal(size=x.shape)
        change = (stepper.energy(x + 1e-6 * direction) - stepper.energy(x - 1e-6 * direction)) / 2e-6
        # central differences of a smooth function: relative error about 1e-16 / 1e-6 and 1e-12
        assert (gradient * direction).sum() == pytest.approx(change, rel=1e-6)


@pytest.mark.parametrize("curved", [0.0, 0.2])
def test_elastic_forces_have_no_resultant_and_no_moment(square, curved):
    sheet, positions = square(6, curved=curved, young=5.0, bending=0.05)
    x = crumple(positions)
    gradient = Stepper(sheet).gradient(x)
    assert np.abs(gradient.sum(axis=0)).max() < 1e-11
    assert np.abs(np.cross(x, gradient).sum(axis=0)).max() < 1e-11


def make_stretched_step(square, **material):
    """A step from a sheet under tension, where no part of the Hessian has to be left out."""
    sheet, positions = square(9, young=20.0, bending=1e-3, **material)
    stepper = Stepper(sheet)
    state = stepper.start(crumple(positions * [1.3, 1, 1.3], 0.002))
    nowhere = StepScene(np.zeros((0, 3)))
    return stepper, Step(stepper.model, stepper.workspace, state, 0.01, nowhere, nowhere)


def test_hessian_is_the_gradient_of_the_forces(square):
    stepper, step = make_stretched_step(square)
    x, direction = step.state.positions, np.random.default_rng(0).normal(size=step.state.positions.shape)

    def gradient_at(positions):
        step.potential.evaluate(positions)
        return stepper.workspace.evaluation.gradient.copy()

    change = (gradient_at(x + 1e-6 * direction) - gradient_at(x - 1e-6 * direction)) / 2e-6
    assert np.isfinite(gradient_at(x)).all()
    step.potential.assemble()
    product = (assemble_matrix(stepper.model, stepper.workspace) @ direction.ravel()).reshape(-1, 3)
    # blocks are stored in float32: 6e-8 of the largest entries
    assert np.abs(product - change).max() < 2e-6 * np.abs(change).max()


def test_conjugate_gradients_solve_the_system(square):
    sheet, positions = square(20, young=200.0, bending=1e-3)
    pinned = np.arange(5)
    stepper, scene = Stepper(sheet, pinned=pinned), StepScene(positions[pinned])
    state = stepper.start(positions * [1.2, 1, 1.2])
    step = Step(stepper.model, stepper.workspace, state, 0.01, scene, scene)
    newton_step(step.potential, fresh=True, solver_share=1e-5, solver_steps=150)
    system, free = stepper.workspace.system, np.repeat(~stepper.model.fixed, 3)
    matrix = assemble_matrix(stepper.model, stepper.workspace)[free][:, free]
    wanted = spsolve(matrix.tocsc(), vectors(stepper.model, system.vectors.right)[free].astype(float))
    found = vectors(stepper.model, system.vectors.solution)[free]
    assert np.linalg.norm(found - wanted) < 1e-3 * np.linalg.norm(wanted)
    assert not vectors(stepper.model, system.vectors.solution).reshape(-1, 3)[pinned].any()


def test_banded_factor_and_solution_are_scipys():
    rng = np.random.default_rng(3)
    count, width = 42, 9  # whole blocks of three
    band = np.zeros((count, width))
    band[:, :-1] = rng.normal(size=(count, width - 1))
    band[:, -1] = 30
    for row in range(count):
        band[row, : 2 - row % 3] = 0
        band[row, : max(0, width - 1 - row)] = 0
    lower = np.zeros((width, count))
    for row in range(count):
        for column in range(max(0, row - width + 1), row + 1):
            lower[row - column, column] = band[row, column - row + width - 1]
    right = rng.normal(size=count)
    factor, solution = band.copy(), right.copy()
    assert factorise(factor)
    assert np.allclose(factor[:, -1], cholesky_banded(lower, lower=True)[0])
    solve_band(factor, solution)
    assert np.allclose(solution, solveh_banded(lower, right, lower=True))
    band[20, -1] = -1
    assert not factorise(band)


@pytest.mark.parametrize("gap", [0.001, -0.002, -0.01, -0.03])
def test_contact_load_is_the_derivative_of_its_energy(gap):
    value, load, _ = contact_terms(gap, 50.0, 0.01)
    step = 1e-8
    change = (contact_terms(gap + step, 50.0, 0.01)[0] - contact_terms(gap - step, 50.0, 0.01)[0]) / (2 * step)
    assert -load == pytest.approx(change, abs=1e-6)
    assert value >= 0


@pytest.mark.parametrize("slip", [1e-6, 3e-5, 1e-3])
def test_friction_is_the_derivative_of_its_potential_and_at_most_one(slip):
    creep = 5e-5
    _, over = slip_terms(slip, creep)
    change = (slip_terms(slip + 1e-10, creep)[0] - slip_terms(slip - 1e-10, creep)[0]) / 2e-10
    assert over * slip == pytest.approx(change, rel=1e-4)
    assert over * slip <= 1 + 1e-12


def sphere(radius=0.3, detail=4):
    import trimesh

    ball = trimesh.creation.icosphere(detail, radius)
    vertices = np.asarray(ball.vertices, np.float32)
    return ball, MovingSkin(vertices, vertices / np.float32(radius)), BodySurface(np.asarray(ball.faces), reach=0.06)


@pytest.mark.parametrize("count", [400, SEARCH_BLOCK * BLOCK_STRIDE, SEARCH_BLOCK * BLOCK_STRIDE + 1])
def test_closest_points_are_libigls(count):
    import igl

    _, skin, surface = sphere()
    rng = np.random.default_rng(5)
    direction = rng.normal(size=(count, 3))
    points = direction / np.linalg.norm(direction, axis=1, keepdims=True) * rng.uniform(0.26, 0.34, (count, 1))
    closest = surface.closest(points, skin, np.zeros(count, bool))
    weights = np.column_stack([1 - closest.weights.sum(axis=1), closest.weights])
    corners = skin.vertices[surface.faces[closest.face]].astype(float)
    found = np.einsum("pc,pcx->px", weights, corners)
    squared = igl.point_mesh_squared_distance(points, skin.vertices.astype(float), surface.faces.astype(np.int64))[0]
    assert (closest.face >= 0).all()
    assert np.linalg.norm(found - points, axis=1) == pytest.approx(np.sqrt(squared), abs=1e-9)


def test_points_out_of_reach_have_no_anchor_and_earlier_ones_change_nothing():
    _, skin, surface = sphere()
    points = np.array([[0.0, 0.31, 0], [0, 0.5, 0], [0, 0, 0], [0.29, 0, 0.01], [5, 5, 5]])
    fixed = np.array([False, False, False, True, False])
    first = surface.closest(points, skin, fixed)
    assert (first.face >= 0).tolist() == [True, False, False, False, False]
    moved = points + 0.01
    known = surface.closest(moved, skin, fixed, first)
    afresh = surface.closest(moved, skin, fixed)
    assert np.array_equal(known.face, afresh.face)
    assert np.array_equal(known.weights, afresh.weights)


def test_the_surface_is_sought_again_only_under_points_that_moved():
    _, skin, surface = sphere()
    direction = np.random.default_rng(7).normal(size=(200, 3))
    points = 0.31 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    fixed, stiffness = np.arange(200) < 20, np.full(200, 7.0)
    contact = ClosestContact(surface, skin, skin, points, points, fixed, stiffness)
    before = contact.planes
    assert not contact.move(points + 0.5 * SEARCH_AGAIN_DISTANCE), "nobody moved far enough"
    moved = np.arange(200) >= 150
    later = (
        points
        + np.where(moved, 40 * SEARCH_AGAIN_DISTANCE, 0.5 * SEARCH_AGAIN_DISTANCE)[:, None] * direction[:, [1, 2, 0]]
    )
    farther = np.linalg.norm(later - points, axis=1) > SEARCH_AGAIN_DISTANCE
    assert contact.move(later)
    for name in ("normal", "point"):
        assert np.array_equal(getattr(contact.planes, name)[~farther], getattr(before, name)[~farther])
    afresh = surface.planes(surface.closest(later, skin, fixed), points, skin, skin, stiffness)
    assert np.array_equal(contact.planes.point[farther & ~fixed], afresh.point[farther & ~fixed])
    assert not contact.move(later), "they have been sought where they are"
    assert (contact.planes.stiffness[fixed] == 0).all()


def test_turned_sides_equal_those_of_the_plain_reference():
    rng = np.random.default_rng(2)
    x, before, normal, point = (rng.normal(size=(300, 3)) for _ in range(4))
    old, new = (rng.choice([0.0, 3.0], 300) for _ in range(2))
    turned = np.empty(300, bool)
    mark_turned_inside(x, before, old, normal, point, new, turned)
    gap = np.where(new > 0, np.einsum("vi,vi->v", normal, x - point), np.inf)
    wanted = (old > 0) & (gap < 0) & (np.einsum("vi,vi->v", before, normal) < 0)
    assert 20 < wanted.sum() < 60 and np.array_equal(turned, wanted)


def test_planes_are_carried_by_the_surface():
    _, skin, surface = sphere()
    points = np.array([[0.0, 0.31, 0.0]])
    later = MovingSkin(skin.vertices + np.float32([0.1, 0.2, 0.3]), skin.normals)
    closest = surface.closest(points, skin, np.zeros(1, bool))
    planes = surface.planes(closest, points, skin, later, np.array([7.0]))
    assert planes.carried[0] == pytest.approx(points[0] + [0.1, 0.2, 0.3], abs=1e-6)
    assert planes.normal[0] == pytest.approx([0, 1, 0], abs=1e-2)
    assert planes.gap(planes.carried)[0] == pytest.approx(0.01, abs=5e-4)
    assert planes.stiffness[0] == 7.0


def test_air_on_one_triangle_is_the_textbooks():
    # area 1/2, wind at 60 degrees to the normal: drag = rho/2 A |u|^2 cd cos along u,
    # lift = rho/2 A |u|^2 cl cos sin across u
    x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    speed, angle, drag, lift = 3.0, np.pi / 3, 1.1, 0.4
    wind = np.tile(speed * np.array([np.sin(angle), 0, np.cos(angle)]), (3, 1))
    velocity = np.zeros((3, 3))
    air, faces = TriangleAir(np.empty((1, 3)), np.empty((1, 6))), np.array([[0, 1, 2]], np.int32)
    air_by_triangle(x, velocity, wind, faces, np.array([drag]), np.array([lift]), 0.6, air)
    size = 0.6 * 0.5 * speed**2 * np.cos(angle)
    along, across = np.array([np.sin(angle), 0, np.cos(angle)]), np.array([-np.cos(angle), 0, np.sin(angle)])
    assert 3 * air.force[0] == pytest.approx(size * (drag * along + lift * np.sin(angle) * across), abs=1e-12)
    corners = Rows(np.arange(4, dtype=np.int32), np.arange(3, dtype=np.int32))
    at, diagonal = np.empty((3, 3)), np.empty((3, 6))
    air_at_vertices(corners, air, velocity, 100.0, at, diagonal)
    assert at.sum(axis=0) == pytest.approx(3 * air.force[0], abs=1e-12)
    assert diagonal[0] == pytest.approx(100 * air.matrix[0])


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_the_search_for_the_body_stays_within_its_grid(axis, side):
    # interpreted, as compiled code reads beyond an array without a word: cloth far off each side of a ball
    import trimesh

    from hemline.sim.contact.body.touch_kernels import closest_faces

    ball = trimesh.creation.icosphere(2, 0.2)
    vertices = np.asarray(ball.vertices, np.float32)
    surface = BodySurface(np.asarray(ball.faces), reach=0.04)
    grid = MovingSkin(vertices, vertices).grid(0.04)
    # near the last rows of the grid in the other two axes, which lie at the end of its array
    x = np.full((1, 3), 0.2)
    x[0, axis] = side * 0.9
    found = SkinPoints(np.full(1, -1, np.int32), np.empty(1, np.int32), np.zeros((1, 2)))
    mesh = surface.mesh(MovingSkin(vertices, vertices))
    closest_faces.py_func(x, mesh, grid, 0.04, np.zeros(1, bool), found)
    assert found.face[0] == -1

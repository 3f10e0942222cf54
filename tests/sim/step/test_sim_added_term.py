"""An additional energy term, added as the README of `sim/step` says: one file with a term, one line in the list."""

from dataclasses import dataclass

import numpy as np
import pytest

from hemline.sim import SimSettings, Stepper, StepScene
from hemline.sim.rest.static_hessian import sheet_hessian
from hemline.sim.rest.static_step import StaticStep
from hemline.sim.rest.statics import EquilibriumSearch
from hemline.sim.step.state import ClothState
from hemline.sim.step.step import Step
from hemline.sim.step.terms import registry
from tests.sim.sim_matrices import assemble_matrix

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops

STIFFNESS, POINT, CORNER = 40.0, np.array([0.0, 0.02, 0.0]), 0
SETTINGS = SimSettings(self_contact=False)
SCENE = StepScene(np.zeros((0, 3)))


@dataclass
class Spring:
    """The file of the recipe: a spring between one vertex and a fixed point, E = k / 2 |x - p|^2."""

    def evaluate(self, x, gradient):
        offset = x[CORNER] - POINT
        gradient[CORNER] += STIFFNESS * offset
        return 0.5 * STIFFNESS * float(offset @ offset)

    def add_blocks(self, x, diagonal):
        diagonal[CORNER, [0, 3, 5]] += STIFFNESS


@pytest.fixture
def listed(monkeypatch):
    """The line of the recipe."""
    monkeypatch.setattr(registry, "TERMS", (*registry.TERMS, lambda inputs: Spring()))


def step_of(stepper, x):
    state = stepper.start(x)
    return Step(stepper.model, stepper.workspace, state, 1 / 120, SCENE, SCENE)


def test_the_list_is_empty_so_that_takes_keep_their_bits():
    assert registry.TERMS == ()


def test_gradient_and_blocks_are_differences_of_the_energy(square, listed):
    sheet, x = square(5, 0.1, young=0.0, bending=0.0)
    potential = step_of(Stepper(sheet, settings=SETTINGS), x).potential
    assert len(potential.terms) == 1

    def at(positions):
        potential.evaluate(positions)
        return potential.energy, potential.workspace.evaluation.gradient.copy()

    x = x + 0.002 * np.random.default_rng(1).normal(size=x.shape)
    _, gradient = at(x)
    potential.assemble()
    matrix = assemble_matrix(potential.model, potential.workspace)
    for direction in np.random.default_rng(2).normal(size=(3, *x.shape)):
        ends = [at(x + sign * 1e-6 * direction) for sign in (1, -1)]
        slope, change = ((ends[0][part] - ends[1][part]) / 2e-6 for part in (0, 1))
        assert slope == pytest.approx((gradient * direction).sum(), rel=1e-5)
        product = (matrix @ direction.ravel()).reshape(-1, 3)
        assert np.abs(product - change).max() < 2e-4 * np.abs(change).max()
        # the spring is most of what acts on its vertex, so that a missing block would show
        without = product - np.where(np.arange(len(x)) == CORNER, 1.0, 0.0)[:, None] * STIFFNESS * direction
        assert np.abs(without - change).max() > 0.01 * np.abs(change).max()


def test_a_step_feels_the_term(square, listed):
    sheet, x = square(5, 0.1)
    stepper = Stepper(sheet, settings=SETTINGS)
    state = stepper.start(x)
    for _ in range(600):
        state, _ = stepper.advance(state, 1 / 120, lambda fraction: SCENE)
        state = ClothState(**{**vars(state), "velocities": 0.95 * state.velocities, "change": 0.0 * state.change})
    hang = POINT[1] - 9.81 * sheet.mass.sum() / STIFFNESS
    assert state.positions[CORNER] == pytest.approx([0, hang, 0], abs=2e-4), "the cloth hangs on its spring"


def test_the_static_solve_and_its_hessian_know_the_term(square, listed):
    sheet, x = square(3, 0.02)
    stepper = Stepper(sheet, settings=SETTINGS)
    pinched = np.zeros(len(x), bool)
    step = StaticStep(stepper.model, stepper.workspace, x, pinched, SCENE, None, whole=True)
    block = sheet_hessian(step).toarray()[3 * CORNER : 3 * CORNER + 3, 3 * CORNER : 3 * CORNER + 3]
    registry.TERMS = ()
    step = StaticStep(stepper.model, stepper.workspace, x, pinched, SCENE, None, whole=True)
    alone = sheet_hessian(step).toarray()[3 * CORNER : 3 * CORNER + 3, 3 * CORNER : 3 * CORNER + 3]
    assert block - alone == pytest.approx(STIFFNESS * np.eye(3))


def test_the_search_for_equilibrium_ends_on_the_spring(square, listed):
    sheet, x = square(3, 0.02)
    stepper = Stepper(sheet, settings=SETTINGS)
    search = EquilibriumSearch(stepper.model, stepper.workspace, np.zeros(len(x), bool), SCENE)
    below = np.stack([x[:, 0], -x[:, 2] - x[:, 0], np.zeros(len(x))], axis=1)
    result = search.run(below, None, tolerance=0.01, newton_steps=400)
    assert result.residual_share <= 0.01
    hang = POINT[1] - 9.81 * sheet.mass.sum() / STIFFNESS
    assert result.positions[CORNER, 1] == pytest.approx(hang, abs=1e-4)

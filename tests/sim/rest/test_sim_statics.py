"""The search for equilibria on bare sheets."""

import numpy as np
import pytest

from hemline.sim import Elastic, SimSettings, StepScene, make_sheet
from hemline.sim.rest.statics import EquilibriumSearch
from hemline.sim.step.model import make_model
from hemline.sim.step.workspace import Workspace
from tests.sim.sim_sheets import grid

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops


@pytest.mark.parametrize("lean", [1e-5, 1e-3])
def test_a_strip_that_stands_on_its_edge_falls_and_hangs(lean):
    # far higher than what its bending could hold upright, 7.84 B = w L^3: it stands on a saddle of its energy, where
    # the forces nearly vanish and grow with every step that leads away from it
    flat, faces, rest = grid(4, 13, 0.03, 0.12)
    weight, length = 9.81 * 0.15, 0.11
    assert weight * length**3 > 10 * 7.84 * 2e-5
    sheet = make_sheet(faces, rest, Elastic(density=0.15, young=100.0, bending=2e-5))
    x = np.stack([flat[:, 0], flat[:, 1], lean * flat[:, 1]], axis=1)
    pins = np.flatnonzero(flat[:, 1] < 0.011)
    model = make_model(sheet, pinned=pins, settings=SimSettings(self_contact=False))
    search = EquilibriumSearch(model, Workspace(model), np.zeros(len(x), bool), StepScene(x[pins]))
    found = search.run(x, None, tolerance=1e-6, newton_steps=400)
    assert found.residual_share <= 1e-6
    # two rows of pins hold it upright at its foot; from there it bends over and hangs
    assert found.positions[:, 1].min() < -0.08
    assert np.ptp(found.positions[:, 2]) < 0.04

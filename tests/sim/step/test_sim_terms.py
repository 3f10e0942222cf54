"""Each term of the potential alone: forces are the slope of its energy, blocks the slope of its forces."""

from dataclasses import dataclass

import numpy as np
import pytest

from hemline.sim import SimSettings
from hemline.sim.cloth.air_kernels import Air
from hemline.sim.cloth.inertia_kernels import Inertia
from hemline.sim.contact.body.planes import Planes
from hemline.sim.contact.pairs.pair_kernels import PairRows
from hemline.sim.contact.pairs.pairs import Pairs
from hemline.sim.solver.conjugate_kernels import FEW_PAIRS
from hemline.sim.step.model import make_model
from hemline.sim.step.potential import Potential
from hemline.sim.step.terms.air import constant_force
from hemline.sim.step.terms.inertia import no_inertia
from hemline.sim.step.terms.skin_contact import no_contact, skin_contact
from hemline.sim.step.workspace import Workspace
from tests.sim.sim_matrices import assemble_matrix, assemble_pair_matrix

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops

DEPTH = 0.01
SETTINGS = SimSettings(thickness=0.003, contact_depth=DEPTH, self_contact=False)
LIMP = {"young": 0.0, "bending": 0.0}
"""Cloth whose own terms are 0."""


@dataclass
class OneTerm:
    """A potential of one term, and places where it is smooth."""

    potential: Potential
    x: np.ndarray
    way: float = 1e-6

    def at(self, x):
        self.potential.evaluate(x)
        return self.potential.energy, self.potential.workspace.evaluation.gradient.copy()

    def directions(self, count=3):
        return np.random.default_rng(8).normal(size=(count, *self.x.shape))


def make_one_term(square, *, curved=0.0, over_h=0.0, whole=True, **material):
    """A potential whose terms are those of the cloth alone, and the generator that makes more of it."""
    sheet, x = square(6, 0.2, curved=curved, **material)
    model, rng = make_model(sheet, settings=SETTINGS), np.random.default_rng(5)
    cap = np.full(len(sheet.faces), np.inf) if whole else model.cap
    potential = Potential(
        model,
        Workspace(model),
        start=x,
        over_h=over_h,
        cap=cap,
        inertia=no_inertia(x),
        air=constant_force(x, np.zeros_like(x)),
        contact=no_contact(len(x), SETTINGS),
    )
    return OneTerm(potential, x + 0.002 * rng.normal(size=x.shape)), rng


def inertia(square):
    made, rng = make_one_term(square, **LIMP)
    made.potential.inertia = Inertia(made.x + 0.01 * rng.normal(size=made.x.shape), rng.uniform(1, 9, len(made.x)))
    return made


def air(square):
    made, rng = make_one_term(square, **LIMP)
    root = rng.normal(size=(len(made.x), 3, 3))
    matrix = np.einsum("vij,vkj->vik", root, root)[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    start = made.x + 0.1 * rng.normal(size=made.x.shape)
    made.potential.air = Air(start, rng.normal(size=made.x.shape), np.ascontiguousarray(matrix))
    return made


def touching(square, gaps, limit):
    """Each vertex over a plane of its own, at that height over where contact begins."""
    made, rng = make_one_term(square, **LIMP)
    count = len(made.x)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    gap = rng.uniform(*gaps, count)
    point = made.x - (gap + SETTINGS.thickness)[:, None] * normal
    carried = made.x + 0.004 * rng.normal(size=made.x.shape)
    planes = Planes(normal, point, carried, rng.uniform(40, 60, count))
    made.potential.contact = skin_contact(planes, np.full(count, limit), SETTINGS, 0.003)
    return made


def membrane(square):
    # under tension no part of the Hessian is left out
    made, _ = make_one_term(square, over_h=100.0, young=30.0, poisson=0.2, bending=0.0, damping=0.004)
    made.x = made.x * [1.4, 1.0, 1.3]
    return made


def bending(square):
    return make_one_term(square, young=0.0, bending=1e-3)[0]


def hinges(square):
    return make_one_term(square, curved=0.05, young=0.0, bending=1e-3)[0]


def pairs(square, depths, limit, count=3 * FEW_PAIRS):
    """Pairs of any four vertices, so deep in each other."""
    made, rng = make_one_term(square, **LIMP)
    corners = np.array([rng.choice(len(made.x), 4, replace=False) for _ in range(count)]).astype(np.uint32)
    weights = rng.uniform(0.1, 0.9, (count, 4)) * [1, -1, 1, -1]
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    between = np.einsum("pc,pcx->px", weights, made.x[corners])
    reach = np.einsum("px,px->p", normal, between) + rng.uniform(*depths, count)
    thickness, stiffness = np.full(count, 0.004), rng.uniform(40, 60, count)
    carried = between + 0.004 * rng.normal(size=between.shape)
    rows = PairRows(corners, weights, normal, reach, carried, thickness, stiffness, np.full(count, limit))
    made.potential.contact = made.potential.contact._replace(creep=0.003)
    made.potential.replace_pairs(Pairs.of([rows], len(made.x)))
    return made


TERMS = {
    "inertia": inertia,
    "air": air,
    "contact": lambda square: touching(square, (-0.8 * DEPTH, 0.8 * DEPTH), 0.0),
    "contact beyond its depth": lambda square: touching(square, (-3 * DEPTH, -1.1 * DEPTH), 0.0),
    "friction": lambda square: touching(square, (0.1 * DEPTH, DEPTH), 0.4),
    "membrane": membrane,
    "bending": bending,
    "hinges": hinges,
    "pairs": lambda square: pairs(square, (-0.002, 0.0035), 0.0),
    "few pairs": lambda square: pairs(square, (-0.002, 0.0035), 0.0, count=20),
    "pairs beyond their thickness": lambda square: pairs(square, (0.005, 0.008), 0.0),
    "friction of pairs": lambda square: pairs(square, (-0.008, -0.005), 0.4),
}
EXACT = ("inertia", "air", "contact", "membrane", "bending", "pairs", "few pairs")
"""Terms whose blocks are the derivatives of their forces; those of the others are made positive."""


@pytest.mark.parametrize("name", TERMS)
def test_forces_are_the_slope_of_the_energy(square, name):
    made = TERMS[name](square)
    _, gradient = made.at(made.x)
    assert np.abs(gradient).max() > 0
    for direction in made.directions():
        ends = [made.at(made.x + sign * made.way * direction)[0] for sign in (1, -1)]
        slope = (ends[0] - ends[1]) / (2 * made.way)
        # central differences over 1e-6 m, where lengths are some millimetres: 1e-6 of it, and where contact begins more
        assert slope == pytest.approx((gradient * direction).sum(), rel=1e-4)


def hessian(made):
    """The whole Hessian where the term is, pairs included."""
    made.at(made.x)
    blocks = made.potential.assemble()
    model, workspace = made.potential.model, made.potential.workspace
    return assemble_matrix(model, workspace) + assemble_pair_matrix(model, blocks)


@pytest.mark.parametrize("name", EXACT)
def test_blocks_are_the_slope_of_the_forces(square, name):
    made = TERMS[name](square)
    matrix = hessian(made)
    for direction in made.directions():
        ends = [made.at(made.x + sign * made.way * direction)[1] for sign in (1, -1)]
        change = (ends[0] - ends[1]) / (2 * made.way)
        product = (matrix @ direction.ravel()).reshape(-1, 3)
        # blocks are stored in float32, differences as above
        assert np.abs(product - change).max() < 2e-4 * np.abs(change).max()


@pytest.mark.parametrize("name", TERMS)
def test_the_hessian_is_symmetric_and_not_negative(square, name):
    matrix = hessian(TERMS[name](square)).toarray()
    assert np.abs(matrix - matrix.T).max() <= 1e-6 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix).min() > -1e-5 * np.abs(matrix).max()


@pytest.mark.parametrize("name", ["friction", "friction of pairs"])
def test_friction_pulls_back_as_a_spring_of_its_block_would(square, name):
    """Lagged: the block is the force over the slip, positive wherever the smoothed cone bends down."""
    made = TERMS[name](square)
    _, gradient = made.at(made.x)
    contact, blocks = made.potential.contact, made.potential.assemble()
    if name == "friction":
        normal, slip = contact.planes.normal, made.x - contact.planes.carried
        slip = slip - np.einsum("vi,vi->v", slip, normal)[:, None] * normal
        matrix = assemble_matrix(made.potential.model, made.potential.workspace)
        found = (matrix @ slip.ravel()).reshape(-1, 3)
    else:
        rows = made.potential.pairs.pairs.rows
        slip = np.einsum("pc,pcx->px", rows.weights, made.x[rows.corners]) - rows.carried
        force = np.einsum("pij,pj->pi", blocks.block[:-7].reshape(-1, 3, 3), slip)
        found = np.zeros_like(made.x)
        np.add.at(found, rows.corners.astype(int), rows.weights[:, :, None] * force[:, None])
    assert np.abs(found - gradient).max() < 1e-5 * np.abs(gradient).max()


def test_the_whole_is_the_sum_of_its_terms(square):
    """The pass over the vertices adds up inertia, air, contact: none of them knows another."""
    together, total, gradient = inertia(square), 0.0, 0.0
    others = [air(square), TERMS["contact"](square), TERMS["pairs"](square)]
    x = together.x
    for made in (together, *others):
        energy, slope = made.at(x)
        total, gradient = total + energy, gradient + slope
    potential = together.potential
    potential.air, potential.contact, potential.pairs = (
        others[0].potential.air,
        others[1].potential.contact,
        others[2].potential.pairs,
    )
    energy, found = together.at(x)
    assert energy == pytest.approx(total, rel=1e-12)
    assert found == pytest.approx(gradient, rel=1e-12, abs=1e-12)

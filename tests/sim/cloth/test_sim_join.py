"""Several pieces of cloth in one sheet: each moves as if it were alone, with its own material."""

from dataclasses import fields

import numpy as np
import pytest

from hemline.errors import BadMesh
from hemline.sim import SimSettings, Stepper, StepScene, join_sheets
from hemline.sim.cloth.rows import Rows

TIGHT = SimSettings(residual_share=1e-4, solver_share=1e-3, newton_steps=30, wind=(1.0, 0.0, 2.0))
SOFT = {"density": 0.1, "young": 40.0, "poisson": 0.2, "bending": 1e-4, "damping": 0.002, "drag": 1.2, "lift": 0.4}
STIFF = {"density": 0.3, "young": 300.0, "poisson": 0.4, "bending": 2e-3, "damping": 0.01, "drag": 0.6, "lift": 0.0}


def two(square, **curved):
    first, x = square(8, 0.4, **SOFT)
    second, y = square(11, 0.5, **STIFF, **curved)
    return (first, x), (second, y + [0.0, 0.3, 0.0])


def swing(sheet, x, pins, steps=12):
    stepper = Stepper(sheet, pinned=pins, settings=TIGHT)
    state, scene = stepper.start(x), StepScene(x[pins])
    for _ in range(steps):
        state, _ = stepper.advance(state, 1 / 120, lambda share: scene)
    return state


# hinges bend as the matrix of a flat sheet does only where the sheet does not stretch: beside a curved piece the flat
# one moves a little differently
@pytest.mark.parametrize(("curved", "bound"), [({}, 1e-5), ({"curved": 0.1}, 1e-4)])
def test_each_piece_moves_as_if_it_were_alone(square, curved, bound):
    (first, x), (second, y) = two(square, **curved)
    sheet = join_sheets([first, second])
    together = swing(sheet, np.concatenate([x, y]), np.array([0, 7, 64, 74]))
    alone = swing(first, x, np.array([0, 7])), swing(second, y, np.array([0, 10]))
    wanted = np.concatenate([each.positions for each in alone])
    assert np.abs(wanted - np.concatenate([x, y])).max() > 0.03
    # the tolerance is on the mean over all vertices, so that both sides stop at other residuals: 1e-4 of the weight
    assert np.abs(together.positions - wanted)[:64].max() < bound
    assert np.abs(together.positions - wanted)[64:].max() < 1e-5


def test_pieces_are_numbered_from_the_skin_outwards(square):
    (first, _), (second, _) = two(square)
    sheet = join_sheets([join_sheets([first, second]), first])
    assert sheet.piece.dtype == np.uint32
    assert np.bincount(sheet.piece).tolist() == [64, 121, 64]


def test_one_piece_joined_is_itself(square):
    (sheet, _), _ = two(square)
    again = join_sheets([sheet])
    for field in fields(sheet):
        before, after = getattr(sheet, field.name), getattr(again, field.name)
        rows = isinstance(before, Rows)
        for name in ("starts", "columns") if rows else ("",):
            one, other = (getattr(each, name) if rows else each for each in (before, after))
            assert one.dtype == other.dtype
            assert np.array_equal(one, other)


def test_energies_add_up(square):
    (first, x), (second, y) = two(square)
    rng = np.random.default_rng(2)
    x, y = (each + 0.02 * rng.normal(size=each.shape) for each in (x, y))
    both = Stepper(join_sheets([first, second])).energy(np.concatenate([x, y]))
    assert both == pytest.approx(Stepper(first).energy(x) + Stepper(second).energy(y), rel=1e-12)


def test_no_piece_is_refused():
    with pytest.raises(BadMesh, match="a sheet must have a piece; got none; give at least one"):
        join_sheets([])

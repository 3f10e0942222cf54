import numpy as np
import pytest

from hemline.errors import BadInput, SimulationFailed
from hemline.sim import BodySurface, MovingSkin, SimSettings, Stepper, StepScene


def test_pins_are_where_they_are_put_and_the_rest_follows(square):
    sheet, x = square(9, 0.4, young=100.0, damping=0.003)
    pins = np.arange(9)
    stepper = Stepper(sheet, pinned=pins)
    state = stepper.start(x)
    for step in range(30):
        begin, end = (x[pins] + [0.5 * (step + more) / 30, 0, 0] for more in (0, 1))
        state, _ = stepper.advance(state, 1 / 120, lambda share, a=begin, b=end: StepScene(a + share * (b - a)))
    assert np.allclose(state.positions[pins], x[pins] + [0.5, 0, 0], atol=1e-12)
    assert state.positions[9:, 0].mean() > x[9:, 0].mean() + 0.15
    assert state.time == pytest.approx(0.25)


def test_a_soft_pin_gives_way_by_weight_over_stiffness(square):
    # a sheet that hangs on two springs: weight / (2 stiffness) below their ends
    sheet, x = square(9, 0.4, density=0.15, young=400.0, bending=1e-3, damping=0.01)
    x = np.stack([x[:, 0], -x[:, 2], 0 * x[:, 1]], axis=1)
    pins, stiffness = np.array([0, 72]), np.array([3.0, 3.0])
    settings = SimSettings(residual_share=1e-4, solver_share=1e-3, newton_steps=30)
    stepper = Stepper(sheet, pinned=pins, pin_stiffness=stiffness, settings=settings)
    state = stepper.start(x)
    for _ in range(120):
        state, _ = stepper.advance(state, 0.1, lambda share: StepScene(x[pins]))
    sag = x[pins, 1] - state.positions[pins, 1]
    assert sag == pytest.approx(9.81 * sheet.mass.sum() / stiffness.sum(), rel=1e-3)
    assert not stepper.model.fixed.any()


def test_soft_and_hard_pins_of_one_sheet(square):
    sheet, x = square(9, 0.4, density=0.15, young=400.0)
    pins, targets = np.array([80, 0]), np.array([[0.4, 0.1, 0.4], [0.0, 0.2, 0.0]])
    settings = SimSettings(gravity=(0.0, 0.0, 0.0))
    stepper = Stepper(sheet, pinned=pins, pin_stiffness=np.array([50.0, np.inf]), settings=settings)
    state = stepper.start(x)
    for _ in range(10):
        state, _ = stepper.advance(state, 0.02, lambda share: StepScene(targets))
    assert np.array_equal(state.positions[0], targets[1])
    assert 0.02 < state.positions[80, 1] < 0.18


def test_a_very_stiff_spring_is_a_hard_pin(square):
    sheet, x = square(9, 0.4, young=100.0)
    pins, found = np.array([0, 8]), []
    for stiffness in (np.full(2, 1e6), None):
        stepper = Stepper(
            sheet, pinned=pins, pin_stiffness=stiffness, settings=SimSettings(residual_share=1e-4, newton_steps=30)
        )
        state = stepper.start(x)
        for step in range(8):
            target = x[pins] + [0.0, 0.01 * step, 0.0]
            state, _ = stepper.advance(state, 1 / 120, lambda share, at=target: StepScene(at))
        found.append(state.positions)
    assert np.abs(found[0] - found[1]).max() < 1e-5


@pytest.mark.parametrize(("stiffness", "got"), [([1.0], r"shape \(1,\)"), ([1.0, 0.0], "0.0"), ([1.0, np.nan], "nan")])
def test_stiffnesses_of_pins_that_make_no_sense_are_refused(square, stiffness, got):
    sheet, _ = square(4)
    with pytest.raises(BadInput, match=f"2 pins must have positive stiffnesses; got {got}; use infinity"):
        Stepper(sheet, pinned=np.array([0, 1]), pin_stiffness=np.array(stiffness))


def test_wind_may_depend_on_time_and_place(square, free):
    sheet, x = square(6, 0.4, drag=1.2)
    settings = SimSettings(gravity=(0.0, 0.0, 0.0))

    def wind(seconds, positions):
        assert positions.shape == x.shape
        return np.where(positions[:, :1] > 0.2, [0.0, 4.0, 0.0], [0.0, 0.0, 0.0]) * (seconds > 0.02)

    stepper = Stepper(sheet, settings=settings, wind=wind)
    state = stepper.start(x)
    state, _ = stepper.advance(state, 0.02, free)
    assert np.abs(state.velocities).max() < 1e-9
    for _ in range(4):
        state, _ = stepper.advance(state, 0.02, free)
    blown = x[:, 0] > 0.3
    assert state.velocities[blown, 1].mean() > 5 * abs(state.velocities[x[:, 0] < 0.1, 1].mean())


def test_a_step_that_is_too_long_is_halved(square, free, monkeypatch):
    sheet, x = square(5)
    stepper = Stepper(sheet, settings=SimSettings(newton_steps=1, residual_share=1e-6))
    fast = stepper.start(x)
    # 0.25 s of free fall from 23 m/s down ends below 60 m/s only in the parts
    lengths = []
    whole = stepper.step

    def watched(state, h, then, now):
        lengths.append(h)
        return whole(state, h, then, now)

    monkeypatch.setattr(stepper, "step", watched)
    state, _ = stepper.advance(fast, 0.25, free)
    assert lengths[0] == 0.25
    assert np.isfinite(state.positions).all()


def test_positions_that_are_not_finite_are_given_up_with_the_reason(square):
    sheet, x = square(5)
    pins = np.array([0])
    stepper = Stepper(sheet, pinned=pins)
    nowhere = lambda share: StepScene(np.full((1, 3), np.nan))  # noqa: E731
    with pytest.raises(SimulationFailed, match="not finite in a step of 0.312 ms|not positive in a step of 0.312 ms"):
        stepper.advance(stepper.start(x), 0.01, nowhere)


def test_a_pin_that_is_torn_away_is_given_up_with_the_speed(square):
    sheet, x = square(5)
    pins = np.array([0])
    stepper = Stepper(sheet, pinned=pins)
    with pytest.raises(SimulationFailed, match="m/s in a step of 0.312 ms|weights in a step of 0.312 ms"):
        stepper.advance(stepper.start(x), 0.01, lambda share: StepScene(x[pins] + [100 * share, 0, 0]))


def test_pins_that_do_not_exist_are_refused(square):
    sheet, _ = square(4)
    with pytest.raises(BadInput, match="pins must be vertices of the sheet; got 3 to 16 for 16 vertices; count from 0"):
        Stepper(sheet, pinned=np.array([3, 16]))


def test_another_number_of_positions_is_refused(square):
    sheet, x = square(4)
    with pytest.raises(BadInput, match="positions must be 16 finite points"):
        Stepper(sheet).start(x[:-1])
    with pytest.raises(BadInput, match="positions must be 16 finite points"):
        Stepper(sheet).start(np.full_like(x, np.inf))


def test_cloth_stays_on_its_side_of_a_thin_plate_that_hits_it_fast(square):
    # a plate 16 mm thick moves 80 mm in each step, five times its thickness, as a kicking foot does
    sheet, x = square(13, 0.3, young=100.0)
    flat = np.stack(np.meshgrid(np.linspace(-0.1, 0.4, 41), np.linspace(-0.1, 0.4, 41), indexing="ij"), -1).reshape(
        -1, 2
    )
    number = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    down = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    faces = np.concatenate([down[:, ::-1], down + len(flat)])
    top = np.stack([flat[:, 0], 0 * flat[:, 0], flat[:, 1]], axis=1)
    plate = np.concatenate([top, top - [0, 0.016, 0]]).astype(np.float32)
    normals = np.repeat(np.float32([[0, 1, 0], [0, -1, 0]]), len(flat), axis=0)
    stepper = Stepper(sheet, surface=BodySurface(faces, reach=0.04), settings=SimSettings(gravity=(0.0, 0.0, 0.0)))
    state = stepper.start(x + [0, 0.06, 0])
    for step in range(5):
        at = np.float32(0.08 * step)
        scenes = {
            share: StepScene(np.zeros((0, 3)), MovingSkin(plate + np.float32([0, at + 0.08 * share, 0]), normals))
            for share in (0.0, 0.5, 1.0)
        }
        state, _ = stepper.advance(state, 1 / 120, lambda share, s=scenes: s[share])
    assert (state.positions[:, 1] > 0.08 * 5).all()

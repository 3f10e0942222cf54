"""Derivatives of settled garments, against central differences of settling and against a closed form."""

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from hemline import bodies, garments
from hemline.bodies.velocities import reshaping_velocity, turning_velocity
from hemline.errors import BadInput, SimulationFailed
from hemline.garments.pins import Pins
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.sim import Sensitivities, SimSettings, settle
from tests.sim.sim_garments import hanging_loop, hanging_strip

DATA = Path(__file__).parents[4] / "shared/data/garments/garmentcode_mit"
TIGHT = 1e-6
APART = SimSettings(self_contact=False)
"""Where cloth presses on itself, pairs come and go and equilibrium is not found to a millionth of a weight."""


def turn_joint(shaped, joint, axis, angle):
    rotations = shaped.rest_pose.rotations.astype(np.float64)
    number = JOINT_NAMES.index(joint)
    rotations[number] = multiply(rotations[number], from_axis_angle(angle * np.array(axis, float)))
    return Pose(rotations, shaped.rest_pose.translation)


def difference(ends, way):
    return (ends[0].positions - ends[1].positions) / (2 * way)


def relative_error(found, wanted):
    """Mean error of the vertices over their mean change."""
    return np.linalg.norm(found - wanted, axis=1).mean() / np.linalg.norm(wanted, axis=1).mean()


def settle_on_body(name, key):
    """A garment of GarmentCode, held by friction and shape alone, settled tightly; the body; its derivatives."""
    shaped = bodies.load("anny24").shaped()
    with TemporaryDirectory() as folder:
        shutil.copy(DATA / f"{name}_mean_all.obj", folder)
        said = f'mesh = "{name}_mean_all.obj"\norigin = "floor"\npins = "none"\nkey_joint = "{key}"\n'
        (Path(folder) / f"{name}.toml").write_text(said)
        garment = garments.read(Path(folder) / f"{name}.toml", shaped)
    rest = settle(garment, shaped, settings=APART, start=settle(garment, shaped, settings=APART), tolerance=TIGHT)
    return garment, shaped, rest, Sensitivities(rest)


@cache
def shirt():
    return settle_on_body("tshirt", "spine3")


@pytest.mark.data
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no garments at {DATA}")
@pytest.mark.parametrize(
    ("joint", "axis"), [("left_shoulder", (0, 0, 1)), ("spine1", (1, 0, 0)), ("pelvis", (0, 0, 1))]
)
def test_a_joint_moves_the_shirt_as_central_differences_say(joint, axis):
    garment, shaped, rest, derivatives = shirt()
    way = 1e-4
    ends = [
        settle(
            garment, shaped, turn_joint(shaped, joint, axis, sign * way), settings=APART, start=rest, tolerance=TIGHT
        )
        for sign in (1, -1)
    ]
    # the skin is float32, 1e-7 m: 0.1 % of what 1e-4 rad moves at 1 m; the rest is contact that comes and goes
    assert relative_error(derivatives.turn(joint, axis), difference(ends, way)) < 0.02


@pytest.mark.data
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no garments at {DATA}")
def test_a_shape_coefficient_moves_the_shirt_as_central_differences_say():
    garment, shaped, rest, derivatives = shirt()
    way = 1e-3
    ends = [
        settle(garment, shaped.body.shaped((0.0, sign * way)), settings=APART, start=rest, tolerance=TIGHT)
        for sign in (1, -1)
    ]
    assert relative_error(derivatives.beta(1), difference(ends, way)) < 0.02


@pytest.mark.data
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no garments at {DATA}")
@pytest.mark.parametrize("name", ["young", "density", "bending", "poisson", "friction", "thickness"])
def test_a_constant_moves_the_shirt_as_central_differences_say(name):
    garment, shaped, rest, derivatives = shirt()
    ends = []
    of_material = name != "thickness"
    value = getattr(garment.material if of_material else rest.settings, name)
    way = 1e-4 * value
    for sign in (1, -1):
        changed, settings = garment, rest.settings
        if of_material:
            changed = replace(garment, material=replace(garment.material, **{name: value + sign * way}))
        else:
            settings = replace(settings, **{name: value + sign * way})
        ends.append(settle(changed, shaped, settings=settings, start=rest, tolerance=1e-7))
    assert relative_error(derivatives.constant(name), difference(ends, way)) < 0.02


def test_the_stretch_of_a_hanging_strip_changes_with_young_as_the_closed_form_says():
    garment, shaped, length = hanging_strip()
    material = garment.material

    def stretch(young):
        def strain(s):
            stress = material.density * 9.81 * (length - s)
            return brentq(lambda f: f * young * (f**2 - 1) / 2 - stress, 1, 3) - 1

        return quad(strain, 0, length)[0]

    rest = settle(garment, shaped, tolerance=TIGHT)
    rows, changes = (each.reshape(4, 31, 3) for each in (rest.positions, Sensitivities(rest).constant("young")))
    along = (rows[:, -1] - rows[:, 0]) / np.linalg.norm(rows[:, -1] - rows[:, 0], axis=1, keepdims=True)
    found = float(((changes[:, -1] - changes[:, 0]) * along).sum(axis=1).mean())
    way = 1e-3 * material.young
    wanted = (stretch(material.young + way) - stretch(material.young - way)) / (2 * way)
    assert found == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("name", ["density", "bending", "young"])
def test_a_constant_moves_cloth_that_presses_on_itself_as_central_differences_say(name):
    garment, shaped = hanging_loop()
    rest = settle(garment, shaped, tolerance=TIGHT)
    derivatives = Sensitivities(rest)
    rows = derivatives._step.potential.pairs.pairs.rows
    between = np.einsum("pc,pcx->px", rows.weights, rest.positions[rows.corners])
    assert (np.einsum("px,px->p", between, rows.normal) < rows.reach).sum() > 30
    way, ends = 0.01 * getattr(garment.material, name), []
    for sign in (1, -1):
        changed = replace(garment.material, **{name: getattr(garment.material, name) + sign * way})
        ends.append(settle(replace(garment, material=changed), shaped, tolerance=TIGHT))
    # of second order in a change of 1 %; measured 0.0002 to 0.0008
    assert relative_error(derivatives.constant(name), difference(ends, way)) < 0.003


def test_the_side_of_a_pressed_loop_follows_its_ends():
    garment, shaped = hanging_loop()
    rest = settle(garment, shaped, tolerance=TIGHT)
    change = Sensitivities(rest).turn("pelvis", (0, 1, 0))
    # pairs turn with the cloth: a rigid motion about the axis of gravity presses no pair
    wanted = np.cross([0.0, 1.0, 0.0], rest.positions - rest.pose.translation)
    assert relative_error(change, wanted) < 0.01


def hang(kind):
    """The strip on the skin or on a joint, put there or on springs of 20 N/m a vertex."""
    garment, shaped, _ = hanging_strip()
    pins = garment.pins
    if "joint" in kind:
        top = garment.vertices[pins.vertices].astype(float)
        pins = Pins.on_joint(pins.vertices, top, JOINT_NAMES.index("spine3"), shaped.joints)
    return replace(garment, pins=pins.with_stiffness(20.0) if "springs" in kind else pins), shaped


@pytest.mark.parametrize("kind", ["skin", "joint", "springs on skin", "springs on joint"])
def test_pins_move_with_the_body(kind):
    garment, shaped = hang(kind)
    rest = settle(garment, shaped, tolerance=TIGHT)
    change, pins = Sensitivities(rest).turn("pelvis", (0, 1, 0)), garment.pins.vertices
    # the strip turns with the body as a rigid whole: gravity is along the axis
    arm = rest.positions - rest.pose.translation
    wanted = np.cross([0.0, 1.0, 0.0], arm)
    assert np.abs(change[pins] - wanted[pins]).max() < (1e-3 if "springs" in kind else 1e-5)
    assert np.abs(change - wanted).max() < 1e-3


def test_the_skin_moves_as_differences_of_skinning_say():
    shaped = bodies.load("anny24").shaped((0.3, -0.2))
    posed, way = shaped.posed(shaped.rest_pose), 1e-3
    axis = np.array([0.3, -0.5, 0.8])
    for joint in ("pelvis", "left_knee", "right_collar"):
        ends = [shaped.posed(turn_joint(shaped, joint, axis, sign * way)).vertices.astype(float) for sign in (1, -1)]
        velocity = turning_velocity(posed, JOINT_NAMES.index(joint), axis)
        assert np.abs(velocity - (ends[0] - ends[1]) / (2 * way)).max() < 3e-4
    pose = posed.pose
    ends = [shaped.body.shaped((0.3, -0.2 + sign)).posed(pose).vertices.astype(float) for sign in (1, -1)]
    assert np.abs(reshaping_velocity(posed, 1) - (ends[0] - ends[1]) / 2).max() < 1e-6


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no garments at {DATA}")
def test_a_hip_moves_trousers_as_central_differences_say():
    garment, shaped, rest, derivatives = settle_on_body("pants", "pelvis")
    way, axis = 1e-4, (0, 0, 1)
    poses = [turn_joint(shaped, "left_hip", axis, sign * way) for sign in (1, -1)]
    ends = [settle(garment, shaped, pose, settings=APART, start=rest, tolerance=TIGHT) for pose in poses]
    assert relative_error(derivatives.turn("left_hip", axis), difference(ends, way)) < 0.02


def test_directions_that_do_not_exist_are_refused():
    garment, shaped, _ = hanging_strip()
    derivatives = Sensitivities(settle(garment, shaped))
    with pytest.raises(BadInput, match="no such joint; got 'tail'"):
        derivatives.turn("tail", (0, 0, 1))
    with pytest.raises(BadInput, match="no such joint; got 24"):
        derivatives.turn(24, (0, 0, 1))
    with pytest.raises(BadInput, match="'axis' must be three finite numbers"):
        derivatives.turn(0, (0, np.nan, 1))
    with pytest.raises(BadInput, match="no such shape coefficient; got 99"):
        derivatives.beta(99)
    with pytest.raises(BadInput, match="no such constant; got 'colour'; use one of density"):
        derivatives.constant("colour")


def test_cloth_that_nothing_holds_has_no_derivatives():
    garment, shaped, _ = hanging_strip(pinned=False)
    loose = settle(garment, shaped, settings=SimSettings(gravity=(0.0, 0.0, 0.0)))
    with pytest.raises(SimulationFailed, match="the equilibrium is not isolated"):
        Sensitivities(loose).turn("pelvis", (0, 1, 0))

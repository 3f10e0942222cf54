"""Hanging arms are lifted in the poses of the fit, by an angle that the drapes and the model name."""

from dataclasses import replace

import numpy as np
import pytest

import hemline
from hemline.animators.agentdress.fit.fit import fit
from hemline.bodies.lifted_arms import FORMER_LIFT_DEG, LIFT_DEG, lift_rotations
from hemline.datasets import Dataset, create, open_dataset
from hemline.datasets.arm_lift import arm_lift_deg, arm_lifts_deg
from hemline.errors import BadDataset, BadModel
from hemline.files import read_tensors, write_tensors
from hemline.motions.motion import JOINT_NAMES
from hemline.sim import SIMULATOR, produce_posed
from tests.animators import formula_garment as made

ARMS = [JOINT_NAMES.index(name) for name in ("left_shoulder", "right_shoulder")]


def with_inputs(folder, inputs) -> Dataset:
    """Makes the anchors of the formula anew, with inputs that say how the garment was walked into the poses."""
    plain, result = made.make_dataset(folder / "plain", 6), create(folder / "walked", made.shirt())
    for row in plain.rows():
        take = plain.take(row)
        result.add(replace(take, inputs=take.inputs | {"simulator": SIMULATOR} | inputs))
    return result


@pytest.fixture(scope="module")
def former(tmp_path_factory) -> Dataset:
    return with_inputs(tmp_path_factory.mktemp("former"), {"protocol": "walk 1"})


def test_drapes_that_name_no_angle_are_of_the_former_one_and_the_model_keeps_it(former, tmp_path):
    assert arm_lift_deg(former) == FORMER_LIFT_DEG != LIFT_DEG
    model = fit(former)
    assert model.lift_deg == FORMER_LIFT_DEG
    model.save(tmp_path / "shirt.safetensors")
    assert hemline.load(tmp_path / "shirt.safetensors").lift_deg == FORMER_LIFT_DEG
    named = with_inputs(tmp_path, {"protocol": "walk 2", "lift_deg": 7.5})
    assert arm_lift_deg(named) == 7.5
    assert arm_lift_deg(create(tmp_path / "empty", made.shirt())) == LIFT_DEG


def test_the_model_compares_poses_with_arms_lifted_by_its_own_angle(former):
    model = fit(former)
    posed = made.body().posed(made.body().rest_pose)
    turned = posed.pose.rotations.astype(np.float64)
    turned[ARMS[0]] = turned[ARMS[1]] = [1, 0, 0, 0]
    turned[ARMS[0], 3], turned[ARMS[1], 3] = -0.9, 0.9
    turned[ARMS] /= np.linalg.norm(turned[ARMS], axis=1, keepdims=True)
    hanging = replace(posed.pose, rotations=turned.astype(np.float32))
    for angle in (0.0, 5.0, FORMER_LIFT_DEG):
        lifted = model._axes(lift_rotations(hanging.rotations, angle))
        after, _ = replace(model, lift_deg=angle).step(model.start(posed), made.body().posed(hanging), 1 / 30)
        np.testing.assert_array_equal(after.axes, lifted)
        assert (lifted != model._axes(lift_rotations(hanging.rotations, angle + 1))).any()


def test_poses_with_hanging_arms_beside_lifted_ones_leave_nothing_to_lift(former, tmp_path):
    both = with_inputs(tmp_path, {"protocol": "walk 2", "lift_deg": LIFT_DEG})
    assert fit(both).lift_deg == LIFT_DEG
    hanging = both.take(both.rows()[-1])
    both.add(replace(hanging, inputs=hanging.inputs | {"lift_deg": 0.0}))
    assert arm_lifts_deg(both) == {0.0, LIFT_DEG}
    assert fit(open_dataset(both.folder)).lift_deg == 0.0


def test_drapes_of_two_angles_are_refused(former, tmp_path):
    both = with_inputs(tmp_path, {"protocol": "walk 2", "lift_deg": LIFT_DEG})
    first = former.take(former.rows()[0])
    both.add(first)
    with pytest.raises(BadDataset, match=f"lifted by different angles in .*; got {LIFT_DEG:g} and 20 degrees"):
        fit(open_dataset(both.folder))
    rest = [[made.body().rest_pose]]
    with pytest.raises(BadDataset, match="hanging arms are lifted by 20 degrees in"):
        produce_posed(former.folder, made.shirt(), rest)


def test_files_that_name_no_angle_have_the_former_one_and_wrong_ones_are_refused(former, tmp_path):
    path = tmp_path / "shirt.safetensors"
    replace(fit(former), lift_deg=3.0).save(path)
    arrays, metadata = read_tensors(path, "model")
    own = {name: value for name, value in metadata["agentdress"].items() if name != "lift_deg"}
    write_tensors(path, arrays, metadata | {"agentdress": own})
    assert hemline.load(path).lift_deg == FORMER_LIFT_DEG
    for wrong in (-1.0, 60.0, "much", None):
        write_tensors(path, arrays, metadata | {"agentdress": own | {"lift_deg": wrong}})
        with pytest.raises(BadModel, match="lifted by 0 to 45 degrees"):
            hemline.load(path)


def test_a_file_whose_clearance_was_on_is_refused(former, tmp_path):
    path = tmp_path / "shirt.safetensors"
    fit(former).save(path)
    arrays, metadata = read_tensors(path, "model")
    for clearance in (0.0, 0.005):
        write_tensors(path, arrays, metadata | {"config": metadata["config"] | {"clearance": clearance}})
        if clearance == 0:
            assert hemline.load(path).name == "agentdress"
        else:
            with pytest.raises(BadModel, match="no longer plays the option 'clearance'"):
                hemline.load(path)

"""Takes that anybody may have written: refused with the file's name where they hold what no take holds."""

import subprocess
import sys

import numpy as np
import pytest

from hemline import bodies
from hemline.datasets import create, read_take, write_take
from hemline.datasets.joint_sensitivity import MOST_LEVERS, derivatives_by_joint, mean_sensitivity
from hemline.errors import BadDataset, DamagedTake
from hemline.files import read_tensors, write_tensors
from tests.datasets.dataset_samples import make_garment, make_take


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.safetensors"
    write_take(path, make_take(make_garment()))
    return path


def refused(path, arrays, metadata, message: str) -> None:
    write_tensors(path, arrays, metadata)
    with pytest.raises(BadDataset, match=message) as found:
        read_take(path)
    assert path.name in str(found.value) and not isinstance(found.value, DamagedTake)


def far(value: float, dtype=np.float32):
    return np.full((6, 4, 3), value, dtype)


UNIT = np.tile(np.array([1, 0, 0, 0], np.float32), (6, 24, 1))
ARRAYS = {
    "vertices as doubles": ({"vertices": far(0, np.float64)}, "must be float32"),
    "vertices far away": ({"vertices": far(1e30)}, "'vertices' of .* has values that no take has; got 1e\\+30"),
    "vertices a little far": ({"vertices": far(101)}, "got 101, beyond 100"),
    "vertices of fewer frames": ({"vertices": far(0)[:5]}, "must be float32 \\(6, any, 3\\)"),
    "flat vertices": ({"vertices": far(0)[..., :2]}, "must be float32"),
    "a pelvis far away": ({"translations": np.full((6, 3), 1e9, np.float32)}, "beyond 100000"),
    "turns of fewer joints": ({"rotations": UNIT[:, :23]}, "must be float32 \\(6, 24, 4\\)"),
    "turns that are none": ({"rotations": 2 * UNIT}, "unit quaternions"),
    "betas of a table": ({"betas": np.zeros((2, 8), np.float32)}, "must be float32 \\(any,\\)"),
    "betas as whole numbers": ({"betas": np.zeros(16, np.int32)}, "must be float32"),
    "lead-in of fewer frames": ({"lead_in": np.zeros(5, np.uint8)}, "must be uint8"),
    "pinched as doubles": ({"pinched": np.zeros(6)}, "must be int32"),
    "a derivative of fewer vertices": ({"derivatives.beta.0": np.zeros((3, 3), np.float32)}, "must be float32 \\(4, 3"),
    "a derivative as doubles": ({"derivatives.beta.0": np.zeros((4, 3))}, "must be float32"),
    "a steep derivative": ({"derivatives.beta.0": np.full((4, 3), 1e30, np.float32)}, "beyond 1e\\+06"),
    "steps of other vertices": (
        {"first": np.zeros((4, 3), np.int32), "steps": np.zeros((5, 3, 3), np.int16)},
        "'steps' of .* must be int16 or int32 \\(5, 4, 3\\)",
    ),
    "steps of fewer frames": (
        {"first": np.zeros((4, 3), np.int32), "steps": np.zeros((4, 4, 3), np.int16)},
        "must be int16",
    ),
    "steps that add up": (
        {"first": np.zeros((4, 3), np.int32), "steps": np.full((5, 4, 3), 2**31 - 1, np.int32)},
        "has values that no take has",
    ),
    "a first frame far away": (
        {"first": np.full((4, 3), -(2**31), np.int32), "steps": np.zeros((5, 4, 3), np.int16)},
        "got 2.15e\\+04, beyond 100",
    ),
    "a first frame as floats": (
        {"first": np.zeros((4, 3), np.float32), "steps": np.zeros((5, 4, 3), np.int16)},
        "'first' of .* must be int32",
    ),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_that_no_take_has_are_refused(file, name):
    changed, message = ARRAYS[name]
    arrays, metadata = read_tensors(file, "take")
    refused(file, arrays | changed, metadata, message)


@pytest.mark.parametrize("name", ["vertices", "rotations", "translations", "betas", "lead_in", "pinched"])
def test_each_array_is_needed(file, name):
    arrays, metadata = read_tensors(file, "take")
    del arrays[name]
    refused(file, arrays, metadata, f"lacks array '{name}'")


MOTION = {"fps": 30.0, "leg_length": 0.9, "name": "a", "source": "", "licence": ""}
METADATA = {
    "a rate in words": {"motion": MOTION | {"fps": "fast"}},
    "a rate of nothing": {"motion": MOTION | {"fps": 0}},
    "a rate below nothing": {"motion": MOTION | {"fps": -30.0}},
    "a rate without end": {"motion": MOTION | {"fps": 10**400}},
    "a truth for a length": {"motion": MOTION | {"leg_length": True}},
    "a number for a licence": {"motion": MOTION | {"licence": 3}},
    "a motion with more": {"motion": MOTION | {"vertices": 3}},
    "a motion that is a list": {"motion": [1]},
    "figures in words": {"figures": {"inside": "few"}},
    "figures that are a list": {"figures": [1.0]},
    "inputs that are a list": {"inputs": []},
    "a part in words": {"inputs": {"part": "first"}},
    "a part below nothing": {"inputs": {"part": -1}},
    "a simulator in words": {"inputs": {"simulator": "new"}},
    "a failure that is a number": {"failed": 1},
    "a kind that is a list": {"take": ["clip"]},
    "a kind that there is not": {"take": "film"},
    "made with a number": {"made_with": {"numba": 1}},
    "made with a list": {"made_with": [1]},
}


@pytest.mark.parametrize("name", METADATA)
def test_metadata_that_no_take_has_is_refused(file, name):
    arrays, metadata = read_tensors(file, "take")
    refused(file, arrays, metadata | METADATA[name], "a.safetensors")


def test_what_it_was_made_with_comes_back_and_is_no_part_of_its_name(tmp_path):
    from dataclasses import replace

    plain = make_take(make_garment())
    take = replace(plain, made_with={"numba": "1", "processor": "a"})
    write_take(tmp_path / "a", take)
    back = read_take(tmp_path / "a")
    assert dict(back.made_with) == {"numba": "1", "processor": "a"} and back.name == plain.name


def test_a_take_from_before_it_said_what_it_was_made_with_is_read(file):
    arrays, metadata = read_tensors(file, "take")
    del metadata["made_with"]
    write_tensors(file, arrays, metadata)
    assert (read_take(file).made_with, read_take(file).simulator) == ({}, 0)


def test_a_take_of_another_garment_with_the_right_hash_is_refused(tmp_path):
    from dataclasses import replace

    dataset = create(tmp_path / "data", make_garment())
    take = make_take(dataset.garment)
    path = dataset.add(replace(take, vertices=take.vertices[:, :3]))
    with pytest.raises(BadDataset, match=f"{path.name} is of another garment; got 3 vertices for the 4 of square"):
        dataset.rows()


def test_an_anchor_that_lacks_derivatives_of_some_joints_is_refused():
    from dataclasses import replace

    clip = make_take(make_garment(), frames=1)
    some = {f"turn.{joint}.{axis}": np.zeros((4, 3), np.float32) for joint in range(24) for axis in range(3)}
    anchor = replace(clip, kind="anchor", derivatives=some)
    body = bodies.load("anny24")
    assert derivatives_by_joint(anchor, body).shape == (24, 3, 4, 3)
    del some["turn.7.1"]
    with pytest.raises(BadDataset, match="lacks derivatives by joints; got no turn.7.1; make it again"):
        mean_sensitivity([replace(anchor, derivatives=some)], body)


def test_derivatives_of_an_equilibrium_that_gives_way_are_bounded_by_the_lever():
    from dataclasses import replace

    body, clip = bodies.load("anny24"), make_take(make_garment(), frames=1)
    joints = body.shaped(clip.betas).posed(clip.motion[0]).joints
    levers = np.linalg.norm(clip.vertices[0] - joints[:, None], axis=2)
    some = {f"turn.{joint}.{axis}": np.zeros((4, 3), np.float32) for joint in range(24) for axis in range(3)}
    some["turn.16.0"][0, 1], some["turn.16.0"][1, 2] = 50.0, 1.4 * levers[16, 1]
    found = derivatives_by_joint(replace(clip, kind="anchor", derivatives=some), body)
    np.testing.assert_allclose(found[16, 0, 0], [0, MOST_LEVERS * levers[16, 0], 0], rtol=1e-6)
    np.testing.assert_allclose(found[16, 0, 1], some["turn.16.0"][1], rtol=1e-6)
    assert np.count_nonzero(found) == 2


QUANTISED = """
import resource, sys
import numpy as np
from hemline.datasets import read_take
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
assert read_take(sys.argv[1]).vertices.shape == (500, 300, 3)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="memory of a process, as POSIX tells it")
def test_a_quantised_take_of_a_megabyte_takes_few(file):
    arrays, metadata = read_tensors(file, "take")
    del arrays["vertices"]
    arrays = {
        "first": np.zeros((300, 3), np.int32),
        "steps": np.ones((499, 300, 3), np.int16),
        "rotations": np.tile(UNIT[:1], (500, 1, 1)),
        "translations": np.zeros((500, 3), np.float32),
        "betas": np.zeros(16, np.float32),
        "lead_in": np.zeros(500, np.uint8),
        "pinched": np.zeros(500, np.int32),
    }
    write_tensors(file, arrays, metadata)
    done = subprocess.run([sys.executable, "-c", QUANTISED, str(file)], capture_output=True, text=True, check=True)
    assert file.stat().st_size < 1_200_000 and int(done.stdout) < 40

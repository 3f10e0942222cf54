"""Body files: what is written is read again, and what is no body file is refused."""

import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from hemline import bodies
from hemline.errors import BadBody, BadOutput
from hemline.files import read_tensors, write_tensors


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("bodies") / "copy.safetensors"
    bodies.write(path, bodies.load())
    return path


def test_read_gives_back_what_was_written(file):
    first, again = bodies.load(), bodies.read(file)
    assert again.hash == first.hash
    for field in fields(first):
        assert np.array_equal(getattr(again, field.name), getattr(first, field.name))


def test_shapedirs_are_rounded_by_less_than_a_hundredth_of_a_millimetre(tmp_path):
    body = bodies.load()
    exact = replace(body, shapedirs=np.random.default_rng(0).uniform(-0.3, 0.3, body.shapedirs.shape))
    bodies.write(tmp_path / "exact.safetensors", exact)
    assert np.abs(bodies.read(tmp_path / "exact.safetensors").shapedirs - exact.shapedirs).max() < 1e-5


def test_truncated(file, tmp_path):
    short = tmp_path / "short.safetensors"
    short.write_bytes(file.read_bytes()[:-1000])
    with pytest.raises(BadBody, match="damaged"):
        bodies.read(short)


def test_missing(tmp_path):
    with pytest.raises(BadBody, match="cannot read"):
        bodies.read(tmp_path / "none.safetensors")


def test_wrong_kind(tmp_path):
    path = tmp_path / "motion.safetensors"
    write_tensors(path, {}, {"kind": "motion"})
    with pytest.raises(BadBody, match="must be a body file; got a motion file"):
        bodies.read(path)


def test_pickle_is_never_read(tmp_path):
    path = tmp_path / "SMPL_NEUTRAL.safetensors"
    path.write_bytes(pickle.dumps({"v_template": [0.0] * 100}))
    with pytest.raises(BadBody, match="a pickle, which is never read"):
        bodies.read(path)


def test_lacking_an_array(file, tmp_path):
    arrays, metadata = read_tensors(file, "body")
    del arrays["weights"], arrays["joints"]
    write_tensors(tmp_path / "less.safetensors", arrays, metadata)
    with pytest.raises(BadBody, match="lacks arrays; got joints, weights"):
        bodies.read(tmp_path / "less.safetensors")


def test_scales_that_do_not_fit(file, tmp_path):
    arrays, metadata = read_tensors(file, "body")
    arrays["shapedirs_scales"] = arrays["shapedirs_scales"][:3]
    write_tensors(tmp_path / "odd.safetensors", arrays, metadata)
    with pytest.raises(BadBody, match="int16 with one scale each"):
        bodies.read(tmp_path / "odd.safetensors")


def test_pose_dependent_offsets_come_back(tmp_path):
    body, path = bodies.load(), tmp_path / "offset.safetensors"
    steps = np.random.default_rng(0).integers(-32767, 32768, (207, len(body.template), 3))
    steps[:, 0, 0] = 32767  # the largest of each is a whole number of steps, so that nothing is rounded
    offset = replace(body, posedirs=steps * np.float32(2**-20))
    bodies.write(path, offset)
    assert np.array_equal(bodies.read(path).posedirs, offset.posedirs) and bodies.read(path).hash == offset.hash
    arrays, metadata = read_tensors(path, "body")
    del arrays["posedirs_scales"]
    write_tensors(path, arrays, metadata)
    with pytest.raises(BadBody, match="posedirs must be int16 with one scale each"):
        bodies.read(path)


def test_unwritable(tmp_path):
    with pytest.raises(BadOutput, match="cannot write"):
        bodies.write(tmp_path / "no" / "folder.safetensors", bodies.load())

"""The container: layouts that safetensors gets wrong, equal bytes, and the ways a file can lie."""

import json
import pickle
import struct

import numpy as np
import pytest

from hemline.errors import BadBody, BadInput, BadOutput
from hemline.files import check_writable, content_hash, read_metadata, read_tensors, write_tensors, written_whole


@pytest.fixture
def file(tmp_path):
    return tmp_path / "a.safetensors"


@pytest.mark.parametrize(
    "layout", [lambda x: x.T, lambda x: x[::-1], np.asfortranarray, lambda x: x[:, ::2], lambda x: x]
)
def test_any_layout_comes_back_as_it_was(file, layout):
    array = layout(np.arange(24, dtype=np.float32).reshape(4, 6))
    write_tensors(file, {"a": array}, {"kind": "body"})
    back, _ = read_tensors(file, "body")
    np.testing.assert_array_equal(back["a"], array)
    assert back["a"].flags.c_contiguous and back["a"].flags.writeable


def test_equal_content_gives_equal_bytes(tmp_path):
    arrays = {"b": np.ones(3, np.float32), "a": np.zeros((2, 2), np.int32)}
    write_tensors(tmp_path / "1", arrays, {"kind": "body", "z": 1, "y": [1, 2]})
    write_tensors(tmp_path / "2", dict(reversed(arrays.items())), {"y": [1, 2], "z": 1, "kind": "body"})
    assert (tmp_path / "1").read_bytes() == (tmp_path / "2").read_bytes()


def test_metadata_is_read_without_the_arrays(file):
    write_tensors(file, {"a": np.ones(5)}, {"kind": "body", "name": "x"})
    assert read_metadata(file, "body") == {"format": 1, "kind": "body", "name": "x"}


def test_the_callers_error_class_is_raised(file):
    with pytest.raises(BadBody, match=r"cannot read .*; got No such file"):
        read_tensors(file, "body", error=BadBody)


def _header(text: dict) -> bytes:
    content = json.dumps(text).encode()
    return struct.pack("<Q", len(content)) + content


HOSTILE = {
    "empty": (b"", "an empty file"),
    "pickle": (pickle.dumps({"a": 1}), "a pickle, which is never read"),
    "zip": (b"PK\x03\x04" + bytes(60), "a zip archive"),
    "huge header": (struct.pack("<Q", 2**60) + b"{}", "without a readable header"),
    "no metadata": (_header({}), "without a readable header"),
    "metadata of others": (_header({"__metadata__": {"format": "pt"}}), "without a readable header"),
    "no JSON": (_header({"__metadata__": {"hemline": "{"}}), "without a readable header"),
    "version no number": (
        _header({"__metadata__": {"hemline": '{"kind": "body", "format": "1"}'}}),
        "without a readable header",
    ),
    "future": (
        _header({"__metadata__": {"hemline": '{"kind": "body", "format": 99}'}}),
        "newer format; got version 99",
    ),
    "other kind": (_header({"__metadata__": {"hemline": '{"kind": "take", "format": 1}'}}), "a take file"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused(file, name):
    content, message = HOSTILE[name]
    file.write_bytes(content)
    with pytest.raises(BadInput, match=message):
        read_tensors(file, "body")
    with pytest.raises(BadInput):
        read_metadata(file, "body")


def test_every_truncation_is_refused(file):
    write_tensors(file, {"a": np.arange(100, dtype=np.float32)}, {"kind": "body"})
    whole = file.read_bytes()
    for length in range(0, len(whole), 37):
        file.write_bytes(whole[:length])
        with pytest.raises(BadInput):
            read_tensors(file, "body")


def test_nan_is_refused(file):
    write_tensors(file, {"a": np.array([1.0, np.nan])}, {"kind": "body"})
    with pytest.raises(BadInput, match="array 'a' must be finite; got NaN"):
        read_tensors(file, "body")
    assert np.isnan(read_tensors(file, "body", finite=False)[0]["a"][1])


def test_a_failed_write_leaves_what_was_there_and_nothing_else(file):
    file.write_text("before")
    with pytest.raises(RuntimeError), written_whole(file) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert file.read_text() == "before"
    assert list(file.parent.iterdir()) == [file]


def test_a_missing_folder_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(BadOutput, match="cannot write .*No such file"), written_whole(tmp_path / "no" / "a"):
        pass
    with pytest.raises(BadOutput, match="No such file"):
        check_writable(tmp_path / "no" / "a")
    with pytest.raises(BadOutput, match="a folder"):
        check_writable(tmp_path)
    check_writable(tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_the_hash_tells_shapes_types_and_values_apart():
    a = np.arange(6, dtype=np.int32)
    hashes = [content_hash(x) for x in (a, a.reshape(2, 3), a.astype(np.int64), a + 1, "a", {"a": 1}, {"a": 2})]
    assert len(set(hashes)) == len(hashes)
    assert content_hash(a.reshape(2, 3).T) == content_hash(np.ascontiguousarray(a.reshape(2, 3).T))

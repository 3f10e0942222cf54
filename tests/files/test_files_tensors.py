"""The container: layouts that safetensors gets wrong, equal bytes, and the ways a file can lie."""

import json
import os
import pickle
import struct
import subprocess
import sys

import numpy as np
import pytest

from hemline.errors import BadBody, BadInput, BadOutput
from hemline.files import (
    atomic_write,
    check_writable,
    content_hash,
    map_tensors,
    read_metadata,
    read_tensors,
    write_tensors,
)


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


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_in_numbers_of_each_size(file, kind, value):
    write_tensors(file, {"a": np.array([[1, 2], [3, value]], kind)}, {"kind": "body"})
    with pytest.raises(BadInput, match="array 'a' must be finite; got NaN or infinity"):
        read_tensors(file, "body")
    assert not np.isfinite(read_tensors(file, "body", finite=False)[0]["a"][1, 1])


def _listing(file, arrays: dict, content: bytes) -> None:
    """A body file whose header lists these arrays before that content."""
    own = {"__metadata__": {"hemline": '{"kind": "body", "format": 1}'}}
    file.write_bytes(_header(own | arrays) + content)


def _array(kind: str, shape, begin: int, end: int) -> dict:
    return {"dtype": kind, "shape": shape, "data_offsets": [begin, end]}


UNTRUE = {
    "NaN in bfloat16": ({"a": _array("BF16", [2], 0, 4)}, b"\xc0\x7f\x80\x3f", "of another kind, BF16"),
    "eight-bit floats": ({"a": _array("F8_E4M3", [4], 0, 4)}, bytes(4), "of another kind, F8_E4M3"),
    "more than there is": ({"a": _array("F32", [2**40 - 1], 0, 4 * (2**40 - 1))}, bytes(8), "with a shape|do not fill"),
    "less than there is": ({"a": _array("F32", [1], 0, 4)}, bytes(8), "do not fill"),
    "a gap": ({"a": _array("F32", [1], 0, 4), "b": _array("F32", [1], 8, 12)}, bytes(12), "do not follow"),
    "two in one place": ({"a": _array("F32", [2], 0, 8), "b": _array("F32", [2], 0, 8)}, bytes(8), "do not follow"),
    "a shape beside its bytes": ({"a": _array("F32", [3], 0, 8)}, bytes(8), "does not fit"),
    "less than nothing": ({"a": _array("F32", [-1, -2], 0, 8)}, bytes(8), "none can have"),
    "nothing of much": ({"a": _array("F32", [0, 2**39, 2**39], 0, 0)}, b"", "does not fit"),
    "many dimensions": ({"a": _array("F32", [1] * 70, 0, 4)}, bytes(4), "none can have"),
    "a number for a shape": ({"a": _array("F32", 1, 0, 4)}, bytes(4), "none can have"),
    "half a number": ({"a": _array("F32", [1.0], 0, 4)}, bytes(4), "none can have"),
    "no shape": ({"a": {"dtype": "F32", "data_offsets": [0, 4]}}, bytes(4), "does not say"),
    "no object": ({"a": [1]}, bytes(4), "does not say"),
    "truth that is neither": ({"a": _array("BOOL", [2], 0, 2)}, b"\1\2", "neither 0 nor 1"),
}


@pytest.mark.parametrize("name", UNTRUE)
def test_a_header_that_lies_about_its_arrays_is_refused(file, name):
    arrays, content, message = UNTRUE[name]
    _listing(file, arrays, content)
    with pytest.raises(BadInput, match=message):
        read_tensors(file, "body")


def test_arrays_of_nothing_and_truth_values_come_back(file):
    arrays = {"none": np.zeros((0, 4, 3), np.float32), "one": np.array([2.5]), "yes": np.array([True, False])}
    write_tensors(file, arrays, {"kind": "body"})
    back, _ = read_tensors(file, "body")
    assert {name: (each.shape, each.dtype) for name, each in back.items()} == {
        name: (each.shape, each.dtype) for name, each in arrays.items()
    }
    assert back["one"] == 2.5 and back["yes"].tolist() == [True, False]


class Torn(BadInput):
    """What was read to its end and is not whole."""


def test_what_was_read_and_is_damaged_is_told_from_what_could_not_be_read(file, tmp_path):
    def raised(content: bytes | None) -> type:
        path = file if content is not None else tmp_path
        if content is not None:
            file.write_bytes(content)
        with pytest.raises(BadInput) as found:
            read_tensors(path, "body", damaged=Torn)
        return found.type

    write_tensors(file, {"a": np.ones(9)}, {"kind": "body"})
    whole = file.read_bytes()
    assert {raised(whole[:length]) for length in (0, 5, 30, len(whole) - 1)} == {Torn}
    assert raised(whole[:-8] + struct.pack("<d", np.nan)) is Torn
    for name in ("future", "other kind"):
        assert raised(HOSTILE[name][0]) is BadInput, name
    assert raised(None) is BadInput  # a folder


READ_WITHIN = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
from hemline.errors import BadInput
from hemline.files import read_metadata, read_tensors
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for read in (read_metadata, read_tensors):
    try:
        read(sys.argv[1], "body")
    except BadInput as error:
        print(error)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024)
"""


def _read_within_two_gigabytes(path) -> tuple[list[str], int]:
    """What each of the two readers says of a file, and the megabytes that reading took."""
    command = [sys.executable, "-c", READ_WITHIN, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    *said, megabytes = done.stdout.splitlines()
    return said, int(megabytes)


def _zeros(path) -> None:
    with path.open("wb") as stream:
        stream.truncate(60 << 30)


def _long_header(path) -> None:
    with path.open("wb") as stream:
        stream.write(struct.pack("<Q", 50 << 30) + b"{")
        stream.truncate(60 << 30)


def _claims(path) -> None:
    _listing(path, {"a": _array("F32", [15 << 30], 0, 60 << 30)}, b"")
    with path.open("rb+") as stream:
        stream.truncate(path.stat().st_size + (60 << 30))


def _many_lists(path) -> None:
    path.write_bytes(_header({"__metadata__": {"hemline": "[" + "[]," * 330_000 + "0]"}}))


def _deep(path) -> None:
    path.write_bytes(_header({"__metadata__": {"hemline": "[" * 1_000_000}}))


def _many_arrays(path) -> None:
    _listing(path, {f"{number}": _array("F32", [0], 0, 0) for number in range(20_000)}, b"")


LARGE = {
    "zeros": (_zeros, "no hemline body file; got bytes without a readable header"),
    "a header of fifty gigabytes": (_long_header, "bytes without a readable header"),
    "arrays of sixty gigabytes": (_claims, "got arrays larger than the memory; free memory"),
    "a megabyte of lists": (_many_lists, "bytes without a readable header"),
    "a megabyte of brackets": (_deep, "bytes without a readable header"),
    "a megabyte of empty arrays": (_many_arrays, ""),
}


@pytest.mark.skipif(sys.platform != "linux", reason="RLIMIT_AS and sparse files, as Linux has them")
@pytest.mark.parametrize("name", LARGE)
def test_no_file_takes_memory_that_it_does_not_hold(file, name):
    write, message = LARGE[name]
    write(file)
    said, megabytes = _read_within_two_gigabytes(file)
    assert message in (said[-1] if said else ""), said
    assert megabytes < 200


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices, as POSIX has them")
def test_what_is_no_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, got in ((tmp_path / "pipe", "a pipe"), (tmp_path, "a folder"), ("/dev/zero", "a device")):
        said, _ = _read_within_two_gigabytes(path)
        assert said == [f"cannot read {path}; got {got}; name a body file that hemline wrote (safetensors)"] * 2


def test_a_failed_write_leaves_what_was_there_and_nothing_else(file):
    file.write_text("before")
    with pytest.raises(RuntimeError), atomic_write(file) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert file.read_text() == "before"
    assert list(file.parent.iterdir()) == [file]


def test_a_missing_folder_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(BadOutput, match="cannot write .*No such file"), atomic_write(tmp_path / "no" / "a"):
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


def test_mapped_arrays_are_those_that_are_read_and_cannot_be_written_to(tmp_path):
    arrays = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "b": np.zeros((0, 4), np.int32), "c": np.uint8([7])}
    write_tensors(tmp_path / "x", arrays, {"kind": "take", "more": 1})
    mapped, metadata = map_tensors(tmp_path / "x", "take")
    read, told = read_tensors(tmp_path / "x", "take")
    assert metadata == told and mapped.keys() == read.keys()
    for name, array in read.items():
        np.testing.assert_array_equal(mapped[name], array)
        assert mapped[name].dtype == array.dtype
    with pytest.raises(ValueError, match="read-only"):
        mapped["a"][0, 0] = 1


def test_a_file_that_is_cut_off_is_not_mapped(tmp_path):
    write_tensors(tmp_path / "x", {"a": np.zeros(1000)}, {"kind": "take"})
    whole = (tmp_path / "x").read_bytes()
    (tmp_path / "x").write_bytes(whole[:-1])
    with pytest.raises(BadInput, match="is damaged"):
        map_tensors(tmp_path / "x", "take")

"""Damaged and hostile npz files: no object is unpickled, and no more memory is used than a member truly has."""

import io
import pickle
import zipfile

import numpy as np
import pytest

from hemline import bodies
from hemline.errors import BadBody
from tests.bodies.smpl_samples import small_arrays
from tests.bodies.test_bodies_smpl_pickle import HUGE, Calls, peak_bytes, refused


def whole() -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **small_arrays(verts=24))
    return stream.getvalue()


def with_member(name: str, content: bytes, *others: str) -> bytes:
    """An npz file of a body with one member replaced, written after all the others."""
    stream = io.BytesIO()
    arrays = small_arrays(verts=24)
    del arrays[name]
    np.savez(stream, **arrays)
    with zipfile.ZipFile(stream, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(f"{name}.npy", content)
        for other in others:
            archive.writestr(other, b"")
    return stream.getvalue()


def npy(shape: str, dtype: str = "<f8", content: bytes = b"\0" * 64, version: bytes = b"\1\0") -> bytes:
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}}}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY" + version + len(header).to_bytes(2, "little") + header + content


def objects(thing: object) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.array([thing], dtype=object), allow_pickle=True)
    return stream.getvalue()


CASES = {
    "objects": (objects(Calls(print, "ran")), "'f': an array of pickled objects"),
    "a pickle": (pickle.dumps({"f": 1}), "a damaged npz .'f' is no array"),
    "text": (npy("(2,)", "<U4"), "'f': an array of <U4"),
    "shape": (npy(f"({HUGE},)"), r"'f': an array that claims shape \(1000000000000,\) in 192 bytes"),
    "negative": (npy("(-1, -3)"), r"'f': an array that claims shape \(-1, -3\)"),
    "code": (npy("(__import__('os').abort(),)"), "a damaged npz .'f' has an unreadable header"),
    "short": (npy("(9,)"), r"'f': an array of shape \(9,\) with 64 bytes"),
    "long": (npy("(7,)"), r"'f': an array of shape \(7,\) with 56 bytes or more"),
    "version": (npy("(8,)", version=b"\3\0"), r"an array of format \(3, 0\)"),
    "empty": (b"", "a damaged npz .'f' is no array"),
    "header": (npy("(8,)" + " " * 20_000), "a damaged npz .'f' has an unreadable header"),
}


@pytest.mark.parametrize("content, match", CASES.values(), ids=CASES.keys())
def test_a_member_that_is_no_array(content, match, tmp_path, capsys):
    assert peak_bytes(lambda: refused(with_member("f", content), match, tmp_path, "a.npz")) < 2**23
    assert capsys.readouterr().out == ""


def test_a_bomb_is_not_unpacked(tmp_path):
    for size, match in (
        (2**27, r"got a file of \d+ bytes that unpacks to 134"),
        (2**21, r"'posedirs': an array of shape \(24, 3, 207\) with 119232 bytes or more"),
    ):
        bomb = with_member("posedirs", npy("(24, 3, 207)", content=b"\0" * size))
        assert len(bomb) < 2**20
        assert peak_bytes(lambda bomb=bomb, match=match: refused(bomb, match, tmp_path, "a.npz")) < 2**23


def test_members_that_say_they_are_larger_than_memory(tmp_path):
    content = bytearray(with_member("f", npy("(8,)")))
    entry = content.rindex(b"PK\1\2")
    content[entry + 24 : entry + 28] = (2**31).to_bytes(4, "little")
    refused(bytes(content), "arrays of more than 1073741824 bytes", tmp_path, "a.npz")


def test_far_more_members_than_arrays(tmp_path):
    crowd = (f"{number}.npy" for number in range(10_001))
    refused(with_member("f", npy("(8,)"), *crowd), "a zip archive of more than 10000 members", tmp_path, "a.npz")


def test_cut_off_anywhere(tmp_path):
    content = whole()
    for length in [*range(4, len(content), 499), len(content) - 1]:
        refused(content[:length], "is not read; got a damaged npz", tmp_path, "a.npz")


def test_damaged_bytes_give_a_body_or_its_refusal(tmp_path):
    content, random, refusals = whole(), np.random.default_rng(0), 0
    for _ in range(300):
        damaged = bytearray(content)
        for place in random.integers(4, len(content), 10):
            damaged[place] = random.integers(256)
        (tmp_path / "a.npz").write_bytes(damaged)
        try:
            bodies.read(tmp_path / "a.npz")
        except BadBody:
            refusals += 1
    assert refusals > 100


def test_objects_that_no_body_needs_are_left_alone(tmp_path):
    np.savez(tmp_path / "a.npz", part2num=np.array([Calls(print, "ran")]), **small_arrays())
    assert bodies.read(tmp_path / "a.npz").name == "a"

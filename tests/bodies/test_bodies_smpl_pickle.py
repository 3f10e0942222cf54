"""Files of strangers: nothing that they say is done, and no more memory is used than they are long."""

import io
import os
import pickle
import re
import tracemalloc

import numpy as np
import pytest
from scipy.sparse import csc_matrix

from hemline import bodies
from hemline.bodies.smpl.smpl_pickle import read_pickled_arrays
from hemline.bodies.smpl.smpl_stand_ins import ENCODE, STAND_INS, Encoder, Refused, Sealed
from hemline.errors import BadBody
from tests.bodies.smpl_samples import Ch, Select, chumpy_in_sight, small_arrays, write_pickle, write_published

P = pickle
HUGE = 10**12
NUMBERS = np.arange(3, dtype=np.int32)
END = b"."


class Calls:
    """Pickles as a call of anything."""

    def __init__(self, function, *arguments):
        self.called = function, arguments

    def __reduce__(self):
        return self.called


def named(module: str, name: str) -> bytes:
    return f"c{module}\n{name}\n".encode()


def text(value: str) -> bytes:
    return b"X" + len(value).to_bytes(4, "little") + value.encode()


class Claimed:
    """Pickles as an array whose state says anything."""

    def __init__(self, shape, dtype="f8", content=b"\0" * 8, made=(0,)):
        self.state, self.made = (1, shape, dtype if isinstance(dtype, Calls) else np.dtype(dtype), False, content), made

    def __reduce__(self):
        return np._core.multiarray._reconstruct, (np.ndarray, self.made, b"b"), self.state


def sparse(shape: object, starts: np.ndarray) -> csc_matrix:
    """Scipy's matrix with any state."""
    made = csc_matrix((1, 1))
    made.__dict__ |= {"data": NUMBERS, "indices": NUMBERS, "indptr": starts, "_shape": shape}
    return made


def refused(content: bytes, match: str, folder, name: str = "a.pkl") -> None:
    (folder / name).write_bytes(content)
    with pytest.raises(BadBody, match=match):
        bodies.read(folder / name)


PROTOCOLS = pytest.mark.parametrize("protocol", range(6))


@PROTOCOLS
@pytest.mark.parametrize("place", ["instead", "beside", "within"])
def test_a_command_of_the_system_is_not_run(protocol, place, tmp_path):
    mark = tmp_path / "ran"
    call = Calls(os.system, f"touch {mark}")
    content = {"instead": call, "beside": small_arrays() | {"z": call}, "within": small_arrays() | {"f": Ch(call)}}
    path = write_pickle(tmp_path / "a.pkl", content[place], protocol)
    with pytest.raises(BadBody, match=r"is not read; got a pickle that asks for '(posix|nt)\.system'"):
        bodies.read(path)
    assert not mark.exists()
    with chumpy_in_sight():
        pickle.loads(path.read_bytes())
    assert mark.exists()  # what the file does to a reader that trusts it


ASKED = [
    ("builtins", "eval"),
    ("builtins", "getattr"),
    ("__builtin__", "getattr"),
    ("builtins", "exec"),
    ("operator", "attrgetter"),
    ("operator", "methodcaller"),
    ("_operator", "attrgetter"),
    ("functools", "partial"),
    ("copyreg", "__newobj__"),
    ("copyreg", "add_extension"),
    ("copy_reg", "_inverted_registry"),
    ("numpy.f2py.crackfortran", "myeval"),
    ("numpy.f2py", "compile"),
    ("numpy", "load"),
    ("numpy", "ndarray.tofile"),
    ("numpy", "core.multiarray._reconstruct"),
    ("numpy", "lib.npyio.os.system"),
    ("numpy", "memmap"),
    ("numpy", "dtype.__class__"),
    ("numpy.core.multiarray", "fromfile"),
    ("numpy._core.multiarray", "frombuffer"),
    ("numpy.testing._private.utils", "runstring"),
    ("chumpy.ch", "Ch.__init__"),
    ("chumpy.ch", "Concatenate"),
    ("chumpy.ch", "pickle"),
    ("chumpy.reordering", "ch"),
    ("scipy.sparse.csc", "np"),
    ("scipy.sparse", "save_npz"),
    ("collections", "OrderedDict.__init__"),
    ("_codecs", "lookup"),
    ("codecs", "encode"),
    ("builtins", "bytearray"),
    ("hemline.bodies.smpl.smpl_stand_ins", "np"),
    ("hemline.bodies.smpl.smpl_stand_ins", "Array"),
    ("os", "system"),
    ("nt", "system"),
]


@pytest.mark.parametrize("module, name", ASKED, ids=".".join)
def test_whatever_is_not_on_the_list_is_refused_and_named(module, name, tmp_path):
    match = "a pickle that asks for '" + re.escape(f"{module}.{name}")
    refused(P.PROTO + b"\2}" + text("f") + named(module, name) + b"s.", match, tmp_path)
    stacked = P.PROTO + b"\4}" + text("f") + text(module) + text(name) + P.STACK_GLOBAL + b"s."
    refused(stacked, match, tmp_path)
    refused(P.MARK + P.INST + f"{module}\n{name}\n".encode() + END, match, tmp_path)


def test_the_list_holds_stand_ins_only():
    assert all(
        type(kind) is Sealed and kind.__module__ == "hemline.bodies.smpl.smpl_stand_ins" for kind in STAND_INS.values()
    )


@pytest.mark.parametrize("module, name", STAND_INS, ids=".".join)
def test_no_stand_in_can_be_changed(module, name, tmp_path):
    kind = STAND_INS[module, name]
    before = {each: dict(vars(each)) for each in kind.__mro__[:-1]}
    for state in (
        b"}" + text("made") + text("x") + b"s",
        b"N}" + text("made") + text("x") + b"s\x86",
        b"N}" + text("__setstate__") + text("x") + b"s\x86",
    ):
        with pytest.raises(Refused):
            read_pickled_arrays(P.PROTO + b"\2" + named(module, name) + state + P.BUILD + END, ["f"])
    assert {each: dict(vars(each)) for each in kind.__mro__[:-1]} == before
    with pytest.raises(Refused, match="an attempt to set 'made' of a class"):
        kind.made = None  # type: ignore[attr-defined]


ENCODED = P.PROTO + b"\2" + named(*ENCODE) + b"q\0"
WORD = text("x" * 6000) + b"q\1" + text("latin1") + P.TUPLE2 + b"q\2"


def test_text_is_encoded_to_no_more_bytes_than_the_file_has():
    """The text is in the file once, and is named each time."""
    for times in (1, 2, 50):
        content = ENCODED + WORD + P.REDUCE + b"h\0h\2R" * (times - 1) + b"}" + END
        if times == 1:
            assert read_pickled_arrays(content, ["f"]) == {}
        else:
            with pytest.raises(Refused, match="a pickle that makes more bytes than it has"):
                read_pickled_arrays(content, ["f"])


@pytest.mark.parametrize("state", [b"}X\5\0\0\0_leftM\xff\xffs", b"N}X\5\0\0\0_leftM\xff\xffs\x86", b"M\xff\xff"])
def test_no_state_raises_what_may_be_encoded(state):
    content = ENCODED + state + P.BUILD + WORD + P.REDUCE + b"h\0h\2R}" + END
    with pytest.raises(Refused, match="a pickle that makes more bytes than it has"):
        read_pickled_arrays(content, ["f"])


def test_an_encoder_is_no_class_and_encodes_latin1_alone():
    assert type(type(Encoder(9))) is type(Encoder) is Sealed
    for made in (b")" + P.NEWOBJ, b")}" + P.NEWOBJ_EX):
        with pytest.raises(Refused, match="a damaged pickle"):
            read_pickled_arrays(ENCODED + made + b"}" + END, ["f"])
    with pytest.raises(Refused, match="text in another encoding than latin1"):
        read_pickled_arrays(ENCODED + text("x") + text("zlib") + P.TUPLE2 + P.REDUCE + b"}" + END, ["f"])


@pytest.mark.parametrize("long", [P.LONG1 + b"\12" + bytes(9) + b"\1", b"L" + str(2**73).encode() + b"L\n"])
def test_many_large_whole_numbers_are_refused(long):
    """Of equal hash they make a dictionary slow; a few are let by."""
    few, many = (P.PROTO + b"\2" + (long + b"0") * count + b"}" + END for count in (900, 1100))
    assert read_pickled_arrays(few, ["f"]) == {}
    with pytest.raises(Refused, match="a pickle of far more objects than a body has"):
        read_pickled_arrays(many, ["f"])


def test_sparse_matrices_are_no_larger_than_a_regressor(tmp_path):
    arrays = small_arrays() | {"J_regressor": sparse((1, 2_000_001), np.array([0, 3], np.int32))}
    write_pickle(tmp_path / "a.pkl", arrays)
    with pytest.raises(BadBody, match=r"'J_regressor': a sparse matrix that claims shape"):
        bodies.read(tmp_path / "a.pkl")


BOMBS = {
    "shape": (Claimed((HUGE,)), r"'f': an array that claims shape \(1000000000000,\) with 8 bytes"),
    "axes": (Claimed((2**39, 2**39, 0, 2**39, 2**39)), "an array whose shape is none"),
    "bignum": (Claimed((2**100_000,)), "an array whose shape is none"),
    "negative": (Claimed((-1, -1)), "an array whose shape is none"),
    "reconstruct": (Calls(np._core.multiarray._reconstruct, np.ndarray, (HUGE,), b"b"), "an array without content"),
    "ndarray": (Calls(np.ndarray, (HUGE,)), "an array without content"),
    "void": (Claimed((1,), Calls(np.dtype, "V2000000000")), "an array of 'V2000000000'"),
    "subarray": (Claimed((1,), Calls(np.dtype, "(100000,100000)f8")), "an array of '.100000,100000.f8'"),
    "objects": (Claimed((1,), "O", [1]), "an array of 'O8'"),
    "list": (Claimed((1,), "f8", [1.0]), "an array of objects"),
    "bytes": (Calls(bytes, HUGE), "bytes made of something else"),
    "kind": (Calls(np._core.multiarray._reconstruct, 3), "an object of no known class"),
    "text": (Calls(__import__("_codecs").encode, "x", "utf-7"), "text in another encoding than latin1"),
    "bare": (Ch.__new__(Ch), "an object without 'x'"),
    "number": (1.0, "'f': a float in place of an array"),
    "set": ({1, 2}, "a (Unread|set) in place of an array"),
    "sparse": (sparse((24, HUGE), NUMBERS), "a sparse matrix that claims"),
    "sparse shape": (sparse(3, NUMBERS), "matrix whose shape is none"),
    "sparse parts": (sparse((3, 5), NUMBERS), "parts do not fit"),
    "sparse ids": (sparse((2, 2), NUMBERS), r"not within 0\.\.1"),
    "sparse starts": (sparse((3, 3), np.array([0, 2, 1, 3])), "do not follow each other"),
    "sparse first": (sparse((3, 3), NUMBERS[[1, 2, 2, 2]] + 1), "do not follow each other"),
    "sparse last": (sparse((3, 3), NUMBERS[[0, 1, 2, 2]]), "do not follow each other"),
    "selection": (Select(NUMBERS, NUMBERS + 1, (3,)), r"indices that are not within 0\.\.2"),
    "selection shape": (Select(NUMBERS, NUMBERS, (HUGE,)), "a selection of 3 in the shape"),
    "selection form": (Select(NUMBERS, NUMBERS, "x"), "a selection whose shape is none"),
    "selection of floats": (Select(NUMBERS, NUMBERS / 1, (3,)), "indices that are not within"),
}


def peak_bytes(call) -> int:
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("thing, match", BOMBS.values(), ids=BOMBS.keys())
@pytest.mark.parametrize("protocol", [2, 4])
def test_things_that_claim_what_they_have_not(thing, match, protocol, tmp_path):
    with chumpy_in_sight():
        stream = io.BytesIO()
        pickler = pickle._Pickler(stream, protocol)
        pickler.dump(small_arrays() | {"f": thing})
    assert peak_bytes(lambda: refused(stream.getvalue(), match, tmp_path)) < 2**24


def counted(opcode: bytes) -> bytes:
    """An instruction that claims 2^40 bytes."""
    return opcode + (2**40).to_bytes(8, "little")


RAW = {
    "bytes": (P.PROTO + b"\4}" + counted(P.BINBYTES8), "got a damaged pickle; name"),
    "text": (P.PROTO + b"\4}" + counted(P.BINUNICODE8), "got a damaged pickle; name"),
    "byte array": (P.PROTO + b"\5}" + counted(P.BYTEARRAY8), "got a damaged pickle; name"),
    "frame": (P.PROTO + b"\4" + counted(P.FRAME) + b"}.", "got a damaged pickle; name"),
    "memo": (P.PROTO + b"\2}" + P.LONG_BINPUT + b"\xff\xff\xff\x7f.", "numbers its objects up to 2147483647"),
    "memo in words": (b"}" + P.PUT + b"99999999999\n.", "numbers its objects up to 99999999999"),
    "tuples": (P.PROTO + b"\2})" + P.TUPLE1 * 50_000 + b"K\1s.", "of far more objects than a body has"),
    "instructions": (P.PROTO + b"\2}" + b"K\0" + b"20" * 300_000 + END, "of far more objects than a body has"),
    "digits": (b"}" + b"L" + b"9" * 5000 + b"L\n.", "got a damaged pickle; name"),
    "person": (b"Pos.system\n.", "with the instruction PERSID"),
    "binary person": (P.PROTO + b"\2K\1" + P.BINPERSID + END, "with the instruction BINPERSID"),
    "extension": (P.PROTO + b"\2" + P.EXT1 + b"\1.", "with the instruction EXT1"),
    "buffer": (P.PROTO + b"\5" + P.NEXT_BUFFER + END, "with the instruction NEXT_BUFFER"),
    "frozen": (P.PROTO + b"\4(" + P.FROZENSET + END, "with the instruction FROZENSET"),
    "no such instruction": (P.PROTO + b"\2}\xff.", "got a damaged pickle; name"),
    "nothing on the stack": (P.PROTO + b"\2" + P.REDUCE + END, "got a damaged pickle; name"),
    "no dictionary": (pickle.dumps([1], 2), "a pickled list in place of a dictionary"),
    "text file": (b"version https://example.org\noid 1\nsize 3\n", "got a damaged pickle; name"),
    "not a call": (P.PROTO + b"\2}K\1)RK\1s.", "got a damaged pickle; name"),
}


@pytest.mark.parametrize("content, match", RAW.values(), ids=RAW.keys())
def test_instructions_that_exhaust_or_break(content, match, tmp_path):
    assert peak_bytes(lambda: refused(content, match, tmp_path)) < 2**24


def test_a_variable_of_itself(tmp_path):
    ring = Ch(np.zeros(3))
    ring.x = ring
    path = write_pickle(tmp_path / "a.pkl", small_arrays() | {"weights": ring})
    with pytest.raises(BadBody, match="'weights': chumpy variables nested more than 8 deep"):
        bodies.read(path)


def test_cut_off_anywhere(tmp_path):
    whole = write_published(tmp_path / "whole.pkl", small_arrays(verts=24)).read_bytes()
    for length in [*range(1, 400), *range(400, len(whole), 997), len(whole) - 1]:
        refused(whole[:length], "is not read; got a (damaged )?pickle", tmp_path)


def test_damaged_bytes_give_a_body_or_its_refusal(tmp_path):
    whole = write_published(tmp_path / "whole.pkl", small_arrays(verts=24)).read_bytes()
    random, refusals = np.random.default_rng(0), 0
    for _ in range(400):
        content = bytearray(whole)
        for place in random.integers(0, len(whole), 60):
            content[place] = random.integers(256)
        (tmp_path / "a.pkl").write_bytes(content)
        try:
            bodies.read(tmp_path / "a.pkl")
        except BadBody:
            refusals += 1
    assert refusals > 100


def test_what_no_body_needs_is_never_looked_at(tmp_path):
    content = small_arrays() | {"odd": Claimed((HUGE,)), "ring": Ch(None), "list": [{"a": 1}], "none": None}
    assert bodies.read(write_pickle(tmp_path / "a.pkl", content)).name == "a"


def test_far_too_long(tmp_path):
    with (tmp_path / "a.pkl").open("wb") as stream:
        stream.truncate(2**30 + 1)
    with pytest.raises(BadBody, match="is too large; got 1073741825 bytes"):
        bodies.read(tmp_path / "a.pkl")

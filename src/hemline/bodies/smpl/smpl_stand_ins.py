"""Names that a pickled SMPL file may use, and the inert classes that replace them.

Nothing that a pickle names is ever called: classes that only store what they are given replace numpy, scipy and chumpy.
Arrays are made afterwards, from bytes whose number must match the claimed shape. The classes are sealed, since a pickle
can also set attributes.
"""

import math
import re
from typing import Any

import numpy as np

_LENGTH_MAX = 2**40


class Refused(ValueError):
    """Content that is not converted into arrays; the text says what was found."""


def is_length(value: object) -> bool:
    """Whether a value can be the length of an axis."""
    return type(value) is int and 0 <= value < _LENGTH_MAX


class Sealed(type):
    """Metaclass of all stand-ins: their attributes cannot be set."""

    def __setattr__(cls, name: str, value: object) -> None:
        raise Refused(f"an attempt to set '{name[:40]}' of a class")


class StandIn(metaclass=Sealed):
    """Stores the state that a pickle gives it, and does nothing."""

    __slots__ = ("state",)
    state: Any

    def __new__(cls, *arguments: object, **options: object) -> Any:
        made = object.__new__(cls)
        made.state = None
        return made

    def __setstate__(self, state: object) -> None:
        self.state = state

    def field(self, *names: str) -> Any:
        """Returns the first of these entries that the state has."""
        state = self.state if isinstance(self.state, dict) else {}
        for name in names:
            if name in state:
                return state[name]
        raise Refused(f"an object without '{names[0]}'")


class Unread(StandIn):
    """Stands in for a set, an ordered dictionary or a plain object, whose content is dropped."""

    __slots__ = ()

    def __setitem__(self, key: object, value: object) -> None: ...
    def append(self, value: object) -> None: ...
    def extend(self, values: object) -> None: ...
    def add(self, value: object) -> None: ...


class Encoder(StandIn):
    """Stands in for `_codecs.encode`: bytes that an older protocol writes as text.

    A pickle may name a text once and have it encoded any number of times. So the bytes are counted: a file cannot
    rightly make more of them than its own size.

    Args:
        left: Number of bytes that may be made in all.
    """

    __slots__ = ("_left",)
    _left: int

    def __new__(cls, left: int) -> "Encoder":
        made = super().__new__(cls)
        made._left = left
        return made

    def __call__(self, text: object, encoding: object = None) -> bytes:
        if not isinstance(text, str) or encoding not in ("latin1", "latin-1"):
            raise Refused("text in another encoding than latin1")
        self._left -= len(text)
        if self._left < 0:
            raise Refused("a pickle that makes more bytes than it has")
        return text.encode("latin1")


class NoBytes(StandIn):
    """Stands in for `bytes`, by which older protocols write that there are none."""

    __slots__ = ()

    def __new__(cls, *content: object) -> bytes:
        if content:
            raise Refused("bytes made of something else")
        return b""


class Dtype(StandIn):
    """Stands in for `numpy.dtype` of plain numbers."""

    __slots__ = ("code",)

    def __new__(cls, code: object = "", *others: object) -> Any:
        made = super().__new__(cls)
        made.code = code
        return made

    def to_numpy(self) -> np.dtype:
        """Returns the NumPy type, in the byte order of the state."""
        order = self.state[1] if isinstance(self.state, tuple) and len(self.state) > 1 else "="
        if not (isinstance(self.code, str) and re.fullmatch("f[248]|[iu][1248]|b1", self.code) and order in "<>=|"):
            raise Refused(f"an array of {str(self.code)[:20]!r}")
        return np.dtype(order + self.code)


class Array(StandIn):
    """Stands in for `numpy.ndarray`; its state is (version, shape, type, whether by columns, bytes)."""

    __slots__ = ()

    def to_numpy(self) -> np.ndarray:
        """Returns the array; its shape must match the number of its bytes."""
        if not (isinstance(self.state, tuple) and len(self.state) == 5 and isinstance(self.state[2], Dtype)):
            raise Refused("an array without content")
        _, shape, dtype, by_columns, content = self.state
        kind, content = dtype.to_numpy(), content.encode("latin1") if isinstance(content, str) else content
        if not isinstance(content, bytes | bytearray):
            raise Refused("an array of objects")
        if not (isinstance(shape, tuple) and len(shape) <= 4 and all(is_length(each) for each in shape)):
            raise Refused("an array whose shape is none")
        if math.prod(shape) * kind.itemsize != len(content):
            raise Refused(f"an array that claims shape {shape} with {len(content)} bytes")
        return np.frombuffer(bytes(content), kind).reshape(shape, order="F" if by_columns else "C")


class Reconstruct(StandIn):
    """Stands in for `_reconstruct` of numpy, an empty array, and `copyreg._reconstructor`, an empty object."""

    __slots__ = ()

    def __new__(cls, kind: object = None, *others: object) -> Any:
        if not isinstance(kind, Sealed):
            raise Refused("an object of no known class")
        return kind()


class Scalar(StandIn):
    """Stands in for `scalar` of numpy, an array without axes."""

    __slots__ = ()

    def __new__(cls, dtype: object = None, content: object = b"") -> Array:
        made = Array()
        made.state = (1, (), dtype, False, content)
        return made


class FromBuffer(StandIn):
    """Stands in for `_frombuffer` of numpy, which protocol 5 writes."""

    __slots__ = ()

    def __new__(cls, content: object = b"", dtype: object = None, shape: object = None, order: object = "C") -> Array:
        made = Array()
        made.state = (1, shape, dtype, order == "F", content)
        return made


class Node(StandIn):
    """Stands in for `chumpy.ch.Ch`, a variable that holds an array `x`."""

    __slots__ = ()


class Selection(StandIn):
    """Stands in for `chumpy.reordering.Select`: entries `idxs` of the array `a`, in `preferred_shape`."""

    __slots__ = ()


class SparseColumns(StandIn):
    """Stands in for `scipy.sparse.csc_matrix`."""

    __slots__ = ()


class SparseRows(StandIn):
    """Stands in for `scipy.sparse.csr_matrix`."""

    __slots__ = ()


_BUILT_IN = {"object": Unread, "set": Unread, "bytes": NoBytes}

STAND_INS: dict[tuple[str, str], type] = {
    ("numpy", "ndarray"): Array,
    ("numpy", "dtype"): Dtype,
    **{(module, "_reconstructor"): Reconstruct for module in ("copyreg", "copy_reg")},
    **{(module, name): kind for module in ("builtins", "__builtin__") for name, kind in _BUILT_IN.items()},
    ("collections", "OrderedDict"): Unread,
    ("chumpy.ch", "Ch"): Node,
    ("chumpy.reordering", "Select"): Selection,
    **{(f"numpy.{mark}core.multiarray", "_reconstruct"): Reconstruct for mark in ("", "_")},
    **{(f"numpy.{mark}core.multiarray", "scalar"): Scalar for mark in ("", "_")},
    **{(f"numpy.{mark}core.numeric", "_frombuffer"): FromBuffer for mark in ("", "_")},
    **{(f"scipy.sparse.{mark}csc", "csc_matrix"): SparseColumns for mark in ("", "_")},
    **{(f"scipy.sparse.{mark}csr", "csr_matrix"): SparseRows for mark in ("", "_")},
}
"""Stand-ins by module and name; a pickle may name these and `ENCODE`, and nothing else."""

ENCODE = ("_codecs", "encode")
"""Function that an `Encoder` stands in for, one for each file."""

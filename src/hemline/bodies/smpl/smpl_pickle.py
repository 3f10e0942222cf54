"""Reads arrays of a pickled SMPL file, without executing anything in it."""

import io
import pickle
from collections.abc import Iterable

import numpy as np

from .smpl_arrays import as_array
from .smpl_stand_ins import ENCODE, STAND_INS, Encoder, Refused

_OPCODES_MAX = 300_000
_TUPLES_MAX = 10_000
_INTEGERS_MAX = 1_000
_INTEGER_BITS = 40
"""Larger integers can be crafted to share one hash, which makes a dictionary of them slow."""
_NEVER = frozenset({"PERSID", "BINPERSID", "EXT1", "EXT2", "EXT4", "NEXT_BUFFER", "READONLY_BUFFER", "FROZENSET"})
_TUPLES = frozenset({"TUPLE", "TUPLE1", "TUPLE2", "TUPLE3"})
_PUTS = frozenset({"PUT", "BINPUT", "LONG_BINPUT"})
_INTEGERS = frozenset({"INT", "LONG", "LONG1", "LONG4"})


def read_pickled_arrays(content: bytes, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Reads the named arrays, as far as a pickled dictionary holds them.

    The pickle's instructions are first scanned without following them, and refused if they would fill the memory or the
    stack, or take long. Then an unpickler follows them that knows nothing but `STAND_INS` and an `Encoder`. Text of
    Python 2 is taken as latin1. Entries that are not named are ignored.

    Args:
        content: Bytes of the file.
        names: Keys of the arrays.

    Raises:
        Refused: The pickle asks for anything else, is damaged, holds no dictionary, or an entry is not an array.
    """
    _check_instructions(content)
    try:
        content_ = _InertUnpickler(content).load()
    except Refused:
        raise
    except Exception as reason:  # the unpickler raises whatever a damaged pickle provokes
        raise Refused("a damaged pickle") from reason
    if not isinstance(content_, dict):
        raise Refused(f"a pickled {type(content_).__name__} in place of a dictionary")
    return {name: _array_of(name, content_[name]) for name in names if name in content_}


class _InertUnpickler(pickle.Unpickler):
    """Unpickler that returns a stand-in for each known name, and refuses all others."""

    def __init__(self, content: bytes) -> None:
        super().__init__(io.BytesIO(content), encoding="latin1")
        self._encoder = Encoder(len(content))

    def find_class(self, module: str, name: str) -> type | Encoder:
        if (module, name) == ENCODE:
            return self._encoder
        if (module, name) not in STAND_INS:
            raise Refused(f"a pickle that asks for '{module[:60]}.{name[:60]}'")
        return STAND_INS[module, name]


def _array_of(name: str, value: object) -> np.ndarray:
    try:
        return as_array(value)
    except Refused as reason:
        raise Refused(f"'{name}': {reason}") from reason
    except Exception as reason:  # whatever numpy raises at a state that no array has
        raise Refused(f"'{name}': a state that no array has") from reason


def _check_instructions(content: bytes) -> None:
    """Refuses a pickle that is cut off, far too long, or crafted to exhaust memory, stack or time."""
    from pickletools import genops

    tuples = integers = 0
    try:
        for count, (opcode, argument, _) in enumerate(genops(content)):
            tuples += opcode.name in _TUPLES
            integers += opcode.name in _INTEGERS and int(argument or 0).bit_length() > _INTEGER_BITS
            if opcode.name in _NEVER:
                raise Refused(f"a pickle with the instruction {opcode.name}")
            if opcode.name in _PUTS and not 0 <= int(argument or 0) <= count + 1:  # a table of that length is made
                raise Refused(f"a pickle that numbers its objects up to {argument}")
            # nested tuples are hashed on the stack
            if count >= _OPCODES_MAX or tuples > _TUPLES_MAX or integers > _INTEGERS_MAX:
                raise Refused("a pickle of far more objects than a body has")
    except Refused:
        raise
    except Exception as reason:
        raise Refused("a damaged pickle") from reason

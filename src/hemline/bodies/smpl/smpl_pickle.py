"""Arrays of a pickled SMPL file, without running anything that it says."""

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
"""Integers of more bits may be made so that all have one hash: a dictionary of many takes time with their square."""
_NEVER = frozenset({"PERSID", "BINPERSID", "EXT1", "EXT2", "EXT4", "NEXT_BUFFER", "READONLY_BUFFER", "FROZENSET"})
_TUPLES = frozenset({"TUPLE", "TUPLE1", "TUPLE2", "TUPLE3"})
_PUTS = frozenset({"PUT", "BINPUT", "LONG_BINPUT"})
_INTEGERS = frozenset({"INT", "LONG", "LONG1", "LONG4"})


def pickled_arrays(content: bytes, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Those of the named arrays that a pickled dictionary holds.

    The pickle's instructions are first read through without following them, and refused where they would fill the
    memory or the stack, or take long. Then they are followed by an unpickler that knows `MAX_STAND_INS` and an `Encoder`,
    and nothing else, text of Python 2 being latin1. Whatever is not named is never looked at.

    Args:
        content: The whole file.
        names: Keys to look for.

    Raises:
        Refused: The pickle names anything else, is damaged, holds no dictionary, or an array is none.
    """
    _check_instructions(content)
    try:
        found = _InertUnpickler(content).load()
    except Refused:
        raise
    except Exception as reason:  # the unpickler raises whatever a damaged pickle provokes
        raise Refused("a damaged pickle") from reason
    if not isinstance(found, dict):
        raise Refused(f"a pickled {type(found).__name__} in place of a dictionary")
    return {name: _named(name, found[name]) for name in names if name in found}


class _InertUnpickler(pickle.Unpickler):
    """Gives a stand-in for each name that is known, and refuses all others."""

    def __init__(self, content: bytes) -> None:
        super().__init__(io.BytesIO(content), encoding="latin1")
        self._encoder = Encoder(len(content))

    def find_class(self, module: str, name: str) -> type | Encoder:
        if (module, name) == ENCODE:
            return self._encoder
        if (module, name) not in STAND_INS:
            raise Refused(f"a pickle that asks for '{module[:60]}.{name[:60]}'")
        return STAND_INS[module, name]


def _named(name: str, value: object) -> np.ndarray:
    try:
        return as_array(value)
    except Refused as reason:
        raise Refused(f"'{name}': {reason}") from reason
    except Exception as reason:  # whatever numpy raises at a state that no array has
        raise Refused(f"'{name}': a state that no array has") from reason


def _check_instructions(content: bytes) -> None:
    """Refuse a pickle that is cut off, far too long, or made to exhaust memory, stack or patience."""
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

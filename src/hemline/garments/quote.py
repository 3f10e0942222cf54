"""Quotes values of untrusted files in messages."""

import reprlib
from typing import Any

_LETTERS = 60
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _LETTERS
_SHORT.maxlevel = 3


def quote(value: Any) -> str:
    """Returns the beginning of a value, however long or deeply nested it is.

    Args:
        value: Text, a number, a list or a dictionary, as TOML and JSON have them.
    """
    try:
        return _SHORT.repr(value)[:_LETTERS]
    except ValueError:  # an integer with more digits than Python converts to text
        return "a number of thousands of digits"

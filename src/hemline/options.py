"""Options are the fields of a frozen dataclass; this module checks their types and ranges.

```python
@dataclass(frozen=True)
class SwingConfig:
    epochs: int = positive(200)
    noise: float = not_negative(0.01)
    mirror: bool = True

    def __post_init__(self) -> None:
        check_options(self)
```
The type of a field is a switch (`bool`), a whole number, a number, one of a few values (`Literal`), or a tuple of
numbers.
"""

import difflib
import math
import numbers
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from .errors import BadInput

T = TypeVar("T", int, float)


@dataclass(frozen=True)
class _Range:
    """The range of a finite number."""

    words: str
    """The requirement, as an error states it."""
    cure: str
    """The cure, as an error states it."""
    least: float
    """Lower limit."""
    closed: bool
    """Whether the lower limit itself is allowed."""
    below: float = math.inf
    """Upper limit, which is not allowed itself."""

    def contains(self, value: Any) -> bool:
        """Tells whether a number lies in the range."""
        return (self.least < value or (self.closed and value == self.least)) and value < self.below


_POSITIVE = _Range("be positive", "above 0", 0, False)
_NOT_NEGATIVE = _Range("not be negative", "of at least 0", 0, True)
_FRACTION = _Range("be a fraction", "between 0 and 1", 0, False, below=1)


def positive(default: T) -> T:
    """Makes a field whose number must lie above 0."""
    return field(default=default, metadata={"range": _POSITIVE})


def not_negative(default: T) -> T:
    """Makes a field whose number must be 0 or more."""
    return field(default=default, metadata={"range": _NOT_NEGATIVE})


def fraction(default: float) -> float:
    """Makes a field whose number must lie between 0 and 1, neither included."""
    return field(default=default, metadata={"range": _FRACTION})


def check_options(options: Any, what: str = "option", *, error: type[BadInput] = BadInput) -> None:
    """Checks each field of a dataclass against its type and range; call it in `__post_init__`.

    Args:
        options: An instance of a dataclass.
        what: Name of a field in errors, as in `option 'epochs' must be positive`.
        error: Class of the exception.

    Raises:
        error: A value has another type, is not finite, or is out of its range.
    """
    kinds = get_type_hints(type(options))
    for each in fields(options):
        value = getattr(options, each.name)
        fault = _fault(value, kinds[each.name], each.metadata.get("range"))
        if fault is not None:
            raise error(f"{what} '{each.name}' must {fault[0]}", repr(value), fault[1])


def options_of(kind: type, values: Mapping[str, Any], what: str = "option", *, error: type[BadInput] = BadInput) -> Any:
    """Makes options from the values of a file or a table; lists become tuples.

    Args:
        kind: A dataclass that calls `check_options`.
        values: Values by name; missing fields keep their default.
        what: Name of a field in errors.
        error: Class of the exception.

    Raises:
        error: A name is unknown (the nearest known one is suggested), or a value cannot be used.
    """
    known = [each.name for each in fields(kind)]
    for name in values:
        if name not in known:
            near = difflib.get_close_matches(str(name), known, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
            raise error(f"unknown {what} '{name}'", repr(values[name]), hint)
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
    try:
        return kind(**given)
    except BadInput as reason:
        raise error(reason.what, reason.got, reason.cure) from reason


def _fault(value: Any, kind: Any, within: _Range | None) -> tuple[str, str] | None:
    """Returns the requirement that a value violates, and the cure; None if the value is right."""
    if get_origin(kind) is Literal:
        return _unless(value in get_args(kind), "be one of a few", f"use one of {', '.join(map(str, get_args(kind)))}")
    if get_origin(kind) is tuple:
        count = len(get_args(kind))
        right = isinstance(value, tuple | list) and len(value) == count
        right = right and not any(_fault(each, get_args(kind)[0], None) for each in value)
        return _unless(right, "be a vector", f"give {count} finite numbers")
    if kind is bool:
        return _unless(isinstance(value, bool), "be a switch", "use true or false")
    if kind is str:
        return _unless(isinstance(value, str), "be text", "give a name or a path")
    return _number_fault(value, kind is int, within)


def _number_fault(value: Any, whole: bool, within: _Range | None) -> tuple[str, str] | None:
    name = "a whole number" if whole else "a finite number"
    cure = f"give {name}" if within is None else f"give {name} {within.cure}"
    if isinstance(value, bool) or not isinstance(value, numbers.Integral if whole else numbers.Real):
        return f"be {name}", cure
    finite = isinstance(value, numbers.Integral) or math.isfinite(value)
    if within is None:
        return _unless(finite, f"be {name}", cure)
    return _unless(finite and within.contains(value), within.words, cure)


def _unless(right: bool, words: str, cure: str) -> tuple[str, str] | None:
    return None if right else (words, cure)

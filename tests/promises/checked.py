"""The checker of types that `typed_scenes` runs hemline with: beartype, which asks jaxtyping for shapes of arrays."""

import inspect
from collections import Counter
from typing import Any, Self

import numpy as np
from beartype import BeartypeConf, BeartypeHintOverrides, beartype

NUMPY_TOO = {bool: bool | np.bool_, int: int | np.integer, float: float | int | np.floating | np.integer}
"""Numbers of NumPy do where a number is asked for."""
RULES = BeartypeConf(hint_overrides=BeartypeHintOverrides(NUMPY_TOO), violation_type=TypeError)

decorated: Counter[str] = Counter()
"""How often each module asked for a check of a function."""


def checked(function):
    """A function whose arguments and result are compared with their annotations in each call.

    An argument that may be left out for None may be None. What returns an instance of its own class (`Self`) is not
    checked: beartype sees methods here, not classes.
    """
    decorated[function.__module__] += 1
    left_out = {each.name for each in inspect.signature(function).parameters.values() if each.default is None}
    for name, hint in function.__annotations__.items():
        function.__annotations__[name] = Any if hint is Self else hint | None if name in left_out else hint
    return beartype(conf=RULES)(function)

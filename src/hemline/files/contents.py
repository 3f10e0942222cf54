"""Checks the contents of files, mostly of models, piece by piece before they are used."""

from collections.abc import Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from hemline.errors import BadInput, BadModel, HemlineError

AGAIN = "copy the file again, or make it with 'hemline fit'"
"""The cure for a model file that is damaged."""


def part(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Returns the arrays whose names start with `prefix.`, by the rest of their names."""
    return {name.removeprefix(f"{prefix}."): array for name, array in arrays.items() if name.startswith(f"{prefix}.")}


def array_of(
    arrays: Mapping[str, np.ndarray],
    name: str,
    dtype: str | tuple[str, ...],
    shape: tuple[int | None, ...],
    *,
    owner: str = "the model",
    error: type[BadInput] = BadModel,
    cure: str = AGAIN,
) -> np.ndarray:
    """Returns one array of a file after checking its type and shape.

    Args:
        arrays: All arrays of the file.
        name: Name of the array.
        dtype: Its type, or several allowed types.
        shape: Its lengths; None for any length.
        owner: Name of the file in errors.
        error: Class of the exception.
        cure: Cure for the message.

    Raises:
        error: The array is missing, has another type or shape, or holds NaN or infinity.
    """
    if name not in arrays:
        raise error(f"{owner} lacks array '{name}'", f"{len(arrays)} others", cure)
    array, kinds = arrays[name], (dtype,) if isinstance(dtype, str) else dtype
    fits = array.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    if array.dtype not in [np.dtype(kind) for kind in kinds] or not fits:
        wanted = f"{' or '.join(kinds)} {tuple('any' if n is None else n for n in shape)}".replace("'", "")
        raise error(f"array '{name}' of {owner} must be {wanted}", f"{array.dtype} {array.shape}", cure)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise error(f"array '{name}' of {owner} must be finite", "NaN or infinity", cure)
    return array


def entry(metadata: Mapping[str, Any], name: str, kind: type) -> Any:
    """Returns one metadata value of a model file after checking its type.

    Raises:
        BadModel: The key is missing, or the value has another type.
    """
    if name not in metadata:
        raise BadModel(f"the model lacks metadata '{name}'", ", ".join(sorted(metadata)), AGAIN)
    if not isinstance(metadata[name], kind):
        raise BadModel(f"metadata '{name}' of the model must be {kind.__name__}", type(metadata[name]).__name__, AGAIN)
    return metadata[name]


@contextmanager
def damage_as_bad_model(what: str):
    """Context manager that turns the exceptions of a damaged part of a model into BadModel."""
    try:
        yield
    except BadModel:
        raise
    except HemlineError as reason:
        raise BadModel(f"{what} is damaged", reason, AGAIN) from reason
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as reason:
        raise BadModel(f"{what} is damaged", f"{type(reason).__name__}: {reason}", AGAIN) from reason

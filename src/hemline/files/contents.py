"""What a file holds, a model above all, checked piece by piece before anything runs on it."""

from collections.abc import Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from hemline.errors import BadInput, BadModel, HemlineError

AGAIN = "copy the file again, or make it with 'hemline fit'"
"""The cure for a model file that is damaged."""


def part(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Arrays whose names start with `prefix.`, without it."""
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
    """One array of a file, of exactly that dtype (or one of several) and shape (None: any length).

    Args:
        arrays: All arrays of the file.
        name: The one that is looked for.
        dtype: Its type, or those that it may have.
        shape: Its lengths.
        owner: What an error calls the file.
        error: The class to raise.
        cure: What to do about it.

    Raises:
        error: It is missing, differs, or holds NaN or infinity.
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
    """One metadata key of a model file, of that type.

    Raises:
        BadModel: It is missing, or of another type.
    """
    if name not in metadata:
        raise BadModel(f"the model lacks metadata '{name}'", ", ".join(sorted(metadata)), AGAIN)
    if not isinstance(metadata[name], kind):
        raise BadModel(f"metadata '{name}' of the model must be {kind.__name__}", type(metadata[name]).__name__, AGAIN)
    return metadata[name]


@contextmanager
def refused(what: str):
    """Turn what a damaged part of a model makes Python raise into BadModel."""
    try:
        yield
    except BadModel:
        raise
    except HemlineError as reason:
        raise BadModel(f"{what} is damaged", reason, AGAIN) from reason
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as reason:
        raise BadModel(f"{what} is damaged", f"{type(reason).__name__}: {reason}", AGAIN) from reason

"""What a model file holds, checked piece by piece before anything runs on it."""

from collections.abc import Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from hemline.errors import BadModel, HemlineError

AGAIN = "copy the file again, or make it with 'hemline fit'"
"""The cure for a model file that is damaged."""


def part(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Arrays whose names start with `prefix.`, without it."""
    return {name.removeprefix(f"{prefix}."): array for name, array in arrays.items() if name.startswith(f"{prefix}.")}


def array_of(arrays: Mapping[str, np.ndarray], name: str, dtype: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """One array of a model file, of exactly that dtype and shape (None: any length).

    Raises:
        BadModel: It is missing, differs, or holds NaN or infinity.
    """
    if name not in arrays:
        raise BadModel(f"the model lacks array '{name}'", f"{len(arrays)} others", AGAIN)
    array = arrays[name]
    fits = array.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    if array.dtype != np.dtype(dtype) or not fits:
        wanted = f"{dtype} {tuple('any' if n is None else n for n in shape)}".replace("'", "")
        raise BadModel(f"array '{name}' of the model must be {wanted}", f"{array.dtype} {array.shape}", AGAIN)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise BadModel(f"array '{name}' of the model must be finite", "NaN or infinity", AGAIN)
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

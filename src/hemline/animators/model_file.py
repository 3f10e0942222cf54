"""Model files: what is common to those of all animators. Keys are specified in `docs/format.md`."""

import difflib
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadInput, BadModel, HemlineError
from hemline.files import read_metadata, read_tensors, write_tensors
from hemline.garments.garment import Garment

from .registry import animator_class

UNITS = {"length": "metre", "time": "second", "mass": "kilogram", "angle": "radian", "up": "y"}
AGAIN = "copy the file again, or make it with 'hemline fit'"
SHIPPED = Path(__file__).parents[1] / "models"


def shipped_models(folder: Path = SHIPPED) -> list[str]:
    """Names of the models that came with the package."""
    found = []
    for file in sorted(folder.glob("*.safetensors")):
        try:
            read_metadata(file, "model", error=BadModel)
        except BadModel:
            continue  # a body, or clips
        found.append(file.stem)
    return found


def load(path: str | Path) -> Any:
    """Load a fitted animator.

    Args:
        path: A model file, or the name of a shipped model.

    Returns:
        The animator; its class is named in the file.

    Raises:
        BadModel: No shipped model has that name; or the file is missing, truncated, a pickle, of another kind or of a
            future version, lacks a key, or holds an array of the wrong type or shape, or NaN.
    """
    if isinstance(path, str) and not Path(path).suffix and not Path(path).exists():
        path = _shipped(path)
    arrays, metadata = read_tensors(path, "model", error=BadModel)
    with named(path):
        return animator_class(entry(metadata, "animator", str), error=BadModel).of(arrays, metadata)


def save_model(
    path: str | Path,
    animator: str,
    arrays: Mapping[str, np.ndarray],
    *,
    garment: Garment,
    body: Mapping[str, str],
    config: Mapping[str, Any],
    figures: Mapping[str, float],
    licences: Sequence[str],
    extra: Mapping[str, Any],
) -> None:
    """Write a model file, whole or not at all.

    Args:
        path: The file.
        animator: Name of the animator.
        arrays: The animator's own arrays.
        garment: Stored in the file, mesh and all.
        body: `name` and `hash` of the body that it was fitted on.
        config: Options of the fit.
        figures: What the fit reached.
        licences: Notices of the body and of the motions.
        extra: The animator's own metadata, one key a part.

    Raises:
        BadOutput: The path cannot be written.
    """
    metadata = {
        "kind": "model",
        "animator": animator,
        "config": dict(config),
        "garment": garment.metadata(),
        "body": dict(body),
        "units": UNITS,
        "licences": list(licences),
        "figures": dict(figures),
    } | dict(extra)
    write_tensors(path, dict(arrays) | {f"garment.{n}": a for n, a in garment.arrays().items()}, metadata)


def garment_of(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Garment:
    """The garment in a model file; raises BadModel."""
    with refused("the model's garment"):
        garment = Garment.of(part(arrays, "garment"), entry(metadata, "garment", dict))
    faces, vertices = garment.faces, len(garment.vertices)
    if faces.size and not (faces.min() >= 0 and faces.max() < vertices):
        raise BadModel("a face of the model's garment points past its vertices", f"{faces.max()} of {vertices}", AGAIN)
    return garment


def part(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Arrays whose names start with `prefix.`, without it."""
    return {name.removeprefix(f"{prefix}."): array for name, array in arrays.items() if name.startswith(f"{prefix}.")}


def array_of(arrays: Mapping[str, np.ndarray], name: str, dtype: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """One array of a model file, of exactly that dtype and shape (None: any length).

    Raises:
        BadModel: It is missing or differs.
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
    """One metadata key of a model file, of that type; raises BadModel."""
    if name not in metadata:
        raise BadModel(f"the model lacks metadata '{name}'", ", ".join(sorted(metadata)), AGAIN)
    if not isinstance(metadata[name], kind):
        raise BadModel(f"metadata '{name}' of the model must be {kind.__name__}", type(metadata[name]).__name__, AGAIN)
    return metadata[name]


def config_of(config_class: type, values: Mapping[str, Any], *, error: type[BadInput] = BadModel) -> Any:
    """A frozen config from stored values.

    Raises:
        error: A key is unknown; the nearest one is named.
    """
    known = [field.name for field in fields(config_class)]
    for name in values:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
            raise error(f"unknown option '{name}'", repr(values[name]), hint)
    with refused("the model's config"):
        return config_class(**values)


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


@contextmanager
def named(path: str | Path):
    """Put the file's name before what BadModel says."""
    try:
        yield
    except BadModel as reason:
        raise BadModel(f"{path}: {reason.what}", reason.got, reason.cure) from reason


def _shipped(name: str) -> Path:
    names = shipped_models()
    if name in names:
        return SHIPPED / f"{name}.safetensors"
    near = difflib.get_close_matches(name, names, 1)
    listed = f"shipped: {', '.join(names) or 'none'}; or name a .safetensors file"
    cure = f"did you mean '{near[0]}'?" if near else listed
    raise BadModel("no shipped model has this name", repr(name), cure)

"""Model files: what is common to those of all animators. Keys are specified in `docs/format.md`."""

import difflib
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadModel
from hemline.files import read_metadata, read_tensors, write_tensors
from hemline.files.contents import AGAIN, entry, part, refused
from hemline.garments.garment import Garment
from hemline.motions.terms import as_stated

from .registry import animator_kind

UNITS = {"length": "metre", "time": "second", "mass": "kilogram", "angle": "radian", "up": "y"}
SHIPPED_FOLDER = Path(__file__).parents[1] / "models"


def shipped_models(folder: Path = SHIPPED_FOLDER) -> list[str]:
    """Names of the models that came with the package."""
    found = []
    for file in sorted(folder.glob("*.safetensors")):
        try:
            read_metadata(file, "model", error=BadModel)
        except BadModel:
            continue  # a body, or clips
        found.append(file.stem)
    return found


def model_path(name: str | Path) -> Path:
    """The file of a model: the path itself, or that of a shipped model by its name.

    Raises:
        BadModel: No shipped model has that name.
    """
    by_name = isinstance(name, str) and not Path(name).suffix and not Path(name).exists()
    return _path_of_shipped(str(name)) if by_name else Path(name)


def load(path: str | Path) -> Any:
    """Load a fitted animator, or a `Wearable` that was fitted on many garments.

    Args:
        path: A model file, or the name of a shipped model.

    Returns:
        The animator or the wearable; its kind is named in the file.

    Raises:
        BadModel: No shipped model has that name; or the file is missing, truncated, a pickle, of another kind or of a
            future version, lacks a key, or holds an array of the wrong type or shape, or NaN.
    """
    path = model_path(path)
    arrays, metadata = read_tensors(path, "model", error=BadModel)
    with name_file_in_errors(path):
        return animator_kind(entry(metadata, "animator", str), error=BadModel).of(arrays, metadata)


def save_model(
    path: str | Path,
    animator: str,
    arrays: Mapping[str, np.ndarray],
    *,
    garment: Garment | None,
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
        garment: Stored in the file, mesh and all; None for a `Wearable`, which is given one later.
        body: `name` and `hash` of the body that it was fitted on.
        config: Options of the fit.
        figures: What the fit reached.
        licences: Terms of the body, of the garment's mesh and of the motions.
        extra: The animator's own metadata, one key a part.

    Raises:
        BadOutput: The path cannot be written.
    """
    metadata = {
        "kind": "model",
        "animator": animator,
        "config": dict(config),
        "body": dict(body),
        "units": UNITS,
        "licences": list(as_stated(licences)),
        "figures": dict(figures),
    } | dict(extra)
    held = dict(arrays)
    if garment is not None:
        metadata["garment"] = garment.metadata()
        held |= {f"garment.{name}": array for name, array in garment.arrays().items()}
    write_tensors(path, held, metadata)


def garment_of(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Garment:
    """The garment in a model file; raises BadModel."""
    with refused("the model's garment"):
        garment = Garment.of(part(arrays, "garment"), entry(metadata, "garment", dict))
    faces, vertices = garment.faces, len(garment.vertices)
    if faces.size and not (faces.min() >= 0 and faces.max() < vertices):
        raise BadModel("a face of the model's garment points past its vertices", f"{faces.max()} of {vertices}", AGAIN)
    return garment


@contextmanager
def name_file_in_errors(path: str | Path):
    """Put the file's name before what BadModel says."""
    try:
        yield
    except BadModel as reason:
        raise BadModel(f"{path}: {reason.what}", reason.got, reason.cure) from reason


def _path_of_shipped(name: str) -> Path:
    names = shipped_models()
    if name in names:
        return SHIPPED_FOLDER / f"{name}.safetensors"
    near = difflib.get_close_matches(name, names, 1)
    listed = f"shipped: {', '.join(names) or 'none'}; or name a .safetensors file"
    cure = f"did you mean '{near[0]}'?" if near else listed
    raise BadModel("no shipped model has this name", repr(name), cure)

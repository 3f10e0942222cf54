"""Reads and writes model files. What all of them share is here; their keys are specified in `docs/format.md`."""

import difflib
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadModel
from hemline.files import read_metadata, read_tensors, write_tensors
from hemline.files.contents import AGAIN, damage_as_bad_model, entry, part
from hemline.garments.garment import Garment
from hemline.meshes import MESH_ENDINGS
from hemline.motions.terms import as_stated

from .registry import animator_kind

UNITS = {"length": "metre", "time": "second", "mass": "kilogram", "angle": "radian", "up": "y"}
"""Units of model files."""
SHIPPED_FOLDER = Path(__file__).parents[1] / "models"
"""Folder of the model files that come with the package."""


def shipped_models(folder: Path = SHIPPED_FOLDER) -> list[str]:
    """Returns the names of the models that come with the package."""
    found = []
    for file in sorted(folder.glob("*.safetensors")):
        try:
            read_metadata(file, "model", error=BadModel)
        except BadModel:
            continue  # a body, or clips
        found.append(file.stem)
    return found


def model_path(name: str | Path) -> Path:
    """Returns the file of a model, which is given as a path or as the name of a shipped model.

    Raises:
        BadModel: No shipped model has that name.
    """
    by_name = isinstance(name, str) and not Path(name).suffix and not Path(name).exists()
    return _path_of_shipped(str(name)) if by_name else Path(name)


def load(path: str | Path) -> Any:
    """Loads a fitted animator, or a `Wearable` that was fitted on many garments.

    Args:
        path: A model file, or the name of a shipped model.

    Returns:
        The animator or the wearable. The file names its kind.

    Raises:
        BadModel: No shipped model has that name. Or the file is a mesh, missing, truncated, a pickle, of another kind
            or of a future version, lacks a key, or holds NaN or an array of the wrong type or shape.
    """
    path = model_path(path)
    if path.suffix.lower() in MESH_ENDINGS:
        cure = f"play it by 'hemline animate --garment {path}', or make a model of it by 'hemline make'"
        raise BadModel(f"{path} must be a model", f"a mesh ({path.suffix})", cure)
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
    """Writes a model file, whole or not at all.

    Args:
        path: The file.
        animator: Name of the animator.
        arrays: The animator's own arrays by name.
        garment: Garment to store with its mesh; None for a `Wearable`, which is given one later.
        body: `name` and `hash` of the body that the animator was fitted on.
        config: Options of the fit.
        figures: Figures of the fit.
        licences: Terms of the body, of the garment's mesh and of the motions.
        extra: The animator's own metadata by key.

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
    stored = dict(arrays)
    if garment is not None:
        metadata["garment"] = garment.metadata()
        stored |= {f"garment.{name}": array for name, array in garment.arrays().items()}
    write_tensors(path, stored, metadata)


def copy_with_entry(model: str | Path, path: str | Path, key: str, value: Mapping[str, Any]) -> None:
    """Copies a model file and adds an entry to its metadata, which readers ignore.

    Args:
        model: The model file.
        path: The file to write, whole or not at all.
        key: Name of the entry.
        value: JSON-like values.

    Raises:
        BadModel: The model cannot be read.
        BadOutput: The path cannot be written.
    """
    arrays, metadata = read_tensors(model, "model", error=BadModel)
    write_tensors(path, arrays, metadata | {key: dict(value)})


def garment_of(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Garment:
    """Reads the garment from a model file; raises BadModel."""
    with damage_as_bad_model("the model's garment"):
        garment = Garment.of(part(arrays, "garment"), entry(metadata, "garment", dict))
    faces, vertices = garment.faces, len(garment.vertices)
    if faces.size and not (faces.min() >= 0 and faces.max() < vertices):
        raise BadModel("a face of the model's garment points past its vertices", f"{faces.max()} of {vertices}", AGAIN)
    return garment


@contextmanager
def name_file_in_errors(path: str | Path):
    """Puts the name of a file in front of the message of each BadModel raised inside."""
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

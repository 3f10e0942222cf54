"""Checks that a file holds a take before it is used, since people copy datasets from elsewhere."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hemline.arrays import FramesOfVertices
from hemline.errors import BadDataset
from hemline.files.contents import array_of
from hemline.motions.motion import JOINT_COUNT

VERTEX_LIMIT = 100.0
"""Largest distance of a vertex from the pelvis of its frame, along each axis [m]."""

PELVIS_LIMIT = 100_000.0
"""Largest distance of the pelvis from the origin, along each axis [m]."""

DERIVATIVE_LIMIT = 1e6
"""Largest derivative of a vertex, along each axis [m/rad, m]."""

MAKE_AGAIN = "move the file away and run 'hemline simulate' or 'hemline drape' again, which makes what is missing"

QUANTUM = 1e-5
"""Step of quantised vertices [m]."""


def check_arrays(path: str | Path, arrays: dict[str, np.ndarray]) -> None:
    """Checks the arrays of a take, and decodes quantised vertices to `vertices`.

    Args:
        path: The file, for the errors.
        arrays: Arrays of the file, changed in place.

    Raises:
        BadDataset: An array is missing, of a wrong type or shape, or has impossible values.
    """

    def of(name: str, dtype: str | tuple[str, ...], *shape: int | None) -> np.ndarray:
        return array_of(arrays, name, dtype, shape, owner=str(path), error=BadDataset, cure=MAKE_AGAIN)

    translations = of("translations", "float32", None, 3)
    frames = len(translations)
    of("rotations", "float32", frames, JOINT_COUNT, 4)
    of("betas", "float32", None)
    of("lead_in", "uint8", frames)
    of("pinched", "int32", frames)
    _within(path, "translations", translations, PELVIS_LIMIT)
    if "first" in arrays and "steps" in arrays:
        first = of("first", "int32", None, 3)
        steps = of("steps", ("int16", "int32"), max(frames - 1, 0), len(first), 3)
        arrays["vertices"] = _dequantise(first, steps)
        del arrays["first"], arrays["steps"]
    vertices = of("vertices", "float32", frames, None, 3)
    for frame, pelvis in zip(vertices, translations, strict=True):
        _within(path, "vertices", frame - pelvis, VERTEX_LIMIT)
    for name in arrays:
        if name.startswith("derivatives."):
            _within(path, name, of(name, "float32", vertices.shape[1], 3), DERIVATIVE_LIMIT)


def check_metadata(path: str | Path, metadata: Mapping[str, Any]) -> None:
    """Checks the metadata of a take.

    Args:
        path: The file, for the errors.
        metadata: Metadata of the file.

    Raises:
        BadDataset: A key is missing, or its value is of a wrong type.
    """
    cure = MAKE_AGAIN
    missing = [name for name in ("take", "motion", "figures", "inputs", "failed") if name not in metadata]
    if missing:
        raise BadDataset(f"{path} lacks metadata", f"no {', '.join(missing)}", cure)
    motion, inputs = metadata["motion"], metadata["inputs"]
    right = {
        "take": isinstance(metadata["take"], str),
        "motion": isinstance(motion, dict)
        and motion.keys() == {"fps", "leg_length", "name", "source", "licence"}
        and all(is_number(motion[name]) for name in ("fps", "leg_length"))
        and all(isinstance(motion[name], str) for name in ("name", "source", "licence")),
        "figures": isinstance(metadata["figures"], dict) and all(map(is_number, metadata["figures"].values())),
        "inputs": isinstance(inputs, dict) and all(_is_count(inputs.get(name, 0)) for name in ("part", "simulator")),
        "failed": metadata["failed"] is None or isinstance(metadata["failed"], str),
        "made_with": isinstance(metadata.get("made_with", {}), dict)
        and all(isinstance(text, str) for text in metadata.get("made_with", {}).values()),
    }
    wrong = [name for name, fits in right.items() if not fits]
    if wrong:
        raise BadDataset(f"{path} has metadata of the wrong kind", f"'{wrong[0]}' that is none of a take's", cure)


def is_number(value: Any) -> bool:
    """Whether a value is a finite number that a float can hold."""
    return type(value) in (int, float) and abs(value) < 1e300


def _is_count(value: Any) -> bool:
    return type(value) is int and 0 <= value < 2**31


def _within(path: str | Path, name: str, array: np.ndarray, limit: float) -> None:
    """Refuses values with a larger magnitude than a limit."""
    if array.size and (largest := float(np.abs(array).max())) > limit:
        got = f"{largest:.3g}, beyond {limit:g}"
        raise BadDataset(f"array '{name}' of {path} has values that no take has", got, MAKE_AGAIN)


def _dequantise(first: np.ndarray, steps: np.ndarray) -> FramesOfVertices:
    """Decodes vertices from the first frame and the differences between frames, in steps of `QUANTUM` [m]."""
    vertices = np.empty((len(steps) + 1, *first.shape), np.float32)
    where = first.astype(np.int64)
    vertices[0] = where * QUANTUM
    for frame, step in enumerate(steps, start=1):
        where += step
        vertices[frame] = where * QUANTUM
    return vertices

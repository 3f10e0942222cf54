"""Reads and writes motions in hemline's own container."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadMotion, BadOutput
from hemline.files import read_tensors, write_tensors

from .motion import Motion

_ARRAYS = ("rotations", "translations")
_FIELDS = {
    "fps": int | float,
    "leg_length": int | float,
    "name": str,
    "source": str,
    "licence": str,
    "notes": list,
}


def write(path: str | Path, motion: Motion) -> None:
    """Writes a motion in hemline's own format, whole or not at all.

    Raises:
        BadOutput: The ending is not `.safetensors`, or the path cannot be written.
    """
    if Path(path).suffix.lower() != ".safetensors":
        raise BadOutput(
            f"no motion is written to {path}", f"the ending '{Path(path).suffix}'", "let it end in .safetensors"
        )
    arrays = {name: getattr(motion, name) for name in _ARRAYS}
    write_tensors(path, arrays, {"kind": "motion"} | _metadata(motion))


def write_many(path: str | Path, motions: Mapping[str, Motion]) -> None:
    """Writes several motions into one file, each under its key."""
    arrays = {f"{key}.{name}": getattr(motion, name) for key, motion in motions.items() for name in _ARRAYS}
    described = {key: _metadata(motion) for key, motion in motions.items()}
    write_tensors(path, arrays, {"kind": "motions", "motions": described})


def read_stored(path: str | Path) -> Motion:
    """Reads a motion that `write` wrote.

    Raises:
        BadMotion: The file is missing, damaged, of another kind or a future version, or its content is not a motion.
    """
    arrays, metadata = read_tensors(path, "motion", error=BadMotion)
    return _motion(path, arrays, metadata)


def read_many(path: str | Path) -> dict[str, Motion]:
    """Reads motions that `write_many` wrote.

    Raises:
        BadMotion: The file cannot be read, see `read_stored`.
    """
    arrays, metadata = read_tensors(path, "motions", error=BadMotion)
    motions = {}
    for key, described in metadata["motions"].items():
        own = {name: arrays[f"{key}.{name}"] for name in _ARRAYS if f"{key}.{name}" in arrays}
        motions[key] = _motion(path, own, described)
    return motions


def _metadata(motion: Motion) -> dict[str, Any]:
    return {field: getattr(motion, field) for field in _FIELDS} | {"notes": list(motion.notes)}


def _motion(path: str | Path, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Motion:
    missing = [name for name in _ARRAYS if name not in arrays] + [name for name in _FIELDS if name not in metadata]
    if missing:
        raise BadMotion(f"{path} lacks a part of a motion", f"no '{missing[0]}'", "write it again with hemline")
    fields = {field: metadata[field] for field in _FIELDS}
    for field, kind in _FIELDS.items():
        if not isinstance(fields[field], kind):
            raise BadMotion(
                f"'{field}' of {path} has the wrong type", repr(fields[field]), "write it again with hemline"
            )
    notes = tuple(map(str, fields.pop("notes")))
    return Motion(**{name: arrays[name] for name in _ARRAYS}, **fields, notes=notes)

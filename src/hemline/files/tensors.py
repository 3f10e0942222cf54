"""Arrays and metadata in one safetensors file: bodies, motions, garments, takes, models.

The file's metadata has one key, `hemline`, that holds JSON with sorted keys, so that equal content gives equal bytes.
What the JSON must hold for each kind of file is specified in `docs/format.md`.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadInput

from .atomic import written_whole
from .container import Container, Untrue, opened

FORMAT_VERSION = 1
"""Version of the container; a file with a higher one is refused."""


def tensor_bytes(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> bytes:
    """The exact bytes that `write_tensors` writes."""
    from safetensors.numpy import save

    # safetensors writes wrong values for arrays that are not C-contiguous, without an error
    solid = {name: np.ascontiguousarray(array) for name, array in sorted(arrays.items())}
    text = json.dumps({"format": FORMAT_VERSION} | dict(metadata), sort_keys=True, allow_nan=False)
    return save(solid, metadata={"hemline": text})


def write_tensors(path: str | Path, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
    """Write arrays and metadata to `path`, whole or not at all.

    Args:
        path: The file to write.
        arrays: Name to array; any layout, made contiguous here.
        metadata: JSON-like values; needs a key `kind`.

    Raises:
        BadOutput: The path cannot be written.
    """
    content = tensor_bytes(arrays, metadata)
    with written_whole(path) as temporary:
        temporary.write_bytes(content)


def read_metadata(
    path: str | Path, kind: str, *, error: type[BadInput] = BadInput, damaged: type[BadInput] | None = None
) -> dict[str, Any]:
    """Read the metadata of a file of the given kind, without its arrays.

    Args:
        path: The file.
        kind: `body`, `motion`, `motions`, `garment`, `take` or `model`.
        error: The class to raise.
        damaged: The class to raise where the file was read and is not whole; None: `error`.

    Raises:
        error: The file is missing, cannot be read, is of another kind or of a future version.
        damaged: It is truncated, or nothing that hemline wrote.
    """
    with _described(path, kind, error, damaged or error) as (metadata, _):
        return metadata


def read_tensors(
    path: str | Path,
    kind: str,
    *,
    error: type[BadInput] = BadInput,
    damaged: type[BadInput] | None = None,
    finite: bool = True,
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Read a file of the given kind: its arrays (writable, C-contiguous) and its metadata.

    No more memory is taken than the arrays need that the file holds.

    Args:
        path: The file.
        kind: As for `read_metadata`.
        error: The class to raise.
        damaged: As for `read_metadata`.
        finite: Refuse NaN and infinity in any array.

    Raises:
        error: As for `read_metadata`, or the arrays are larger than the memory.
        damaged: As for `read_metadata`, or an array holds NaN or infinity.
    """
    damaged = damaged or error
    with _described(path, kind, error, damaged) as (metadata, container):
        try:
            arrays = container.arrays()
        except Untrue as reason:
            raise damaged(f"{path} is damaged", reason, "copy it again from where it was made") from reason
        if finite:
            for name, array in arrays.items():
                if array.dtype.kind == "f" and not np.isfinite(array).all():
                    raise damaged(f"{path}: array '{name}' must be finite", "NaN or infinity", "make the file again")
    return arrays, metadata


def map_tensors(
    path: str | Path, kind: str, *, error: type[BadInput] = BadInput, damaged: type[BadInput] | None = None
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Map a file of the given kind: its arrays, which take memory only as they are looked at, and its metadata.

    The arrays cannot be written to, and whether they are finite is not looked at.

    Args:
        path: The file; it must stay as it is while the arrays are used.
        kind: As for `read_metadata`.
        error: The class to raise.
        damaged: As for `read_metadata`.

    Raises:
        error: As for `read_metadata`.
        damaged: As for `read_metadata`.
    """
    damaged = damaged or error
    with _described(path, kind, error, damaged) as (metadata, container):
        try:
            return container.mapped(Path(path)), metadata
        except Untrue as reason:
            raise damaged(f"{path} is damaged", reason, "copy it again from where it was made") from reason


def content_hash(*parts: np.ndarray | str | bytes | Mapping[str, Any] | None) -> str:
    """A short hash of arrays (with their dtype and shape), text and JSON-like values, in the order given."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).tobytes())
        elif isinstance(part, bytes):
            digest.update(part)
        elif isinstance(part, str):
            digest.update(part.encode())
        else:
            digest.update(json.dumps(part, sort_keys=True, allow_nan=False).encode())
        digest.update(b"\0")
    return digest.hexdigest()[:24]


@contextmanager
def _described(
    path: str | Path, kind: str, error: type[BadInput], damaged: type[BadInput]
) -> Iterator[tuple[dict[str, Any], Container]]:
    """A file whose metadata is read and is of that kind, open where its arrays begin."""
    cure = f"name a {kind} file that hemline wrote (safetensors)"
    try:
        with opened(path, error, cure) as container:
            yield _metadata(path, kind, container, error), container
    except Untrue as reason:
        raise damaged(f"{path} is no hemline {kind} file", reason, cure) from reason


def _metadata(path: str | Path, kind: str, container: Container, error: type[BadInput]) -> dict[str, Any]:
    try:
        metadata = json.loads(container.header["__metadata__"]["hemline"], parse_constant=_no_number)
        found, version = metadata["kind"], metadata["format"]
    except (ValueError, KeyError, TypeError, RecursionError) as reason:
        raise Untrue("bytes without a readable header") from reason
    if type(version) is not int:
        raise Untrue("bytes without a readable header")
    if version > FORMAT_VERSION:
        raise error(
            f"{path} has a newer format", f"version {version}", f"this hemline reads up to {FORMAT_VERSION}; upgrade it"
        )
    if found != kind:
        raise error(
            f"{path} must be a {kind} file", f"a {str(found)[:20]} file", f"name a {kind} file that hemline wrote"
        )
    return metadata


def _no_number(name: str) -> None:
    """Refuse NaN and infinity, which `write_tensors` never writes."""
    raise ValueError(name)

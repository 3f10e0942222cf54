"""Arrays and metadata in one safetensors file: bodies, motions, garments, takes, models.

The file's metadata has one key, `hemline`, that holds JSON with sorted keys, so that equal content gives equal bytes.
`docs/format.md` specifies the JSON for each kind of file.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadInput

from .atomic import atomic_write
from .container import Container, InvalidContainer, open_container

FORMAT_VERSION = 1
"""Version of the container; a file with a higher one is refused."""


def tensor_bytes(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> bytes:
    """Returns the exact bytes that `write_tensors` writes."""
    from safetensors.numpy import save

    # safetensors writes wrong values for arrays that are not C-contiguous, without an error
    solid = {name: np.ascontiguousarray(array) for name, array in sorted(arrays.items())}
    text = json.dumps({"format": FORMAT_VERSION} | dict(metadata), sort_keys=True, allow_nan=False)
    return save(solid, metadata={"hemline": text})


def write_tensors(path: str | Path, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
    """Writes arrays and metadata to `path` atomically.

    Args:
        path: The file to write.
        arrays: Arrays by name, in any memory layout.
        metadata: JSON-like values; needs a key `kind`.

    Raises:
        BadOutput: The path cannot be written.
    """
    content = tensor_bytes(arrays, metadata)
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)


def read_metadata(
    path: str | Path, kind: str, *, error: type[BadInput] = BadInput, damaged: type[BadInput] | None = None
) -> dict[str, Any]:
    """Reads the metadata of a file of the given kind, without its arrays.

    Args:
        path: The file.
        kind: `body`, `motion`, `motions`, `garment`, `take` or `model`.
        error: Class of the exception.
        damaged: Class of the exception if the file was read and is incomplete; None: `error`.

    Raises:
        error: The file is missing, cannot be read, is of another kind or of a future version.
        damaged: The file is truncated, or was not written by hemline.
    """
    with _open_tensors(path, kind, error, damaged or error) as (metadata, _):
        return metadata


def read_tensors(
    path: str | Path,
    kind: str,
    *,
    error: type[BadInput] = BadInput,
    damaged: type[BadInput] | None = None,
    finite: bool = True,
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Reads the arrays (writable, C-contiguous) and the metadata of a file of the given kind.

    It takes no more memory than the arrays need.

    Args:
        path: The file.
        kind: See `read_metadata`.
        error: Class of the exception.
        damaged: See `read_metadata`.
        finite: Whether NaN and infinity in any array are refused.

    Raises:
        error: See `read_metadata`; or the arrays are larger than the memory.
        damaged: See `read_metadata`; or an array holds NaN or infinity.
    """
    damaged = damaged or error
    with _open_tensors(path, kind, error, damaged) as (metadata, container):
        try:
            arrays = container.arrays()
        except InvalidContainer as reason:
            raise damaged(f"{path} is damaged", reason, "copy it again from where it was made") from reason
        if finite:
            for name, array in arrays.items():
                if array.dtype.kind == "f" and not np.isfinite(array).all():
                    raise damaged(f"{path}: array '{name}' must be finite", "NaN or infinity", "make the file again")
    return arrays, metadata


def map_tensors(
    path: str | Path, kind: str, *, error: type[BadInput] = BadInput, damaged: type[BadInput] | None = None
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Maps the arrays of a file of the given kind, which take memory only when accessed, and reads its metadata.

    The arrays are read-only, and are not checked for NaN or infinity.

    Args:
        path: The file; it must not change while the arrays are in use.
        kind: See `read_metadata`.
        error: Class of the exception.
        damaged: See `read_metadata`.

    Raises:
        error: See `read_metadata`.
        damaged: See `read_metadata`.
    """
    damaged = damaged or error
    with _open_tensors(path, kind, error, damaged) as (metadata, container):
        try:
            return container.map_arrays(Path(path)), metadata
        except InvalidContainer as reason:
            raise damaged(f"{path} is damaged", reason, "copy it again from where it was made") from reason


def content_hash(*parts: np.ndarray | str | bytes | Mapping[str, Any] | None) -> str:
    """Returns a short hash of arrays (with their dtype and shape), text and JSON-like values, in the order given."""
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
def _open_tensors(
    path: str | Path, kind: str, error: type[BadInput], damaged: type[BadInput]
) -> Iterator[tuple[dict[str, Any], Container]]:
    """Opens a file of a kind; yields its metadata, and the file positioned at its arrays."""
    cure = f"name a {kind} file that hemline wrote (safetensors)"
    try:
        with open_container(path, error, cure) as container:
            yield _metadata(path, kind, container, error), container
    except InvalidContainer as reason:
        raise damaged(f"{path} is no hemline {kind} file", reason, cure) from reason


def _metadata(path: str | Path, kind: str, container: Container, error: type[BadInput]) -> dict[str, Any]:
    try:
        metadata = json.loads(container.header["__metadata__"]["hemline"], parse_constant=_no_number)
        found, version = metadata["kind"], metadata["format"]
    except (ValueError, KeyError, TypeError, RecursionError) as reason:
        raise InvalidContainer("bytes without a readable header") from reason
    if type(version) is not int:
        raise InvalidContainer("bytes without a readable header")
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
    """Raises for NaN and infinity, which `write_tensors` never writes."""
    raise ValueError(name)

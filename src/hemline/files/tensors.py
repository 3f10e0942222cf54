"""Arrays and metadata in one safetensors file: bodies, motions, garments, takes, models.

The file's metadata has one key, `hemline`, that holds JSON with sorted keys, so that equal content gives equal bytes.
What the JSON must hold for each kind of file is specified in `docs/format.md`.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hemline.errors import BadInput

from .atomic import written_whole

FORMAT_VERSION = 1
"""Version of the container; a file with a higher one is refused."""

_LARGEST_HEADER = 100_000_000


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


def read_metadata(path: str | Path, kind: str, *, error: type[BadInput] = BadInput) -> dict[str, Any]:
    """Read the metadata of a file of the given kind, without its arrays.

    Args:
        path: The file.
        kind: `body`, `motion`, `motions`, `garment`, `take` or `model`.
        error: The class to raise.

    Raises:
        error: The file is missing, truncated, of another kind or of a future version.
    """
    return _open(path, kind, error, whole=False)[0]


def read_tensors(
    path: str | Path, kind: str, *, error: type[BadInput] = BadInput, finite: bool = True
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Read a file of the given kind: its arrays (writable, C-contiguous) and its metadata.

    Args:
        path: The file.
        kind: As for `read_metadata`.
        error: The class to raise.
        finite: Refuse NaN and infinity in any array.

    Raises:
        error: As for `read_metadata`, or an array holds NaN or infinity.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    metadata, content = _open(path, kind, error, whole=True)
    try:
        arrays = {name: np.array(array) for name, array in load(content).items()}
    except (SafetensorError, ValueError, KeyError) as reason:
        got = "arrays that do not fill it as its header says"
        raise error(f"{path} is damaged", got, "copy it again from where it was made") from reason
    if finite:
        for name, array in arrays.items():
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                raise error(f"{path}: array '{name}' must be finite", "NaN or infinity", "make the file again")
    return arrays, metadata


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


def _open(path: str | Path, kind: str, error: type[BadInput], *, whole: bool) -> tuple[dict[str, Any], bytes]:
    path = Path(path)
    cure = f"name a {kind} file that hemline wrote (safetensors)"
    try:
        with path.open("rb") as stream:
            length = path.stat().st_size
            content = stream.read(8)
            size = int.from_bytes(content, "little")
            has_header = len(content) == 8 and 2 <= size <= min(length - 8, _LARGEST_HEADER)
            content += stream.read() if whole else stream.read(size) if has_header else b""
    except OSError as reason:
        raise error(f"cannot read {path}", reason.strerror or reason, cure) from reason
    try:
        if not has_header:
            raise ValueError("no safetensors header")
        header = json.loads(content[8 : 8 + size])
        metadata = json.loads(header["__metadata__"]["hemline"])
        found, version = metadata["kind"], metadata["format"]
        if not isinstance(version, int):
            raise ValueError("format version is no number")
    except (ValueError, KeyError, TypeError, RecursionError) as reason:
        raise error(f"{path} is no hemline {kind} file", _what_it_is(content), cure) from reason
    if version > FORMAT_VERSION:
        raise error(
            f"{path} has a newer format", f"version {version}", f"this hemline reads up to {FORMAT_VERSION}; upgrade it"
        )
    if found != kind:
        raise error(f"{path} must be a {kind} file", f"a {found} file", cure)
    return metadata, content


def _what_it_is(content: bytes) -> str:
    if not content:
        return "an empty file"
    if content[:2] in (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"):
        return "a pickle, which is never read"
    if content[:2] == b"PK":
        return "a zip archive (npz, or a torch file)"
    return "bytes without a readable header"

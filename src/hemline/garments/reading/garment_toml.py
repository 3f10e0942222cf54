"""Reads the small TOML file beside a garment's mesh, which people write by hand."""

import re
import tomllib
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from hemline.errors import BadGarment
from hemline.files import read_text
from hemline.files.beside import beside
from hemline.garments.pin_rules import PinGroup, PinRule, is_ids
from hemline.garments.quote import quote

from .file_parts import split_part

_CURE = "write it as in docs/wardrobe.md: key = value"
_BYTES_MAX = 2**22
_DOTS_MAX = 32
"""Largest number of dots in a line: for a key of many parts the parser keeps each beginning, which takes memory."""
_BITS_MAX = 63


@dataclass(frozen=True)
class GarmentFile:
    """Content of a garment's TOML. Everything but `mesh` may be omitted and is then guessed."""

    mesh: str = ""
    """Mesh file, relative to the TOML; `FILE:NAME` is one part of it."""
    name: str | None = None
    """Name of the garment; the file's stem unless given."""
    unit: str | None = None
    """Unit of the mesh: m, dm, cm, mm, in, ft."""
    up: str | None = None
    """Axis that points up in the mesh: y or z; guessed unless given."""
    origin: str | None = None
    """Where the mesh has its origin: pelvis (of the body at rest) or floor (between its soles)."""
    body: str | None = None
    """Name of the body it was made on."""
    betas: tuple[float, ...] | None = None
    """Shape of that body."""
    material: str | dict[str, Any] | None = None
    """A fabric by name, or a table of constants, perhaps with a `base`."""
    pins: PinRule = None
    """Vertex ids, or a rule: top_rim, boundary:N (the rims by length), above:HEIGHT (metres above the pelvis),
    group:NAME or colour:NAME (vertices that the file marks so), none; or tables of `vertices` (one of these), `to`
    (surface or a joint), `stiffness` (N/m a vertex; left out: hard)."""
    chains: tuple[tuple[int, ...], ...] = ()
    """Rope chains, vertex ids from root to tip."""
    key_joint: str | None = None
    """The joint whose frame carries the garment."""
    pattern: bool | None = None
    """Whether the mesh's texture coordinates are its flat pattern, in its unit."""
    flat_rest: bool | None = None
    """Whether the cloth is flat when nothing bends it."""


def read_garment_toml(path: str | Path) -> GarmentFile:
    """Reads a garment's TOML.

    Args:
        path: The file.

    Returns:
        The content, with tuples for lists.

    Raises:
        BadGarment: The file is missing, too large or no TOML, a key is unknown, a value is of the wrong kind, or the
            mesh is not beside it.
    """
    path = Path(path)
    content = _content(path)
    known = [field.name for field in fields(GarmentFile)]
    for key, value in content.items():
        if key not in known:
            near = get_close_matches(key[:60], known, 1, 0.0)[0]
            raise BadGarment(f"{path}: unknown key '{key[:60]}'", quote(value), f"did you mean '{near}'")
        if not _fits(key, value):
            raise BadGarment(f"{path}: '{key}' must be {_KINDS[key]}", quote(value), "correct it")
    if not content.get("mesh"):
        raise BadGarment(f"{path} must name its mesh", "no key 'mesh'", "add: mesh = 'file.obj'")
    file = str(split_part(content["mesh"])[0])
    beside(path, file, "a mesh", error=BadGarment, cure="put the mesh into the folder of the TOML, or below")
    if _is_tables(content.get("pins")):
        content["pins"] = [PinGroup.of(table) for table in content["pins"]]
    return GarmentFile(**{key: _tuples(value) for key, value in content.items()})


def _content(path: Path) -> dict[str, Any]:
    """Returns the keys and values of a TOML file."""
    try:
        text = read_text(
            path,
            _BYTES_MAX,
            error=BadGarment,
            cure="name a TOML file that exists",
            encoding="utf-8",
            strict=True,
        )
    except UnicodeDecodeError as error:
        raise BadGarment(f"{path} is no TOML", "bytes that are no text", _CURE) from error
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > _DOTS_MAX:
            got = f"line {number}, with {line.count('.')} dots"
            raise BadGarment(f"{path} is no TOML of a garment", got, "cut that line into several")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadGarment(f"{path} is no TOML", _where(str(error), text), _CURE) from error
    except RecursionError as error:
        raise BadGarment(f"{path} is no TOML", "tables or lists nested far too deep", _CURE) from error
    except ValueError as error:  # a number with too many digits for Python, or a day that does not exist
        raise BadGarment(f"{path} is no TOML", "a number or a date that cannot be", _CURE) from error
    pending = [content]
    while pending:
        value = pending.pop()
        if isinstance(value, int) and value.bit_length() > _BITS_MAX:
            raise BadGarment(f"{path} is no TOML", f"a whole number of more than {_BITS_MAX} bits", _CURE)
        pending += value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return content


def _where(message: str, text: str) -> str:
    """Returns the wrong line, from the message of the parser."""
    match = re.search(r"at line (\d+)", message)
    if match is None:
        return "a table, list or text that does not end"
    return f"line {match[1]}: '{text.splitlines()[int(match[1]) - 1].strip()[:60]}'"


_KINDS = {
    "mesh": "text",
    "name": "text",
    "unit": "text",
    "up": "'y' or 'z'",
    "origin": "'pelvis' or 'floor'",
    "body": "text",
    "betas": "a list of numbers",
    "material": "a name or a table",
    "pins": "a list of vertex ids or a rule, or tables of them",
    "chains": "a list of lists of vertex ids",
    "key_joint": "text",
    "pattern": "true or false",
    "flat_rest": "true or false",
}


def _fits(key: str, value: Any) -> bool:
    if key == "up":
        return value in ("y", "z")
    if key == "origin":
        return value in ("pelvis", "floor")
    if key in ("pattern", "flat_rest"):
        return isinstance(value, bool)
    if key == "betas":
        return isinstance(value, list) and all(
            isinstance(each, int | float) and not isinstance(each, bool) for each in value
        )
    if key == "material":
        return isinstance(value, str | dict)
    if key == "pins":
        return isinstance(value, str) or is_ids(value) or _is_tables(value)
    if key == "chains":
        return isinstance(value, list) and all(is_ids(each) for each in value)
    return isinstance(value, str)


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, dict) for each in value)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value

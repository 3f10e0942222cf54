"""The list, among the parts of a page in a folder, of what hemline wrote: its bytes, and nothing else, are ours.

A list may come from a stranger, with the folder that it lies in. So it is believed only in what cannot harm: names
without a way out of its own folder, and there only files that have the very bytes that it names.
"""

import json
import os
import re
import stat
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any

from .assemble import PARTS_PREFIX, FolderPage

INDEX = "index.html"
LIST = "page.json"
"""Name of the list among the parts."""
_KIND = "hemline page"
_LONGEST = 1_000_000
_PLACE = re.compile(PARTS_PREFIX + "[0-9a-f]{12}")
_PART = re.compile(r"(?:[A-Za-z0-9_]+/)?[A-Za-z0-9_][A-Za-z0-9_.]*")


@dataclass(frozen=True)
class FileList:
    """What was written.

    Attributes:
        index: SHA-256 of `index.html`.
        parts: SHA-256 of each part, by its path in the folder of the parts.
    """

    index: str
    parts: Mapping[str, str]

    @classmethod
    def of(cls, page: FolderPage) -> "WrittenList":
        """The list of a page that is about to be written."""
        parts = {name: sha256(content).hexdigest() for name, content in page.parts.items()}
        return cls(sha256(page.index).hexdigest(), parts)

    @classmethod
    def read(cls, place: Path) -> "WrittenList | None":
        """The list in a folder of parts; None: there is none that can be believed."""
        try:
            if not is_file(place / LIST) or (place / LIST).stat().st_size > _LONGEST:
                return None
            told: Any = json.loads((place / LIST).read_bytes())
            index, parts = (told["index"], told["parts"]) if told["kind"] == _KIND else (None, None)
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        if not isinstance(index, str) or not isinstance(parts, dict) or not all(map(_PART.fullmatch, parts)):
            return None
        return cls(index, parts)

    def as_bytes(self) -> bytes:
        """Content of the file."""
        told = {"kind": _KIND, "index": self.index, "parts": dict(self.parts)}
        return (json.dumps(told, indent=1, sort_keys=True) + "\n").encode()


def part_folders(folder: Path) -> dict[Path, FileList]:
    """Folders of parts beside an index, with their lists; links are none."""
    found = {}
    for each in folder.iterdir():
        if _PLACE.fullmatch(each.name) and not each.is_symlink() and each.is_dir():
            listed = FileList.read(each)
            if listed is not None:
                found[each] = listed
    return found


def is_our_index(folder: Path) -> bool:
    """Whether `index.html` is to the byte one that a list in the folder names."""
    index = folder / INDEX
    return is_file(index) and hash_of(index) in {each.index for each in part_folders(folder).values()}


def remove_listed(place: Path, listed: FileList) -> None:
    """Remove of a folder of parts what is listed and unchanged, then folders that are empty; the list itself last."""
    for name, digest in listed.parts.items():
        part = place / name
        if not part.parent.is_symlink() and is_file(part) and hash_of(part) == digest:
            part.unlink()
    for name in {name.split("/")[0] for name in listed.parts if "/" in name}:
        with suppress(OSError):
            (place / name).rmdir()
    if os.listdir(place) == [LIST]:
        (place / LIST).unlink()
    with suppress(OSError):
        place.rmdir()


def is_file(path: Path) -> bool:
    """Whether a regular file lies there, not by way of a link."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def hash_of(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with path.open("rb") as stream:
        return file_digest(stream, "sha256").hexdigest()

"""The list of files that hemline wrote, stored among the parts of a page in a folder.

A list may come from a stranger, together with its folder. So it is trusted only where it can do no harm: for names
inside its own folder, and for files whose contents match their hash in the list.
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
    """Hashes of the files of a page.

    Attributes:
        index: SHA-256 of `index.html`.
        parts: SHA-256 of each part, by its path in the folder of the parts.
    """

    index: str
    parts: Mapping[str, str]

    @classmethod
    def of(cls, page: FolderPage) -> "FileList":
        """Returns the list of a page that is about to be written."""
        parts = {name: sha256(content).hexdigest() for name, content in page.parts.items()}
        return cls(sha256(page.index).hexdigest(), parts)

    @classmethod
    def read(cls, place: Path) -> "FileList | None":
        """Reads the list in a folder of parts; returns None if there is no valid list."""
        try:
            if not is_file(place / LIST) or (place / LIST).stat().st_size > _LONGEST:
                return None
            entries: Any = json.loads((place / LIST).read_bytes())
            index, parts = (entries["index"], entries["parts"]) if entries["kind"] == _KIND else (None, None)
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        if not isinstance(index, str) or not isinstance(parts, dict) or not all(map(_PART.fullmatch, parts)):
            return None
        return cls(index, parts)

    def as_bytes(self) -> bytes:
        """Returns the content of the file."""
        entries = {"kind": _KIND, "index": self.index, "parts": dict(self.parts)}
        return (json.dumps(entries, indent=1, sort_keys=True) + "\n").encode()


def part_folders(folder: Path) -> dict[Path, FileList]:
    """Returns the folders of parts beside an index, with their lists; links are ignored."""
    folders = {}
    for each in folder.iterdir():
        if _PLACE.fullmatch(each.name) and not each.is_symlink() and each.is_dir():
            listed = FileList.read(each)
            if listed is not None:
                folders[each] = listed
    return folders


def is_our_index(folder: Path) -> bool:
    """Whether the bytes of `index.html` match a list in the folder."""
    index = folder / INDEX
    return is_file(index) and hash_of(index) in {each.index for each in part_folders(folder).values()}


def remove_listed(place: Path, listed: FileList) -> None:
    """Removes listed and unchanged files from a folder of parts, then empty folders, and the list last."""
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
    """Whether a path is a regular file, not a link."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def hash_of(path: Path) -> str:
    """Returns the SHA-256 of a file in hexadecimal digits."""
    with path.open("rb") as stream:
        return file_digest(stream, "sha256").hexdigest()

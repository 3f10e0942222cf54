"""Pairs of clips of one motion that can be shown side by side, from two files or two folders."""

import hashlib
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hemline.errors import BadInput, HemlineWarning

from .answers import check_cell
from .clip_files import KINDS, measure_clip

Side = Literal["A", "B"]


@dataclass(frozen=True)
class Pair:
    """Two clips of one motion.

    Args:
        name: Name of the pair, unique in a study.
        a: Path of one clip.
        b: Path of the other, of the same kind, size, length and number of repeats.
        contents: Hash of both files, `sha256:` and 12 digits.
    """

    name: str
    a: Path
    b: Path
    contents: str

    def read(self, side: Side) -> bytes:
        """Returns the bytes of one clip.

        Raises:
            BadInput: One of both files cannot be read, or has changed since they were paired.
        """
        both = {"A": _read(self.a), "B": _read(self.b)}
        if _contents(both.values()) != self.contents:
            cure = "put the clips back as they were, or compare the new ones into another file"
            raise BadInput(f"the clips of the pair '{self.name}' have changed", f"{self.a} and {self.b}", cure)
        return both[side]


def pairs_of(paths: Sequence[str | Path]) -> tuple[Pair, ...]:
    """Pairs clips and checks that each pair can be shown side by side.

    Args:
        paths: Paths in twos, A and B. Two files are one pair. Two folders are one pair per common file name; other
            clips are skipped with a `HemlineWarning`.

    Raises:
        BadInput: The number of paths is odd; a file is missing, or browsers cannot play it; folders have no common
            name; kinds, sizes, lengths or repeats of a pair differ; two pairs have one name; or a name would be a
            formula in a spreadsheet.
    """
    if not paths or len(paths) % 2:
        raise BadInput("clips are compared in twos", f"{len(paths)} paths", "name A and B, two files or two folders")
    twos = [(Path(a), Path(b)) for a, b in zip(paths[::2], paths[1::2], strict=True)]
    pairs = [_make_pair(*two) for a, b in twos for two in _files_of(a, b)]
    names = [pair.name for pair in pairs]
    for name in names:
        if names.count(name) > 1:
            got = " and ".join(str(pair.a) for pair in pairs if pair.name == name)
            raise BadInput(f"two pairs have the name '{name}'", got, "rename the clips of one of them")
    return tuple(pairs)


def _files_of(a: Path, b: Path) -> list[tuple[Path, Path]]:
    for path in (a, b):
        _check_name(path)
        if not path.exists():
            raise BadInput(f"cannot read {path}", "No such file or directory", "name a clip, or a folder of clips")
    if a.is_dir() != b.is_dir():
        got = f"{a if a.is_dir() else b}, a folder, with a file"
        raise BadInput("A and B must be two clips or two folders", got, "name two of the same sort")
    if not a.is_dir():
        return [(a, b)]
    inside = [_clips_in(folder) for folder in (a, b)]
    if not inside[0] & inside[1]:
        got = " and ".join(", ".join(sorted(names)[:3]) or "no clips" for names in inside)
        raise BadInput(f"{a} and {b} have no clips of the same names", got, f"name them alike, {', '.join(KINDS)}")
    if alone := sorted(inside[0] ^ inside[1]):
        cure = "add the other clip to compare it"
        warnings.warn(
            HemlineWarning("clips are left out that only one folder has", ", ".join(alone), cure), stacklevel=3
        )
    return [(a / name, b / name) for name in sorted(inside[0] & inside[1])]


def _clips_in(folder: Path) -> set[str]:
    try:
        names = {path.name for path in folder.iterdir() if path.suffix.lower() in KINDS}
    except OSError as reason:
        raise BadInput(f"cannot read {folder}", reason.strerror or reason, "name a folder that can be read") from reason
    return {name for name in names if not name.startswith(".")}


def _check_name(path: Path) -> None:
    if not str(path).isprintable():
        raise BadInput("a path of a clip must be one line of text", repr(str(path)), "rename it")
    for what, text in (("a path of a clip", str(path)), ("the name of a clip", path.name)):
        check_cell(what, text)


def _make_pair(a: Path, b: Path) -> Pair:
    for path in (a, b):
        _check_name(path)
    contents = [_read(path) for path in (a, b)]
    measures = [measure_clip(path, content) for path, content in zip((a, b), contents, strict=True)]
    kinds = [path.suffix.lower() for path in (a, b)]
    if kinds[0] != kinds[1]:
        raise BadInput(f"{a} and {b} must be of one kind", " and ".join(kinds), "write both in the same format")
    for what, of_a in measures[0].items():
        if of_a != measures[1][what]:
            got = f"{of_a} and {measures[1][what]}"
            raise BadInput(f"{a} and {b} must have the same {what}", got, "make both from one motion, in the same way")
    name = a.stem if a.stem == b.stem else f"{a.stem} vs {b.stem}"
    return Pair(name, a, b, _contents(contents))


def _contents(clips: Iterable[bytes]) -> str:
    digests = b"".join(hashlib.sha256(clip).digest() for clip in clips)
    return f"sha256:{hashlib.sha256(digests).hexdigest()[:12]}"


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as reason:
        raise BadInput(f"cannot read {path}", reason.strerror or reason, "name a clip that can be read") from reason

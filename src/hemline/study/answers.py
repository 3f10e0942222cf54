"""Answers of people, in a CSV to which rows are appended whole."""

import csv
import io
import math
import re
import unicodedata
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from hemline.errors import BadAnswer, BadInput

from .appending import open_locked


@dataclass(frozen=True)
class Answer:
    """One row of the CSV, a column for each field.

    Args:
        participant: Their code, in capitals.
        pair: The pair's name.
        question: What was asked.
        a: Path of clip A, as it was given.
        b: Path of clip B.
        left: `A` or `B`, whichever was on the left.
        preference: From 1, A is much better, to 7, B is much better; 4: no preference.
        seconds: From when the question was seen, both clips playing, to its answer [s].
        time: When it was answered (ISO 8601, UTC).
        seed: The seed of the order.
        clips: A hash of both clips, `sha256:` and 12 digits. It stands last so that a row that was cut off is known.
    """

    participant: str
    pair: str
    question: str
    a: str
    b: str
    left: str
    preference: int
    seconds: float
    time: str
    seed: int
    clips: str

    @property
    def asked(self) -> tuple[str, str, str]:
        """Participant, pair and question, which only one row of a file has."""
        return self.participant, self.pair, self.question


POINTS = 7
"""Points of the scale."""
NEUTRAL = 4
"""No preference."""
COLUMNS = tuple(field.name for field in fields(Answer))
_REMOVE = "mend that row, or remove it"
_CODE = re.compile(r"\w[\w.-]{0,39}")
_CLIPS = re.compile(r"sha256:[0-9a-f]{12}")
_FORMULA = tuple("=+-@\t\r\n\uff1d\uff0b\uff0d\uff20")
"""With these letters, of which the last four are wide ones, spreadsheets let a formula begin."""


def normalise_code(participant: Any) -> str:
    """A participant's code in capitals, without blanks around it: `p1` is the `P1` who comes back.

    Raises:
        BadAnswer: It is not 1 to 40 letters, digits, dots, dashes and underscores that begin with a letter or digit.
    """
    code = unicodedata.normalize("NFC", participant.strip()).upper() if isinstance(participant, str) else ""
    if not _CODE.fullmatch(code):
        cure = "use 1 to 40 letters, digits, dots, dashes or underscores, the first no dot or dash"
        raise BadAnswer("that is no participant code", repr(participant)[:60], cure)
    return code


def check_cell(what: str, text: str) -> None:
    """Refuse what a spreadsheet would take for a formula when the CSV is opened: such a cell can run programs.

    Args:
        what: What the text is.
        text: What would be written.

    Raises:
        BadInput: It begins as a formula does.
    """
    if text.lstrip(" ").startswith(_FORMULA):
        cure = "begin it with a letter, or a digit"
        raise BadInput(f"{what} would be a formula in a spreadsheet", repr(text)[:80], cure)


def read_answers(path: str | Path) -> list[Answer]:
    """All answers of a file. A last row that was cut off while it was written was never counted, and is left out.

    Args:
        path: A CSV that `hemline compare` wrote.

    Raises:
        BadInput: It cannot be read, is no CSV of answers, or holds a row that is none or an answer given twice.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as reason:
        cure = "name a CSV that 'hemline compare A B --blind' wrote"
        raise BadInput(f"cannot read {path}", reason.strerror or reason, cure) from reason
    return _parse(path, content)[0]


def add_answer(path: str | Path, answer: Answer, allowed: Callable[[list[Answer]], None]) -> None:
    """Append a row, or nothing: other threads and processes wait, and what cannot be written whole is taken back.

    Args:
        path: The CSV; it is made where there is none.
        answer: The row.
        allowed: Called with the rows that are there; what it raises goes on, and nothing is written.

    Raises:
        BadInput: As `read_answers`.
        BadOutput: The file cannot be written.
    """
    with open_locked(path) as file:
        answers, whole = _parse(path, file.content)
        allowed(answers)
        before = _line(COLUMNS) if whole == 0 else b"" if file.content[whole - 1 : whole] == b"\n" else b"\n"
        file.append(whole, before + _line(asdict(answer).values()))


def _line(cells: Iterable[object]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


def _parse(path: str | Path, content: bytes) -> tuple[list[Answer], int]:
    """Answers, and how many bytes hold them whole."""
    end = content.rfind(b"\n") + 1
    lines = _lines(path, content[:end])
    rest = _lines(path, content[end:].decode(errors="replace").encode())
    if rest and _is_whole(rest[0], is_first=not lines):
        lines, end = lines + rest, len(content)
    if lines and lines[0] != [*COLUMNS]:
        cure = "name another file, or one that 'hemline compare A B --blind' wrote"
        raise BadInput(f"{path} is no CSV of answers", f"the first line '{','.join(lines[0])[:80]}'", cure)
    answers = [_answer(path, number, cells) for number, cells in enumerate(lines[1:], 2)]
    seen: set[tuple[str, str, str]] = set()
    for number, answer in enumerate(answers, 2):
        if answer.asked in seen:
            got = ", ".join(answer.asked)
            raise BadInput(f"{path}, row {number} answers again what an earlier row does", got, _REMOVE)
        seen.add(answer.asked)
    return answers, end


def _is_whole(cells: list[str], *, is_first: bool) -> bool:
    """Whether a last line, which lacks its end, lacks nothing else."""
    if is_first:
        return cells == [*COLUMNS] or not _line(COLUMNS).startswith(_line(cells).rstrip())
    return len(cells) == len(COLUMNS) and _CLIPS.fullmatch(cells[-1]) is not None


def _lines(path: str | Path, content: bytes) -> list[list[str]]:
    try:
        return [cells for cells in csv.reader(io.StringIO(content.decode("utf-8-sig"), newline="")) if cells]
    except (UnicodeDecodeError, csv.Error) as reason:
        cure = "name another file, or save it as UTF-8 with commas"
        raise BadInput(f"{path} is no CSV of answers", reason, cure) from reason


def _answer(path: str | Path, number: int, cells: list[str]) -> Answer:
    """One row, its numbers as numbers."""
    try:
        row = dict(zip(COLUMNS, cells, strict=True))
        numbers = {"preference": int(row["preference"]), "seconds": float(row["seconds"]), "seed": int(row["seed"])}
        answer = Answer(**(row | numbers))  # type: ignore[arg-type]
        good = 1 <= answer.preference <= POINTS and math.isfinite(answer.seconds) and answer.left in ("A", "B")
        if not good or not _CODE.fullmatch(answer.participant) or not _CLIPS.fullmatch(answer.clips):
            raise ValueError("a value out of its range")
    except ValueError as reason:
        raise BadInput(f"{path}, row {number} is no answer", ",".join(cells)[:120], _REMOVE) from reason
    return answer

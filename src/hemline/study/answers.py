"""Answers of participants in a CSV, to which rows are appended whole."""

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
    """One row of the CSV, with a column for each field.

    Args:
        participant: Code of the participant, in capitals.
        pair: Name of the pair.
        question: The question.
        a: Path of clip A, as it was given.
        b: Path of clip B.
        left: The clip on the left, `A` or `B`.
        preference: Answer from 1, A is much better, to 7, B is much better; 4 is no preference.
        seconds: Time from the question with both clips playing to the answer [s].
        time: Time of the answer (ISO 8601, UTC).
        seed: Seed of the order.
        clips: Hash of both clips, `sha256:` and 12 digits. It is the last column, so that truncated rows are noticed.
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
    def key(self) -> tuple[str, str, str]:
        """Participant, pair and question, unique among the rows of a file."""
        return self.participant, self.pair, self.question


POINTS = 7
"""Number of points of the scale."""
NEUTRAL = 4
"""Point that means no preference."""
COLUMNS = tuple(field.name for field in fields(Answer))
_REMOVE = "mend that row, or remove it"
_CODE = re.compile(r"\w[\w.-]{0,39}")
_CLIPS = re.compile(r"sha256:[0-9a-f]{12}")
_FORMULA = tuple("=+-@\t\r\n\uff1d\uff0b\uff0d\uff20")
"""Characters with which a formula begins in spreadsheets; the last four are full-width ones."""


def normalise_code(participant: Any) -> str:
    """Returns the code of a participant in capitals, without surrounding blanks, so that `p1` is `P1`.

    Raises:
        BadAnswer: It is not 1 to 40 letters, digits, dots, dashes and underscores, starting with a letter or digit.
    """
    code = unicodedata.normalize("NFC", participant.strip()).upper() if isinstance(participant, str) else ""
    if not _CODE.fullmatch(code):
        cure = "use 1 to 40 letters, digits, dots, dashes or underscores, the first no dot or dash"
        raise BadAnswer("that is no participant code", repr(participant)[:60], cure)
    return code


def check_cell(what: str, text: str) -> None:
    """Refuses text that a spreadsheet would treat as a formula, since such a cell can run programs.

    Args:
        what: Name of the text in the error.
        text: The text.

    Raises:
        BadInput: The text begins like a formula.
    """
    if text.lstrip(" ").startswith(_FORMULA):
        cure = "begin it with a letter, or a digit"
        raise BadInput(f"{what} would be a formula in a spreadsheet", repr(text)[:80], cure)


def read_answers(path: str | Path) -> list[Answer]:
    """Reads all answers of a file; a truncated last row, whose writing was interrupted, is skipped.

    Args:
        path: A CSV that `hemline compare` wrote.

    Raises:
        BadInput: The file cannot be read, is no CSV of answers, or contains an invalid row or an answer twice.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as reason:
        cure = "name a CSV that 'hemline compare A B --blind' wrote"
        raise BadInput(f"cannot read {path}", reason.strerror or reason, cure) from reason
    return _parse(path, content)[0]


def add_answer(path: str | Path, answer: Answer, check: Callable[[list[Answer]], None]) -> None:
    """Appends a row whole or not at all, while other threads and processes wait.

    Args:
        path: Path of the CSV, which is made if missing.
        answer: The row.
        check: Called with the present rows; if it raises, nothing is written.

    Raises:
        BadInput: See `read_answers`.
        BadOutput: The file cannot be written.
    """
    with open_locked(path) as file:
        answers, whole = _parse(path, file.content)
        check(answers)
        before = _line(COLUMNS) if whole == 0 else b"" if file.content[whole - 1 : whole] == b"\n" else b"\n"
        file.append(whole, before + _line(asdict(answer).values()))


def _line(cells: Iterable[object]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


def _parse(path: str | Path, content: bytes) -> tuple[list[Answer], int]:
    """Returns the answers, and the number of bytes of their complete rows."""
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
        if answer.key in seen:
            got = ", ".join(answer.key)
            raise BadInput(f"{path}, row {number} answers again what an earlier row does", got, _REMOVE)
        seen.add(answer.key)
    return answers, end


def _is_whole(cells: list[str], *, is_first: bool) -> bool:
    """Whether a last line without a line break is otherwise complete."""
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
    """Returns one row as an `Answer`."""
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

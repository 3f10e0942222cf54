"""The CSV: rows are there whole or not at all, whoever writes at the same time and wherever it breaks off."""

import csv
import subprocess
import sys
from dataclasses import astuple
from multiprocessing import get_context
from pathlib import Path

import pytest

from hemline.errors import BadInput, BadOutput
from hemline.study import read_answers
from hemline.study.answers import COLUMNS, add_answer
from tests.study.study_samples import answer


def anything(answers) -> None:
    """Allow any row."""


def test_rows_come_back_as_they_were_written(tmp_path):
    path = tmp_path / "answers.csv"
    rows = [answer(), answer(participant="Zoë.2", preference=7, seconds=0.001), answer(question="Is a, b?")]
    for row in rows:
        add_answer(path, row, anything)
    assert read_answers(path) == rows
    with path.open(newline="") as stream:
        lines = list(csv.reader(stream))
    assert lines[0] == [*COLUMNS]
    assert [tuple(line) for line in lines[1:]] == [tuple(map(str, astuple(row))) for row in rows]


def test_a_row_that_was_cut_off_anywhere_is_not_there(tmp_path):
    path = tmp_path / "answers.csv"
    for person in ("P1", "Zoë"):
        add_answer(path, answer(participant=person), anything)
    content = path.read_bytes()
    for kept in range(len(content)):
        path.write_bytes(content[:kept])
        whole = max(content[:kept].count(b"\n") - 1, 0)
        there = [each.participant for each in read_answers(path)]
        complete = kept + 1 in {content.find(b"\n", at) + 1 for at in range(len(content))} and kept > content.find(
            b"\n"
        )
        assert there == ["P1", "Zoë"][: whole + complete]
        add_answer(path, answer(participant="P3"), anything)
        assert [each.participant for each in read_answers(path)] == [*there, "P3"]
        assert path.read_bytes().count(b"\n") == len(there) + 2


def add_some(path: Path, people: list[str]) -> int:
    """Answer for some people; how many answers were taken."""

    def once(answers) -> None:
        if any(each.participant == person for each in answers):
            raise BadInput("twice", person, "no")

    taken = 0
    for person in people:
        try:
            add_answer(path, answer(participant=person), once)
            taken += 1
        except BadInput:
            continue
    return taken


def test_processes_that_write_at_once_lose_nothing_and_repeat_nothing(tmp_path):
    path, people = tmp_path / "answers.csv", [f"P{number}" for number in range(40)]
    with get_context("spawn").Pool(4) as pool:
        taken = pool.starmap(add_some, [(path, people)] * 4)
    assert sum(taken) == len(people)
    assert sorted(each.participant for each in read_answers(path)) == sorted(people)


def test_where_the_disk_is_full_nothing_is_left(tmp_path):
    """A limit on the size of files breaks the write off in the middle of the row."""
    path = tmp_path / "answers.csv"
    add_answer(path, answer(), anything)
    before = path.read_bytes()
    code = f"""
import resource, signal, sys
from tests.study.study_samples import answer
from hemline.errors import BadOutput
from hemline.study.answers import add_answer
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({len(before) + 20}, resource.RLIM_INFINITY))
try:
    add_answer({str(path)!r}, answer(participant="P2"), lambda answers: None)
except BadOutput as error:
    print(error)
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.startswith(f"cannot write {path}; got 20 of ")
    assert path.read_bytes() == before


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(BadOutput, match="cannot write .*answers.csv; got No such file"):
        add_answer(tmp_path / "no" / "answers.csv", answer(), anything)


def test_a_system_without_locks_is_said(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with pytest.raises(BadOutput, match="cannot lock .*; got a system without file locks; use Linux, macOS or WSL"):
        add_answer(tmp_path / "answers.csv", answer(), anything)


HEADER = ",".join(COLUMNS)
GOOD = "P1,walk,Which?,a.webp,b.webp,A,2,1.5,2026-01-01T10:00:00+00:00,0,sha256:0123456789ab"
FILES = {
    "another table": ("name,age\nA,3\n", "is no CSV of answers; got the first line 'name,age'"),
    "one line of something": ("hello", "is no CSV of answers; got the first line 'hello'"),
    "off the scale": (f"{HEADER}\n{GOOD.replace(',A,2,', ',A,8,')}\n", "row 2 is no answer; got P1,walk"),
    "no number": (f"{HEADER}\n{GOOD.replace(',1.5,', ',soon,')}\n", "row 2 is no answer"),
    "no time": (f"{HEADER}\n{GOOD.replace(',1.5,', ',nan,')}\n", "row 2 is no answer"),
    "no side": (f"{HEADER}\n{GOOD.replace(',A,2,', ',C,2,')}\n", "row 2 is no answer"),
    "no code": (f"{HEADER}\n{GOOD.replace('P1', '=1', 1)}\n", "row 2 is no answer"),
    "a cell too few": (f"{HEADER}\n{GOOD}\nP2,walk\n", "row 3 is no answer; got P2,walk; mend that row"),
    "twice": (f"{HEADER}\n{GOOD}\n{GOOD}\n", "row 3 answers again what an earlier row does; got P1, walk, Which?"),
}


@pytest.mark.parametrize("name", FILES)
def test_files_that_are_none_are_refused_and_left_alone(name, tmp_path):
    content, said = FILES[name]
    path = tmp_path / "answers.csv"
    path.write_text(content)
    for use in (lambda: read_answers(path), lambda: add_answer(path, answer(participant="P9"), anything)):
        with pytest.raises(BadInput) as refused:
            use()
        assert said in str(refused.value)
    assert path.read_text() == content


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "answers.csv"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadInput, match="is no CSV of answers"):
        read_answers(path)
    with pytest.raises(BadInput, match="cannot read .*; got No such file"):
        read_answers(tmp_path / "none.csv")


def test_what_a_spreadsheet_saves_can_be_read(tmp_path):
    """With a byte-order mark, and lines that end as on Windows."""
    path = tmp_path / "answers.csv"
    path.write_bytes(b"\xef\xbb\xbf" + f"{HEADER}\r\n{GOOD}\r\n".encode())
    assert [each.preference for each in read_answers(path)] == [2]
    add_answer(path, answer(participant="P2"), anything)
    assert [each.participant for each in read_answers(path)] == ["P1", "P2"]

"""`hemline compare` as it is typed: what it refuses, statistics, and a study that is killed and goes on."""

import http.client
import json
import re
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest

from hemline.cli import main
from hemline.study import QUESTIONS, Viewer, read_answers
from hemline.study.answers import add_answer
from tests.study.study_samples import answer, make_folders


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_folders(tmp_path)
    (tmp_path / "other.csv").write_text("name,age\n")
    (tmp_path / "empty.csv").write_text("")
    return tmp_path


CASES = {
    "nothing": ([], "clips are compared in twos; got 0 paths; name A and B"),
    "one path": (["ours", "--blind"], "clips are compared in twos; got 1 paths"),
    "no such clip": (["ours", "none.webp"], "cannot read none.webp; got No such file"),
    "no folder for the answers": (["ours", "skinned", "--blind", "-o", "no/a.csv"], "cannot write no/a.csv"),
    "another table": (["ours", "skinned", "--blind", "-o", "other.csv"], "other.csv is no CSV of answers"),
    "no question": (["ours", "skinned", "--blind", "--questions", " "], "questions must be lines of text that differ"),
    "questions to nobody": (["ours", "skinned", "--questions", "Which?"], "in a blind comparison only; got no --blind"),
    "no port": (["ours", "skinned", "--port", "99999"], "a port lies from 0 to 65535; got 99999"),
    "a port in words": (["ours", "skinned", "--port", "x"], "--port must be a whole number; got x"),
    "statistics of clips": (["ours", "--summary", "empty.csv"], "--summary takes no clips; got ours"),
    "JSON of nothing": (["ours", "skinned", "--json"], "--json is for statistics; got no --summary"),
    "statistics of no file": (["--summary", "none.csv"], "cannot read none.csv; got No such file"),
    "statistics of no answers": (["--summary", "empty.csv"], "there is nothing to summarise; got no answers"),
    "a misspelt flag": (["ours", "skinned", "--blnd"], "compare has no '--blnd'"),
}


@pytest.mark.parametrize("name", CASES)
def test_what_cannot_be_done_is_one_line_and_status_two(name, folder, capsys):
    words, said = CASES[name]
    before = sorted(path.name for path in folder.rglob("*"))
    assert main(["compare", *words]) == 2
    out, err = capsys.readouterr()
    *_, error = err.splitlines()  # after the line that says what is being done
    assert out == "" and error.startswith("hemline: ") and said in error, err
    assert sorted(path.name for path in folder.rglob("*")) == before


@pytest.fixture
def answered(folder):
    """Four people and two pairs; all agree on the second question."""
    for person, points in {"P1": (1, 3), "P2": (2, 2), "P3": (2, 4), "P4": (5, 1)}.items():
        for pair, point in zip(("run", "a longer name"), points, strict=True):
            add_answer(
                "answers.csv",
                answer(participant=person, pair=pair, preference=point, question="Which?"),
                lambda answers: None,
            )
        add_answer(
            "answers.csv",
            answer(participant=person, pair="run", preference=4, question="And now?"),
            lambda answers: None,
        )
    return folder


def test_statistics_are_a_table(answered, capsys):
    capsys.readouterr()
    assert main(["compare", "--summary", "answers.csv"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:4] == [
        "A: ours/walk.webp",
        "B: skinned/walk.webp",
        "1: A is much better, 4: no preference, 7: B is much better",
        "",
    ]
    table = [" ".join(line.split()) for line in lines[4:]]
    assert table == [
        "Which?",
        "n 1 2 3 4 5 6 7 mean SD t-test against 4",
        "a longer name 4 1 1 1 1 0 0 0 2.50 1.291 t(3) = -2.324, p = 0.103",
        "run 4 1 2 0 0 1 0 0 2.50 1.732 t(3) = -1.732, p = 0.182",
        "all pairs 4 2 3 1 1 1 0 0 2.50 0.577 t(3) = -5.196, p = 0.014",
        "And now?",
        "n 1 2 3 4 5 6 7 mean SD t-test against 4",
        "run 4 0 0 0 4 0 0 0 4.00 0.000 -",
    ]
    heads, row = lines[5], lines[7]
    assert heads.index("n") == row.index("4") and row[: heads.index("1") + 1].endswith("1"), "columns under their heads"


def test_statistics_are_json(answered, capsys):
    capsys.readouterr()
    assert main(["compare", "--summary", "answers.csv", "--json"]) == 0
    read = json.loads(capsys.readouterr().out)
    assert (read["answers"], read["a"], read["b"]) == ("answers.csv", ["ours/walk.webp"], ["skinned/walk.webp"])
    assert [(row["question"], row["pair"]) for row in read["rows"]] == [
        ("Which?", "a longer name"),
        ("Which?", "run"),
        ("Which?", None),
        ("And now?", "run"),
    ]
    assert read["rows"][1]["counts"] == [1, 2, 0, 0, 1, 0, 0] and read["rows"][1]["participants"] == 4
    assert read["rows"][1]["t"] == pytest.approx(-(3**0.5)) and read["rows"][3]["t"] is None


@pytest.mark.parametrize("browser", [True, False])
def test_the_browser_is_opened_unless_it_is_not_wanted(browser, folder, monkeypatch, capsys):
    """A browser of the terminal returns when it is closed; the page answers meanwhile."""
    opened, seen = [], threading.Event()

    def open_page(url: str) -> None:
        opened.append(url)
        seen.wait(30)

    def interrupted(viewer: Viewer) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", open_page)
    monkeypatch.setattr(Viewer, "serve_forever", interrupted)
    assert main(["compare", "ours", "skinned", *([] if browser else ["--no-browser"])]) == 0
    seen.set()
    out, err = capsys.readouterr()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/\n", out)
    assert err.splitlines()[1:3] == ["Ctrl-C ends it", "ended"]
    assert len(opened) == browser
    assert all(url[:-34] == out.strip()[:-34] and url != out.strip() for url in opened), "an address that works once"


@contextmanager
def running(*words: str):
    """`hemline compare` as a process of its own, and its page's address."""
    command = [sys.executable, "-m", "hemline", "compare", *words, "--no-browser"]
    # a test run in the background of a shell ignores Ctrl-C, and its children would, too
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.communicate()


def posted(url: str, path: str, body: dict) -> dict:
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.netloc, timeout=30)
    connection.request("POST", parts.path.rstrip("/") + path, json.dumps(body))
    reply = json.loads(connection.getresponse().read())
    connection.close()
    return reply


def test_a_study_that_is_killed_keeps_every_answer_and_goes_on(folder):
    study = ["ours", "skinned", "--blind"]
    person = {"participant": "P1"}
    with running(*study) as (process, url):
        reply = posted(url, "/next", person)
        for _ in range(4):
            reply = posted(url, "/answer", person | {"token": reply["item"]["token"], "point": 2, "seconds": 1})
        process.kill()
        process.wait()
    assert len(read_answers("answers.csv")) == 4
    with running(*study, "--seed", "1") as (process, _):
        assert process.wait(60) == 2
        assert "answers.csv holds answers of another study; got seed 0" in process.stderr.read()
    with running(*study) as (process, url):
        # the page that was left open has another address, and its answer is not known here
        refused = posted(url, "/answer", person | {"token": reply["item"]["token"], "point": 2, "seconds": 1})
        assert refused["error"].startswith("there is no such question in this study")
        reply = posted(url, "/next", person)
        assert (reply["item"]["pair"], reply["item"]["ordinal"]) == (2, 2)
        reply = posted(url, "/answer", person | {"token": reply["item"]["token"], "point": 2, "seconds": 1})
        assert (reply["item"]["pair"], reply["item"]["ordinal"]) == (2, 3)
        while reply["item"]:
            reply = posted(url, "/answer", person | {"token": reply["item"]["token"], "point": 2, "seconds": 1})
        (folder / "answers.csv").rename(folder / "kept.csv")
        (folder / "answers.csv").write_text("spilt")
        assert posted(url, "/next", person)["error"].startswith("The study cannot go on")
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
        _, *said, following = process.stderr.read().splitlines()
    assert following == "next: hemline compare --summary answers.csv"
    assert said[0] == "Ctrl-C ends it; answers are kept in answers.csv" and said[-1] == "ended"
    assert said[1].startswith("hemline: answers.csv is no CSV of answers; got the first line 'spilt'")
    answers = read_answers("kept.csv")
    assert len(answers) == 9 and {each.question for each in answers} == set(QUESTIONS)


def test_one_of_many_clips_stands_for_all(folder, capsys):
    for pair in ("run", "walk", "turn"):
        add_answer("answers.csv", answer(pair=pair, a=f"ours/{pair}.webp"), lambda answers: None)
    assert main(["compare", "--summary", "answers.csv"]) == 0
    assert capsys.readouterr().out.startswith("A: ours/run.webp and 2 more\nB: skinned/walk.webp\n")

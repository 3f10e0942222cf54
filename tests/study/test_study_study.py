"""What each participant is asked next, and that every answer is filed under what was asked, once."""

import hashlib
import hmac
import json
import threading
from collections import Counter
from pathlib import Path

import pytest

from hemline.errors import BadAnswer, BadInput, BadOutput
from hemline.study import QUESTIONS, Study, pairs_of
from tests.study.study_samples import BLUE, RED, make_clip, make_folders


@pytest.fixture
def pairs(tmp_path):
    return pairs_of(make_folders(tmp_path))


@pytest.fixture
def study(pairs, tmp_path) -> Study:
    return Study(pairs, tmp_path / "answers.csv")


def finish(study: Study, participant: str, point: int = 2) -> list:
    """Answer all that is left; what was asked, in its order."""
    asked = []
    while item := study.next_item(participant):
        study.answer(participant, item.token, point, 1.5)
        asked.append(item)
    return asked


def test_each_question_about_each_pair_is_asked_once(study):
    asked = finish(study, "P1")
    assert [item.number for item in asked] == list(range(9))
    assert [item.question for item in asked] == [*QUESTIONS] * 3
    assert Counter(item.shown.pair.name for item in asked) == {"walk": 3, "turn": 3, "kick": 3}
    for first in (0, 3, 6):
        assert len({item.shown for item in asked[first : first + 3]}) == 1, "a pair stays while it is asked about"
    assert study.next_item("P1") is None and study.next_item("P2") is not None


def test_answers_are_kept_by_clip_and_not_by_side(study):
    """Whoever always prefers the left clip a little prefers A where it was on the left, and B elsewhere."""
    asked = finish(study, "P1", point=3)
    given = study.all_answers()
    assert len(given) == 9 and {answer.left for answer in given} == {"A", "B"}
    for item, answer in zip(asked, given, strict=True):
        assert answer.key == ("P1", item.shown.pair.name, item.question)
        assert (answer.left, answer.preference) == (("A", 3) if item.shown.a_left else ("B", 5))
        assert (answer.seconds, answer.seed, answer.clips) == (1.5, 0, item.shown.pair.contents)
        assert (Path(answer.a), Path(answer.b)) == (item.shown.pair.a, item.shown.pair.b)
        assert answer.time.endswith("+00:00")


@pytest.mark.parametrize("point", range(1, 8))
def test_each_point_of_the_scale_is_turned_round_where_b_is_on_the_left(point, study):
    for person in ("P1", "P2", "P3"):
        item = study.next_item(person)
        study.answer(person, item.token, point, 0)
        assert study.all_answers()[-1].preference == (point if item.shown.a_left else 8 - point)


def test_a_participant_may_leave_and_come_back_however_they_write_their_code(study):
    whole = [(item.shown, item.question) for item in study.items("P1")]
    for expected, code in zip(whole, ("P1", "p1", " P1 ", "p1\n"), strict=False):
        again = Study(study.pairs, study.answers)
        item = again.next_item(code)
        assert (item.shown, item.question) == expected
        again.answer(code, item.token, 4, 2)
    assert [(item.shown, item.question) for item in finish(study, "P1")] == whole[4:]
    assert {answer.participant for answer in study.all_answers()} == {"P1"}


def test_of_two_who_answer_at_once_one_is_heard(study):
    """Two pages with one code, as when a page was left open."""
    item, start, said = study.next_item("P1"), threading.Barrier(8), []

    def press() -> None:
        start.wait()
        try:
            study.answer("P1", item.token, 1, 1)
        except BadAnswer as error:
            said.append(str(error))

    threads = [threading.Thread(target=press) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(study.all_answers()) == 1 and len(said) == 7
    assert said[0].startswith("this question is not asked now; it may be answered already; got number 1; load the page")


def test_a_page_that_was_left_open_files_nothing_under_another_item(study, tmp_path):
    """The study was stopped meanwhile and started with a pair more, or with another seed and file."""
    item = study.next_item("P1")
    more = make_clip(tmp_path / "more" / "a.webp", RED), make_clip(tmp_path / "more" / "b.webp", BLUE)
    larger = Study((*study.pairs, *pairs_of(more)), tmp_path / "larger.csv")
    other = Study(study.pairs, tmp_path / "other.csv", seed=1)
    assert item.token not in [each.token for each in other.items("P1")]
    assert item.token not in [each.token for each in larger.items("P1")]
    assert item.token not in [each.token for each in study.items("P2")], "nor under another participant"
    for elsewhere in (larger, other):
        with pytest.raises(BadAnswer, match="no such question in this study; got '[0-9a-f]{32}'; load the page again"):
            elsewhere.answer("P1", item.token, 4, 1)
        assert elsewhere.all_answers() == []


def test_what_an_answer_is_sent_with_tells_nobody_which_side_a_is_on(study):
    """Whoever has both clips, the code, the seed and the names knows all that it stands for, but not the secret."""
    item = study.next_item("P1")
    pair = item.shown.pair
    for a_left in (False, True):
        what = json.dumps([0, "P1", pair.name, pair.contents, a_left, item.question]).encode()
        for guess in (hashlib.sha256(what), hmac.new(b"", what, "sha256"), hmac.new(b"0", what, "sha256")):
            assert not guess.hexdigest().startswith(item.token[:8])
    again = Study(study.pairs, study.answers)
    assert not {each.token for each in again.items("P1")} & {each.token for each in study.items("P1")}
    assert again == study and "secret" not in repr(study)


WRONG = {
    "no code": ({"participant": ""}, "that is no participant code; got ''; use 1 to 40 letters"),
    "no text": ({"participant": 7}, "that is no participant code; got 7"),
    "a formula": ({"participant": "=1+1"}, "that is no participant code; got '=1.1'"),
    "a path": ({"participant": "../x"}, "that is no participant code"),
    "a long code": ({"participant": "x" * 41}, "that is no participant code"),
    "half a letter": ({"participant": "\ud800"}, "that is no participant code"),
    "no token": ({"token": None}, "there is no such question in this study; got None"),
    "a list": ({"token": ["x"]}, "there is no such question in this study"),
    "no letters": ({"token": "\ud800é"}, "there is no such question in this study"),
    "a later item": ({"token": 3}, "not asked now; it may be answered already; got number 4"),
    "no point": ({"point": None}, "an answer must be on the scale; got None; choose from 1 to 7"),
    "0": ({"point": 0}, "an answer must be on the scale; got 0"),
    "8": ({"point": 8}, "an answer must be on the scale; got 8"),
    "half a point": ({"point": 2.5}, "an answer must be on the scale; got 2.5"),
    "yes": ({"point": True}, "an answer must be on the scale; got True"),
    "no time": ({"seconds": None}, "seconds must be a number of at least 0; got None"),
    "before it began": ({"seconds": -1}, "seconds must be a number of at least 0; got -1"),
    "not a number": ({"seconds": float("nan")}, "seconds must be a number of at least 0; got nan"),
    "for ever": ({"seconds": float("inf")}, "seconds must be a number of at least 0; got inf"),
    "a time that is yes": ({"seconds": True}, "seconds must be a number of at least 0; got True"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_answer_is_refused_and_not_written(name, study):
    changes, said = WRONG[name]
    good = {"participant": "P1", "token": study.next_item("P1").token, "point": 4, "seconds": 1.0}
    if changes.get("token") == 3:
        changes = {"token": study.items("P1")[3].token}
    with pytest.raises(BadAnswer, match=said):
        study.answer(**(good | changes))
    assert study.all_answers() == []
    study.answer(**good)
    assert len(study.all_answers()) == 1


def test_a_code_that_is_none_is_asked_nothing(study):
    with pytest.raises(BadAnswer, match="that is no participant code"):
        study.next_item("a b")


def test_answers_of_another_study_are_refused(study, pairs, tmp_path):
    finish(study, "P1")
    with pytest.raises(BadInput, match="answers of another study; got seed 0; name another file, or the same clips"):
        Study(pairs, study.answers, seed=1)
    with pytest.raises(BadInput, match="another study; got the question 'Which clothing animation looks more realis"):
        Study(pairs, study.answers, questions=("Which one?",))
    with pytest.raises(BadInput, match="another study; got other clips for '(walk|turn|kick)'"):
        Study(pairs_of([tmp_path / "skinned", tmp_path / "ours"]), study.answers)
    make_clip(tmp_path / "ours" / "walk.webp", (0, 200, 0))
    with pytest.raises(BadInput, match="another study; got other clips for 'walk'"):
        Study(pairs_of([tmp_path / "ours", tmp_path / "skinned"]), study.answers)
    assert len(study.all_answers()) == 9


def test_a_question_more_is_asked_of_those_who_had_finished(study, pairs):
    finish(study, "P1")
    longer = Study(pairs, study.answers, questions=(*QUESTIONS, "Which one would you wear?"))
    assert [item.question for item in finish(longer, "P1")] == ["Which one would you wear?"] * 3


def test_a_file_that_was_damaged_meanwhile_is_left_as_it_is(study):
    finish(study, "P1")
    study.answers.write_text("spilt")
    item = study.items("P2")[0]
    for ask in (lambda: study.next_item("P2"), lambda: study.answer("P2", item.token, 4, 1)):
        with pytest.raises(BadInput, match="is no CSV of answers; got the first line 'spilt'"):
            ask()
    assert study.answers.read_text() == "spilt"


@pytest.mark.parametrize(
    "questions, got", [((), "'none'"), (("Which?", "Which?"), "'Which.'"), (("a\nb",), "'a.nb'"), ((" ",), "' '")]
)
def test_questions_must_be_lines_that_differ(questions, got, pairs, tmp_path):
    with pytest.raises(BadInput, match=f"questions must be lines of text that differ; got {got}; ask each one once"):
        Study(pairs, tmp_path / "answers.csv", questions=questions)


@pytest.mark.parametrize("question", ["=1+1", "+1", "-1", "@SUM(A1)", " =1+1", "\uff1d1+1"])
def test_a_question_that_is_a_formula_is_refused(question, pairs, tmp_path):
    with pytest.raises(BadInput, match="a question would be a formula in a spreadsheet; got .*begin it with a letter"):
        Study(pairs, tmp_path / "answers.csv", questions=("Which?", question))
    assert not (tmp_path / "answers.csv").exists()


def test_where_nothing_can_be_written_nothing_is_asked(pairs, tmp_path):
    with pytest.raises(BadOutput, match="cannot write .*; got a folder of that name"):
        Study(pairs, tmp_path)
    with pytest.raises(BadOutput, match="cannot write .*answers.csv"):
        Study(pairs, tmp_path / "none" / "answers.csv")

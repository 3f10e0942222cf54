"""Participants in a real browser: what they see, what they answer, and that they may go and come back."""

import base64
import json
import threading
import time

import pytest

from hemline.study import QUESTIONS, Study, Viewer, pairs_of, read_answers
from tests.study.browser import Page, browsing
from tests.study.study_samples import BLUE, RED, make_clip, make_folders, sent, serving


@pytest.fixture(scope="module")
def driver():
    with browsing() as driver:
        yield driver


@pytest.fixture
def page(driver):
    page = Page(driver)
    page.complaints()
    yield page
    assert page.complaints() == [], "the page breaks no rule of its own and throws nothing"
    driver.get("about:blank")


@pytest.fixture
def study(tmp_path) -> Study:
    return Study(pairs_of(make_folders(tmp_path)), tmp_path / "answers.csv")


def test_a_study_from_beginning_to_end(page, study):
    """What is filed is what was seen: A is red, B blue, and the left is always a little better."""
    seen = []
    with serving(study) as viewer:
        page.begin(viewer.url, "p1")
        for number in range(9):
            assert page.text("place") == f"Pair {number // 3 + 1} of 3, question {number % 3 + 1} of 3"
            assert page.text("question") == QUESTIONS[number % 3]
            seen.append(page.colours())
            page.answer(3)
        assert page.text("finished") == "All 9 answers of p1 are kept."
        page.press("\n")
        page.until("!document.getElementById('welcome').hidden && document.activeElement.id === 'code'")
    answers = read_answers(study.answers)
    assert [answer.left for answer in answers] == [left for left, _ in seen]
    assert [answer.preference for answer in answers] == [3 if left == "A" else 5 for left, _ in seen]
    assert all(set(sides) == {"A", "B"} for sides in seen) and len(set(seen)) == 2
    assert all(0 < answer.seconds < 60 for answer in answers)


def test_nothing_on_the_page_tells_the_clips_apart(page, study):
    with serving(study) as viewer:
        page.begin(viewer.url, "P1")
        shown = page.driver.execute_script("return document.documentElement.outerHTML")
        loaded = page.driver.execute_script("return performance.getEntriesByType('resource').map((each) => each.name)")
        known = page.driver.execute_script("return JSON.stringify(state.item)")
        title, url = page.driver.title, page.driver.current_url
    assert (title, url) == ("Which one?", viewer.url)
    assert sum("/clips/" in each for each in loaded) == 2
    for text in (shown, known, *loaded):
        assert not any(word in text for word in ("ours", "skinned", "walk", "turn", "kick", ".webp", "answers.csv"))


def test_a_participant_leaves_and_comes_back_after_the_server_was_stopped(page, study):
    with serving(study) as viewer:
        page.begin(viewer.url, "P1")
        for _ in range(4):
            page.answer(2)
        port = viewer.server_address[1]
    page.press("2")
    page.press("\n")
    page.until("!document.getElementById('fault').hidden && !state.busy")
    assert page.text("fault").startswith("The page is not reached; tell the person who runs the study")
    assert len(read_answers(study.answers)) == 4
    with serving(study, port=port) as viewer:
        page.press("2")
        page.press("\n")
        page.until("document.getElementById('fault').innerText.includes('Open the address that hemline shows')")
        assert len(read_answers(study.answers)) == 4, "a page of an earlier start is not let in"
        page.begin(viewer.url, " p1 ")
        assert page.text("place") == "Pair 2 of 3, question 2 of 3"
        page.answer(2)
        page.begin(viewer.url, "P2")
        assert page.text("place") == "Pair 1 of 3, question 1 of 3"
    assert len(read_answers(study.answers)) == 5


def test_a_page_that_was_left_open_says_so_and_changes_nothing(page, study):
    with serving(study) as viewer:
        page.begin(viewer.url, "P1")
        item = study.next_item("P1")
        study.answer("P1", item.token, 1, 1)
        page.press("7")
        page.press("\n")
        page.until("!document.getElementById('fault').hidden && !state.busy")
        assert "it may be answered already" in page.text("fault") and "load the page again" in page.text("fault")
        assert len(study.all_answers()) == 1


def test_a_code_that_is_none_is_said(page, study):
    with serving(study) as viewer:
        page.driver.get(viewer.url)
        page.until("!document.getElementById('welcome').hidden")
        page.driver.find_element("id", "code").send_keys("a b\n")
        page.until("!document.getElementById('fault').hidden && !state.busy")
        assert page.text("fault").startswith("that is no participant code; got 'a b'; use 1 to 40 letters")
        assert page.driver.find_element("id", "welcome").is_displayed()


def test_keys_and_mouse_choose_and_nothing_is_sent_before_a_choice(page, study):
    chosen = "Number(document.querySelector('#scale input:checked')?.value ?? 0)"
    with serving(study) as viewer:
        page.begin(viewer.url, "P1")
        page.press("\n")
        assert page.until("document.getElementById('confirm').disabled") and study.all_answers() == []
        right, left = "\ue014", "\ue012"
        for keys, point in ((right, 5), (right, 6), (left, 5), ("1", 1), (left, 1), ("7", 7), (right, 7), ("8", 7)):
            page.press(keys)
            assert page.until(chosen) == point
        page.driver.find_elements("css selector", "#scale label")[5].click()
        assert page.until(chosen) == 6
        page.driver.find_element("id", "confirm").click()
        page.until("state.item.ordinal === 2 && !state.busy")
        assert page.driver.execute_script(f"return {chosen}") == 0
        first = page.driver.find_element("css selector", "#left img").get_attribute("src")
        page.press("r")
        page.until(f"document.querySelector('#left img').src !== '{first}' && !state.busy")
    (answer,) = study.all_answers()
    assert answer.preference == (6 if answer.left == "A" else 2)


def test_the_whole_page_is_seen_without_scrolling(page, study):
    """On the screen of a small laptop; a clip is as high as there is room."""
    size = page.driver.get_window_size()
    try:
        page.driver.set_window_size(1366, 768)
        with serving(study) as viewer:
            page.begin(viewer.url, "P1")
            over = "const all = document.documentElement; return [all.scrollHeight, all.scrollWidth]"
            assert page.driver.execute_script(over) == page.driver.execute_script("return [innerHeight, innerWidth]")
            assert page.driver.find_element("id", "left").rect["height"] > 250
    finally:
        page.driver.set_window_size(size["width"], size["height"])


def test_without_questions_names_are_shown(page, tmp_path):
    pairs = pairs_of(make_folders(tmp_path))
    with serving(pairs) as viewer:
        page.driver.get(viewer.url)
        page.until("state.shownClips && !state.busy")
        captions = [each.text for each in page.driver.find_elements("css selector", "figcaption")]
        assert captions == [str(pairs[0].a), str(pairs[0].b)] and page.colours() == ("A", "B")
        assert page.text("place") == "kick, pair 1 of 3"
        page.driver.find_element("id", "forth").click()
        page.until("state.place === 1 && state.shownClips && !state.busy")
        page.press("\ue012")
        page.until("state.place === 0 && state.shownClips && !state.busy")


def test_clips_play_together(page, tmp_path):
    """A bar moves over both clips; where it is on the left, it is on the right, within two steps of twenty."""
    a, b = make_clip(tmp_path / "a.webp", RED, frame_ms=100), make_clip(tmp_path / "b.webp", BLUE, frame_ms=100)
    with serving(pairs_of([a, b])) as viewer:
        page.driver.get(viewer.url)
        page.until("state.shownClips && !state.busy")
        for _ in range(3):
            page.press("r")
            page.until("!state.busy")
            places, until = set(), time.monotonic() + 30
            while len(places) < 3 and time.monotonic() < until:
                left, right = page.bars(20)
                assert min((left - right) % 20, (right - left) % 20) <= 2
                places |= {left, right}
            assert len(places) >= 3, "they move"


RECORD = """
const [colour, width, milliseconds, done] = arguments;
const canvas = Object.assign(document.createElement("canvas"), { width, height: 64 });
const context = canvas.getContext("2d");
let drawn = 0;
const draw = setInterval(() => {
  context.fillStyle = drawn++ % 2 ? colour : colour + "fe";
  context.fillRect(0, 0, width, 64);
}, 30);
const recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: "video/webm;codecs=vp8" });
const parts = [];
recorder.ondataavailable = ({ data }) => parts.push(data);
recorder.onstop = async () => {
  clearInterval(draw);
  const bytes = new Uint8Array(await new Blob(parts).arrayBuffer());
  done(btoa(String.fromCharCode(...bytes)));
};
recorder.start();
setTimeout(() => recorder.stop(), milliseconds);
"""


def record(page, path, colour: str, width: int):
    """A short video of one colour, made by the browser itself."""
    path.write_bytes(base64.b64decode(page.driver.execute_async_script(RECORD, colour, width, 700)))
    return path


@pytest.fixture
def videos(page, tmp_path):
    page.driver.set_script_timeout(30)
    red, blue = record(page, tmp_path / "a.webm", "#dc1e1e", 64), record(page, tmp_path / "b.webm", "#1e1edc", 64)
    return red, blue, record(page, tmp_path / "wide.webm", "#1e1edc", 128)


def test_videos_play_together_and_again(page, videos, tmp_path):
    study = Study(pairs_of(videos[:2]), tmp_path / "answers.csv", questions=("Which?",))
    times = "state.sides.map((side) => side.element.currentTime)"
    with serving(study) as viewer:
        page.begin(viewer.url, "P1")
        seen = page.colours()
        page.driver.execute_script(
            "state.rounds = 0; state.sides[0].element.addEventListener('play', () => state.rounds++)"
        )
        page.until("state.rounds >= 2")
        left, right = page.driver.execute_script(f"return {times}")
        assert abs(left - right) < 0.25
        page.answer(1)
    (answer,) = study.all_answers()
    assert answer.left == seen[0] and seen in (("A", "B"), ("B", "A"))
    assert answer.preference == (1 if answer.left == "A" else 7)


def test_videos_that_cannot_be_compared_are_said(page, videos, tmp_path):
    (tmp_path / "broken.webm").write_bytes(videos[0].read_bytes()[:60])
    for other, said in (
        ("wide.webm", "These two videos differ in size or length"),
        ("broken.webm", "cannot play this"),
    ):
        with serving(pairs_of([videos[0], tmp_path / other])) as viewer:
            page.driver.get(viewer.url)
            page.until("!document.getElementById('fault').hidden && !state.busy")
            assert said in page.text("fault")


def test_a_clip_that_changed_stops_the_study_without_a_name(page, study):
    told: list[str] = []
    with serving(study, report=told.append) as viewer:
        for pair in study.pairs:
            make_clip(pair.b, (0, 200, 0))
        page.driver.get(viewer.url)
        page.until("!document.getElementById('welcome').hidden")
        page.driver.find_element("id", "code").send_keys("P1\n")
        page.until("!document.getElementById('fault').hidden && !state.busy")
        assert page.text("fault").startswith("The study cannot go on. Please tell the person who runs it")
        page.press("1")
        page.press("\n")
        assert study.all_answers() == [], "what was not seen is not answered"
    assert "have changed" in told[0]


def test_participants_at_once_do_not_mix(page, study):
    """One in the browser, others straight to the server."""
    with serving(study) as viewer:
        page.begin(viewer.url, "P0")
        threads = [threading.Thread(target=answer_all, args=(viewer, study, f"P{n}")) for n in range(1, 4)]
        for thread in threads:
            thread.start()
        for _ in range(9):
            page.answer(1)
        for thread in threads:
            thread.join()
    answers = read_answers(study.answers)
    assert len(answers) == 36 and len({answer.key for answer in answers}) == 36
    for answer in answers:
        best_is_left = 1 if answer.left == "A" else 7
        assert answer.preference == (best_is_left if answer.participant == "P0" else 8 - best_is_left)


def answer_all(viewer: Viewer, study: Study, participant: str) -> None:
    """All questions, each time for the right clip."""
    reply = json.loads(sent(viewer, "/next", {"participant": participant})[1])
    while reply["item"]:
        body = {"participant": participant, "token": reply["item"]["token"], "point": 7, "seconds": 1}
        reply = json.loads(sent(viewer, "/answer", body)[1])

"""Each verb says what it is doing before its work, ends with a command to try, and prints JSON for programs."""

import json
import re
import shlex
import subprocess
import sys
import time
from dataclasses import fields

import pytest

from hemline.cli import main, progress_lines
from hemline.cli.guide import GUIDES
from hemline.cli.main import VERBS, _parse, options_class
from hemline.cli.progress import bars, steps

WITHOUT_JSON = {"view": "serves a page until Ctrl-C; its address is the only line on stdout"}
"""Verbs without `--json`, each with the reason."""
WORDS = {
    "make": "my.obj -o my.safetensors",
    "body": "me.glb -o me.safetensors",
    "generate": "skirt -o 'my skirt.obj'",
    "tryon": "my.obj -o worn.safetensors",
    "simulate": "cape-light -m run walk -o takes",
    "drape": "tshirt -o drapes --anchors 4 -m run",
    "fit": "takes more -o model.safetensors --animator ropes",
    "animate": "live --garment my.obj -m run -o run.glb",
    "export": "takes --take 0 -o take.glb",
    "character": "cape -o cape.vrm",
    "explain": "run",
    "evaluate": "cape -m run",
    "view": "cape",
    "page": "cape -o pages",
    "compare": "ours theirs --blind",
    "demo": "--out demo",
    "bench": "cape",
    "warmup": "--jobs 2",
}
"""Words that each verb understands."""
MORE = {
    "animate": ["cape -m run"],
    "drape": ["tshirt -o drapes --spread 4"],
    "compare": ["a.webp b.webp"],
    "page": ["cape -o page.html"],
    "bench": ["--list"],
}
"""Other words, after which another command is the next."""
FAIL_AT_ONCE = {
    "make": "no.obj -o no/model.safetensors",
    "body": "no.glb -o body.glb",
    "generate": "kilt -o kilt.obj",
    "tryon": "no.obj -o worn.safetensors",
    "simulate": "no.obj -m run -o takes",
    "drape": "no.obj -o drapes",
    "fit": "nothing -o model.safetensors",
    "animate": "no.safetensors -m run",
    "export": "nothing --take 0 -o take.glb",
    "character": "no.safetensors -o cape.vrm",
    "explain": "no.bvh",
    "evaluate": "no.safetensors -m run",
    "view": "no.safetensors",
    "page": "no.safetensors -o page.html",
    "compare": "nothing nowhere",
    "bench": "no-such-benchmark",
    "warmup": "--jobs 0",
}
"""Words for each verb but `demo` that it refuses."""
FIRST_WORDS_S = 2.0
"""Time to the first line [s]."""


def parsed(verb: str, words: str):
    split = shlex.split(words)
    return _parse(options_class(verb, split), verb, split)


def test_every_verb_has_words():
    assert list(GUIDES) == list(VERBS) == list(WORDS)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_prints_json_or_has_a_reason_not_to(verb, capsys):
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    named = "--json" in capsys.readouterr().out
    assert named == ("json" in {field.name for field in fields(options_class(verb))})
    assert named == (verb not in WITHOUT_JSON)


@pytest.mark.parametrize(
    ("verb", "words"), [(verb, words) for verb in WORDS for words in (WORDS[verb], *MORE.get(verb, []))]
)
def test_the_next_command_is_one_that_hemline_understands(verb, words):
    options = parsed(verb, words)
    assert GUIDES[verb].doing(options)[0].islower()
    command = GUIDES[verb].then(options)
    if command is None or command.startswith("python -m http.server"):
        assert verb in ("explain", "page")
        return
    program, following, *rest = shlex.split(command)
    assert program == "hemline"
    parsed(following, shlex.join(rest))


@pytest.mark.parametrize("verb", FAIL_AT_ONCE)
def test_the_first_line_says_what_is_done_and_an_error_ends_without_a_next_one(verb, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([verb, *FAIL_AT_ONCE[verb].split()]) == 2
    first, error = capsys.readouterr().err.splitlines()
    assert first.startswith(f"{verb}: ") and error.startswith("hemline: ")


@pytest.mark.parametrize(
    ("words", "following"),
    [
        ("generate skirt --edge 0.05 -o skirt.obj", "hemline animate --garment skirt.obj"),
        ("explain run", "hemline animate cape -m run"),
        ("bench --list", "hemline bench cape"),
        ("body anny24 --accessory pad.obj:spine3 -o body.safetensors", "hemline animate live --garment skirt --body"),
    ],
)
def test_a_verb_ends_with_the_next_command_and_stdout_is_for_programs(words, following, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    corners = [(x, y, z) for x in (0.1, 0.2) for y in (1.3, 1.4) for z in (0.2, 0.3)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    lines = [*(f"v {x} {y} {z}" for x, y, z in corners), *(f"f {face}" for face in faces)]
    (tmp_path / "pad.obj").write_text("\n".join(lines) + "\n")
    verb = words.split()[0]
    assert main(words.split()) == 0
    out, err = capsys.readouterr()
    assert err.splitlines()[0].startswith(f"{verb}: ") and err.splitlines()[-1].startswith(f"next: {following}")
    assert "next: " not in out and f"{verb}: " not in out
    assert main([*words.split(), "--json"]) == 0
    out, err = capsys.readouterr()
    assert isinstance(json.loads(out), dict) and "next: " not in err
    monkeypatch.setenv("HEMLINE_PROGRESS", "lines")
    assert main(words.split()) == 0
    err = capsys.readouterr().err
    assert "next: " not in err and not err.startswith(f"{verb}: "), "a program that follows hemline hears progress only"


def test_steps_of_a_bar_are_counted_from_its_first_words(monkeypatch, capsys):
    monkeypatch.setenv("HEMLINE_PROGRESS", "lines")
    with steps(2) as begin:
        begin("one")
        begin("two")
    assert capsys.readouterr().err.splitlines() == ["progress: one 0/2", "progress: two 1/2"]


def test_a_log_has_a_line_with_the_time_left_now_and_then_and_none_for_short_work(monkeypatch, capsys):
    monkeypatch.setattr(progress_lines, "FIRST_S", 0.05)
    with bars() as display:
        task = display.add_task("short", total=2)
        display.advance(task)
        display.advance(task)
        task = display.add_task("long", total=300)
        for _ in range(100):
            time.sleep(0.001)
            display.advance(task)
    (line,) = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"long: \d+ %, [01] s left", line)
    assert [progress_lines.time_left(each) for each in (4.6, 89, 600)] == ["5 s", "89 s", "10 min"]


@pytest.mark.parametrize("verb", ["animate", "fit", "view"])
def test_the_first_line_comes_within_two_seconds(verb, tmp_path):
    command = [sys.executable, "-m", "hemline", verb, *FAIL_AT_ONCE[verb].split()]
    times = []
    for _ in range(3):  # the best of three, as the machine may be busy
        began = time.monotonic()
        with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, cwd=tmp_path) as process:
            assert process.stderr is not None and process.stderr.readline().startswith(verb.encode())
            times.append(time.monotonic() - began)
        if times[-1] < FIRST_WORDS_S:
            return
    raise AssertionError(f"the first line of {verb} came after {min(times):.1f} s")

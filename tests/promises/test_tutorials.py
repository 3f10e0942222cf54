"""Blocks of the tutorials run, in order, in one folder a page: those that are not marked `slow` on clips of a fifth of
a second; all of them as they stand by `make test-all`.

In a comment before a block may stand `slow`, or `of FILE` (it is a part of that file); after its language
`title="NAME"` (it is that file).
"""

import re
import shlex
import subprocess
import sys

import pytest

from hemline.cli import main
from tests.promises.pages import ROOT, TUTORIALS

BLOCK = re.compile(r"(?:^<!-- ([^\n]+) -->\n)?^```(\w+)([^\n]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page):
    """Language, what is said of it, and text of each block."""
    return [
        (language, (before + after).strip(), text) for before, language, after, text in BLOCK.findall(page.read_text())
    ]


def typed(line, *, slow):
    """Run one line of a shell block; hemline in this process, where kernels are compiled once."""
    line = line if slow else re.sub(r"--seconds \S+", "--seconds 0.2", line)
    program, *words = shlex.split(line)
    if program == "hemline":
        assert main(words) == 0, line
    else:
        assert program == "python", line
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr


def lines_of(code: str) -> str:
    """Its lines without indentation, which a method loses on a page."""
    return "".join(f"{line.strip()}\n" for line in code.splitlines() if line.strip())


def run(page, folder, monkeypatch, *, slow):
    """Run the blocks of a page in a folder."""
    monkeypatch.chdir(folder)
    (folder / "examples").symlink_to(ROOT / "examples")
    for language, said, text in blocks(page):
        if "slow" in said.split() and not slow:
            continue
        if title := re.search(r'title="(.+?)"', said):
            (folder / title[1]).write_text(text)
        elif source := re.search(r"of (\S+)$", said):
            whole = lines_of((ROOT / source[1]).read_text())
            assert lines_of(text) in whole, f"{page.name}: {source[1]} reads otherwise"
        elif language == "sh":
            for line in text.splitlines():
                typed(line, slow=slow)
        elif language == "python":
            exec(compile(text, str(page), "exec"), {"__name__": "tutorial"})


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_tutorials_run(page, tmp_path, monkeypatch):
    run(page, tmp_path, monkeypatch, slow=False)
    named = re.findall(r"-o (\S+)", "".join(text for _, said, text in blocks(page) if "slow" not in said))
    assert all((tmp_path / name).exists() for name in named if not name.endswith(".vat"))


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_tutorials_run_as_they_stand(page, tmp_path, monkeypatch):
    pytest.importorskip("torch", reason="fitting needs torch (extra 'learn')")
    run(page, tmp_path, monkeypatch, slow=True)


@pytest.mark.slow
def test_the_page_of_the_web_tutorial_draws_a_cape(tmp_path, monkeypatch):
    """In Chromium, with three.js from npm, or a skip."""
    import time
    from functools import partial
    from http.server import ThreadingHTTPServer
    from io import BytesIO
    from threading import Thread

    import numpy as np
    from PIL import Image

    from tests.export.web import _Quiet, packages
    from tests.study.browser import browsing

    (page,) = [each for each in TUTORIALS if each.stem == "web"]
    run(page, tmp_path, monkeypatch, slow=False)
    (tmp_path / "node_modules").symlink_to(packages())
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(tmp_path)))
    thread = Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        with browsing() as driver:
            driver.get(f"http://127.0.0.1:{server.server_port}/index.html")
            deadline = time.monotonic() + 60
            while not (driver.execute_script("return window.frames_drawn ?? 0") > 10) and time.monotonic() < deadline:
                time.sleep(0.2)
            picture = np.asarray(Image.open(BytesIO(driver.get_screenshot_as_png())).convert("RGB"), float)
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    red, green, blue = picture.reshape(-1, 3).T
    assert ((red > 1.5 * green) & (red > 1.5 * blue)).mean() > 0.01


def test_tutorials_use_no_program_that_tests_cannot_run():
    for page in TUTORIALS:
        for language, _, text in blocks(page):
            for line in text.splitlines() if language == "sh" else []:
                assert line.split()[0] in ("hemline", "python"), f"{page.name}: {line}"


def test_there_is_a_tutorial_for_each_way():
    assert {page.stem for page in TUTORIALS} >= {"own_garment", "own_body", "engines", "web", "animator"}

"""Readers from the web: Khronos' validator in node, three.js in Chromium; fetched from npm into `.node`, or a skip."""

import base64
import json
import os
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

from tests.study.browser import browsing

WEB = Path(__file__).parent / "web"
FETCHED = Path(__file__).parents[2] / ".node"


def packages() -> Path:
    """The folder `node_modules` with what `web/package.json` names, or a skip that says why there is none."""
    if shutil.which("node") is None or shutil.which("npm") is None:
        pytest.skip("node and npm are not installed (Debian: apt install nodejs npm)")
    if not _fetched():
        with tempfile.TemporaryDirectory(dir=FETCHED.parent, prefix=".node-") as made:  # workers may fetch side by side
            shutil.copy(WEB / "package.json", made)
            command = ["npm", "install", "--no-audit", "--no-fund", "--no-package-lock", "--prefix", made]
            done = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
            if done.returncode:
                pytest.skip(f"npm could not fetch what reads our exports: {done.stderr.strip().splitlines()[-1]}")
            if not _fetched():  # what another worker, which was faster, has fetched is in use already
                shutil.rmtree(FETCHED, ignore_errors=True)
                try:
                    os.rename(made, FETCHED)
                except OSError:
                    assert _fetched()
            Path(made).mkdir(exist_ok=True)
    return FETCHED / "node_modules"


def _fetched() -> bool:
    """Whether the packages that are wanted are there."""
    there = FETCHED / "package.json"
    return there.exists() and there.read_text() == (WEB / "package.json").read_text()


def validated(*paths: Path) -> list[dict]:
    """What Khronos' validator says of GLB files."""
    command = ["node", str(WEB / "validate.cjs"), *map(str, paths)]
    environment = os.environ | {"NODE_PATH": str(packages())}
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True, env=environment)
    return json.loads(done.stdout)


class _Quiet(SimpleHTTPRequestHandler):
    extensions_map = SimpleHTTPRequestHandler.extensions_map | {".js": "text/javascript", "": "text/plain"}

    def log_message(self, format, *args):
        pass

    def translate_path(self, path):
        if path.startswith("/node_modules/"):
            return str(FETCHED / path.split("?")[0].lstrip("/"))
        return str(WEB / "play.html") if path == "/" else super().translate_path(path)


@contextmanager
def three(folder: Path) -> Iterator:
    """A page of Chromium with three.js that may read the files of a folder; call it with JavaScript."""
    packages()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        with browsing() as driver:
            driver.set_script_timeout(120)
            driver.get(f"http://127.0.0.1:{server.server_port}/")
            yield partial(_called, driver)
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def _called(driver, script: str, *arguments) -> dict[str, np.ndarray]:
    """What an asynchronous function of the page gives: arrays (times, verts, 3) by name."""
    waiting = f"""
        const done = arguments[arguments.length - 1];
        const call = () => {script}(...[...arguments].slice(0, -1)).then(done, (error) => done(String(error)));
        const run = () => window.ready ? call() : setTimeout(run, 20);
        run();"""
    found = driver.execute_async_script(waiting, *arguments)
    assert isinstance(found, dict), found
    return {
        name: np.stack([np.frombuffer(base64.b64decode(each), np.float32).reshape(-1, 3) for each in frames])
        for name, frames in found.items()
    }

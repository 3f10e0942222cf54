"""Firefox without a window, spoken to by WebDriver BiDi, which it knows without a driver beside it."""

import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

FIREFOX = next(filter(None, map(shutil.which, ("firefox-esr", "firefox"))), None)
SETTINGS = {
    "ui.prefersReducedMotion": 1,
    "dom.max_script_run_time": 0,
    "datareporting.policy.dataSubmissionEnabled": False,
    "webgl.force-enabled": True,  # by the processor, where there is no graphics card
    "gfx.x11-egl.force-enabled": True,
}


class Firefox:
    """One tab, by the two words of a selenium driver that tests of pages use.

    Args:
        socket: The connection to the browser.
    """

    def __init__(self, socket):
        self.socket, self.asked = socket, 0
        self._ask("session.new", capabilities={})
        self.tab = self._ask("browsingContext.getTree")["contexts"][0]["context"]

    def get(self, address: str) -> None:
        """Open a page, to its end."""
        self._ask("browsingContext.navigate", context=self.tab, url=address, wait="complete")

    def execute_script(self, script: str, *given) -> Any:
        """What the body of a function returns; it and what is given go as JSON."""
        text = f"JSON.stringify((function () {{ {script} }})(...{json.dumps(given)}) ?? null)"
        told = self._ask("script.evaluate", expression=text, target={"context": self.tab}, awaitPromise=False)
        assert told["type"] == "success", told["exceptionDetails"]["text"]
        return json.loads(told["result"]["value"])

    def _ask(self, method: str, **params) -> dict:
        self.asked += 1
        self.socket.send(json.dumps({"id": self.asked, "method": method, "params": params}))
        while (told := json.loads(self.socket.recv(timeout=300))).get("id") != self.asked:
            pass
        assert told["type"] == "success", told
        return told["result"]


@contextmanager
def firefox() -> Iterator[Firefox]:
    """A browser, or a skip that says what is missing."""
    client = pytest.importorskip("websockets.sync.client", reason="websockets is not installed: it comes with viser")
    if FIREFOX is None:
        pytest.skip("Firefox is not installed (Debian: apt install firefox-esr)")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in SETTINGS.items()]
        (Path(profile) / "user.js").write_text("".join(lines))
        command = [FIREFOX, "--headless", "--no-remote", "--profile", profile, "--remote-debugging-port", "0"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            assert process.stderr is not None
            found = (re.search(r"BiDi listening on (ws://\S+)", line) for line in process.stderr)
            address = next(filter(None, found))[1]
            with client.connect(f"{address}/session", max_size=None) as socket:
                yield Firefox(socket)
        finally:
            process.terminate()
            process.wait(timeout=30)

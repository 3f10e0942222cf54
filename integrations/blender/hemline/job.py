"""One run of hemline, which works while Blender continues."""

import os
import shutil
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import bpy

from .refused import Refused

FOLDERS: set[Path] = set()
"""Folders that were made since Blender was started; only these are ever removed, whatever a .blend refers to."""


def make_folder() -> Path:
    """Makes a folder for the files of one run."""
    folder = Path(tempfile.mkdtemp(prefix="hemline-", dir=bpy.app.tempdir or None)).resolve()
    FOLDERS.add(folder)
    return folder


def remove_folder(folder: Path) -> None:
    """Removes a folder that `make_folder` made, and no other one."""
    if folder in FOLDERS:
        shutil.rmtree(folder, ignore_errors=True)


class Job:
    """A run of the program, whose output threads read.

    Args:
        program: Path of hemline.
        words: Words of the command.
        folder: Folder of its files, which `clear` removes.
        owner: Object that the run is for.
        show: Function that shows the result in the scene, called with the job; it returns words for the user.

    Raises:
        Refused: The program cannot be run.
    """

    def __init__(self, program: str, words: list[str], folder: Path, owner, show):
        self.folder, self.owner, self.show = folder, owner.session_uid, show
        self.messages, self.output = [], ""
        self.stage, self.share, self.stopped = "starting", 0.0, False
        self._first = self._last = (0.0, 0.0)  # time [s] and share at the first and the last report of a stage
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        environment = os.environ | {"HEMLINE_PROGRESS": "lines", "PYTHONUTF8": "1", "NO_COLOR": "1"}
        hidden = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        try:
            self.process = subprocess.Popen(
                [program, *words], **pipes, env=environment, creationflags=hidden, encoding="utf-8", errors="replace"
            )
        except OSError as error:
            raise Refused(f"{program} cannot be run; got {error.strerror or error}; name another one") from error
        self._readers = [threading.Thread(target=read, daemon=True) for read in (self._read_messages, self._read)]
        for reader in self._readers:
            reader.start()

    def _read(self) -> None:
        self.output = self.process.stdout.read()

    def _read_messages(self) -> None:
        for line in self.process.stderr:
            head, _, rest = line.rstrip().partition(": ")
            stage, _, count = rest.rpartition(" ")
            if head == "progress" and "/" in count:
                done, total = (int(each) for each in count.split("/"))
                self._report(stage, done / total if total else 0.0)
            elif line.strip():
                self.messages.append(line.rstrip().replace(f"{self.folder}{os.sep}", ""))

    def _report(self, stage: str, share: float) -> None:
        self._last = time.monotonic(), share
        if stage != self.stage or share < self.share:
            self._first = self._last
        self.stage, self.share = stage, share

    @property
    def is_done(self) -> bool:
        """Whether the program has ended."""
        return self.process.poll() is not None

    @property
    def seconds_left(self) -> float | None:
        """Time until the stage ends at its mean speed so far [s]; None before there is one."""
        (began, first), (reported, share) = self._first, self._last
        if share <= first:
            return None
        left = (1 - share) * (reported - began) / (share - first)
        return max(0.0, left - (time.monotonic() - reported))

    def stop(self) -> None:
        """Ends the program; the scene stays unchanged."""
        self.stopped = True
        self.process.terminate()

    def wait(self) -> None:
        """Waits for the end.

        Raises:
            Refused: The program failed, in its own words, or was stopped.
        """
        status = self.process.wait()
        for reader in self._readers:
            reader.join()
        if self.stopped:
            raise Refused("stopped; nothing was changed")
        if status:
            errors = [line for line in self.messages if line.startswith("hemline: ")]
            raise Refused(
                "\n".join(errors[-1:] or self.messages[-20:]) or f"{self.process.args[0]} ended with status {status}"
            )

    def no_result(self) -> Refused:
        """Returns the error of a program that ended well and wrote something else than hemline does."""
        got = f"{self.process.args[0]}, which said '{self.output.strip()[:80]}'"
        return Refused(f"the program is not hemline; got {got}; name another one in the preferences")

    def clear(self) -> None:
        """Removes the files of the program."""
        remove_folder(self.folder)

"""A process that is killed at each of its steps in turn, as the system kills it: with no chance to tidy up."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

STEPS = ("open", "os.mkdir", "os.rename", "os.chmod", "os.chown", "os.remove", "os.rmdir", "os.listdir", "os.scandir")
RUNNER = f"""
import os, signal, sys

def killed(work, step):
    left = [step]
    def hook(event, _):
        if event in {STEPS!r}:
            left[0] -= 1
            if left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)
    sys.addaudithook(hook)
    work()

def main(work, every):
    for line in sys.stdin:
        step = int(line) * every
        child = os.fork()
        if child == 0:
            killed(work, step)
            os._exit(0)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


def killed_at_each_step(work: str, folder: Path, *, every: int = 1) -> Iterator[int]:
    """Run work again and again, killed one step later each time; after each kill the caller looks at what is there.

    Args:
        work: Python that defines `work()`.
        folder: Where it runs.
        every: How many steps later each time.

    Yields:
        How many times it was killed so far; the last time of all it ran to its end.
    """
    program = f"{RUNNER}\n{work}\nmain(work, {every})"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", program], cwd=folder, text=True, **pipes) as process:
        for step in range(10_000):
            process.stdin.write(f"{step}\n")
            process.stdin.flush()
            status = int(process.stdout.readline())
            yield step
            if status == 0:
                process.stdin.close()
                return
            assert status == -signal.SIGKILL
    raise AssertionError("the work does not end")


def limited(
    program: str, folder: Path, *, before: str = "", most_bytes: int | None = None, most_files: int | None = None
) -> str:
    """Run Python where files can only be so long, as on a full disk, or only so many can be open.

    Args:
        program: What is run so.
        folder: Where it runs.
        before: What is run first, without limits.
        most_bytes: Length of the longest file.
        most_files: How many files can be open at once.

    Returns:
        What it printed.
    """
    lines = [before, "import resource"]
    for name, most in (("RLIMIT_FSIZE", most_bytes), ("RLIMIT_NOFILE", most_files)):
        if most is not None:
            lines.append(f"resource.setrlimit(resource.{name}, ({most}, {most}))")
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", "\n".join([*lines, program])]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout

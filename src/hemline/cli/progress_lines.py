"""Progress as lines on stderr, where no bar can be drawn: for programs that call hemline, and for logs."""

import sys
import time
from dataclasses import dataclass, field

FIRST_S, BETWEEN_S = 5.0, 20.0
"""Time of the first line of a log, and between two lines [s]."""
LEAST_PERCENT = 3
"""Least part of the work by which the rest is estimated [%]: the first steps also load and compile."""


@dataclass
class _Progress:
    """A stage of the work."""

    stage: str
    total: int | None
    done: int = 0
    percent: int = -1
    """Percentage at the last change."""
    began: float = field(default_factory=time.monotonic)
    """Time at which it began [s]."""


class ProgressLines:
    """Progress display that prints lines `progress: STAGE DONE/TOTAL`, at most one per percent."""

    def __init__(self) -> None:
        self._tasks: list[_Progress] = []

    def add_task(self, description: str, total: int | None = None, visible: bool = True) -> int:
        """Adds a task and returns its number."""
        self._tasks.append(_Progress(description, total))
        return len(self._tasks) - 1

    def advance(self, task: int) -> None:
        """Counts one more step of a task."""
        self.update(task, completed=self._tasks[task].done + 1)

    def update(
        self,
        task: int,
        completed: int,
        total: int | None = None,
        visible: bool = True,
        description: str | None = None,
    ) -> None:
        """Sets the number of steps done, and prints a line if it is time for one."""
        each = self._tasks[task]
        each.stage, each.done, each.total = description or each.stage, completed, total or each.total
        if each.total:
            percent, before = 100 * completed // each.total, each.percent
            each.percent = percent
            if percent != before:
                self._print(each)

    def _print(self, task: _Progress) -> None:
        _say(f"progress: {task.stage} {task.done}/{task.total}")


class LogLines(ProgressLines):
    """Progress display that prints a line with the time left now and then, and none for short work."""

    def __init__(self) -> None:
        super().__init__()
        self._next = time.monotonic() + FIRST_S

    def _print(self, task: _Progress) -> None:
        now = time.monotonic()
        if now < self._next or not task.done or task.done == task.total:
            return
        self._next = now + BETWEEN_S
        assert task.total is not None
        left = (now - task.began) * (task.total - task.done) / task.done
        known = f", {time_left(left)} left" if task.percent >= LEAST_PERCENT else ""
        _say(f"{task.stage}: {task.percent} %{known}")


def time_left(seconds: float) -> str:
    """Formats a time as seconds or minutes, such as `40 s` or `12 min`."""
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)

"""Tells how much of the time of a run is left."""

from collections.abc import Callable
from dataclasses import dataclass

from hemline.animators import Progress

from .work_folder import WorkFolder


class OutOfTime(Exception):
    """A step was stopped because it took longer than it may."""


@dataclass
class Clock:
    """The time of a run.

    Attributes:
        total_s: Time that the run may take [s].
        work: Folder that counts the time spent.
        say: Called with a line of text.
    """

    total_s: float
    work: WorkFolder
    say: Callable[[str], None]

    @property
    def remaining_s(self) -> float:
        """Time that is left [s]; negative once the run takes longer than it may."""
        return self.total_s - self.work.spent_s

    def begin(self, step: str, expected_s: float | None) -> None:
        """Says which step begins, how long it will take, and how much time is left.

        Args:
            step: What is done, such as "simulating two clips".
            expected_s: Time that the step is expected to take [s]; None if that is not known.
        """
        self.work.note()
        expected = "" if expected_s is None else f", about {time_text(expected_s)}"
        left = (
            f"{time_text(self.remaining_s)} left"
            if self.remaining_s > 0
            else "over the time by " + time_text(-self.remaining_s)
        )
        self.say(f"{step[0].upper()}{step[1:]}{expected} ({left}).")

    def stop_late(self, progress: Progress, seconds: float) -> Progress:
        """Returns a progress function that stops the step which calls it once this much time has passed.

        Args:
            progress: The function that is called until then.
            seconds: Time that the step may take from now [s].

        Raises:
            OutOfTime: By the returned function, when the time is over.
        """
        end = self.work.spent_s + seconds

        def report(stage: str, done: int, total: int) -> None:
            progress(stage, done, total)
            if self.work.spent_s > end:
                raise OutOfTime(stage)

        return report


def time_text(seconds: float) -> str:
    """Returns a time as text, such as "40 s", "12 min" or "3.5 h"."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"

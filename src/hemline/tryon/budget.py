"""Limits the processor time of a try-on, and says how far it came."""

import time

from hemline.errors import BadGarment

SECONDS = 80.0
"""Processor time that a try-on may take by default [s]."""


class Budget:
    """Processor time that is left for a try-on.

    Args:
        name: Name of the garment in the message.
        seconds: Processor time that it may take; infinite for no limit [s].
    """

    def __init__(self, name: str, seconds: float):
        self.name, self.seconds, self.began = name, seconds, time.process_time()

    def check(self, done: str) -> None:
        """Raises if the time is used up.

        Args:
            done: What was done so far.

        Raises:
            BadGarment: It is.
        """
        if time.process_time() - self.began > self.seconds:
            what = f"{self.name} was not put on within {self.seconds:.0f} s of processor time"
            cure = "give it more time (hemline tryon --seconds 600), or reduce its mesh"
            raise BadGarment(what, done, cure)

"""Measures how many cores other programs leave free.

Threads of one loop wait for each other, so a thread whose core is busy delays all of them. The number of threads is
therefore lowered while other programs run. Results do not depend on it.
"""

import os
import threading
import time
from pathlib import Path

STAT = Path("/proc/stat")
"""File in which Linux reports how long its cores have been busy."""
PERIOD = 0.5
"""Time between two measurements [s]."""


class OtherWork:
    """Measures how busy other programs keep this machine; if the system does not tell, they count as idle.

    Args:
        cores: Number of cores of the machine.
        stat: The file to read.
    """

    def __init__(self, cores: int, stat: Path = STAT):
        self._cores, self._stat = cores, stat
        self._lock = threading.Lock()
        self._moment, self._before = -PERIOD, (0.0, 0.0, 0.0)
        self._free = cores

    def free_cores(self) -> int:
        """Returns the cores that other programs left free in the last half second or more, at least 1."""
        moment = time.monotonic()
        if moment - self._moment >= PERIOD and self._lock.acquire(blocking=False):
            try:
                self._measure(moment)
            finally:
                self._lock.release()
        return self._free

    def _measure(self, moment: float) -> None:
        now = (moment, self._busy_seconds(), time.process_time())
        if self._moment >= 0:
            passed, busy, own = (after - before for after, before in zip(now, self._before, strict=True))
            self._free = max(1, min(self._cores, self._cores - round((busy - own) / passed)))
        self._moment, self._before = moment, now

    def _busy_seconds(self) -> float:
        """Returns the busy time of all cores since the machine was started [s]; 0 if the system does not tell."""
        try:
            words = self._stat.read_text().split("\n", 1)[0].split()
            user, nice, system, _, _, *others = map(int, words[1:9])
        except (OSError, ValueError):
            return 0.0
        return (user + nice + system + sum(others)) / os.sysconf("SC_CLK_TCK")

"""How many cores other programs leave free.

Threads of one loop wait for each other, so that a thread whose core is taken holds up all of them. The number of
threads is therefore lowered while other programs run. Results do not depend on it.
"""

import os
import threading
import time
from pathlib import Path

STAT = Path("/proc/stat")
"""Where Linux says how long its cores have been busy."""
PERIOD = 0.5
"""Time from one look to the next [s]."""


class OtherWork:
    """Watches how busy other programs keep this machine; where the system does not say, they count as idle.

    Args:
        cores: Cores of the machine.
        stat: The file to read.
    """

    def __init__(self, cores: int, stat: Path = STAT):
        self._cores, self._stat = cores, stat
        self._lock = threading.Lock()
        self._moment, self._before = -PERIOD, (0.0, 0.0, 0.0)
        self._free = cores

    def free_cores(self) -> int:
        """Cores that other programs left free in the last half second or more, at least 1."""
        moment = time.monotonic()
        if moment - self._moment >= PERIOD and self._lock.acquire(blocking=False):
            try:
                self._look(moment)
            finally:
                self._lock.release()
        return self._free

    def _look(self, moment: float) -> None:
        now = (moment, self._busy_seconds(), time.process_time())
        if self._moment >= 0:
            passed, busy, own = (after - before for after, before in zip(now, self._before, strict=True))
            self._free = max(1, min(self._cores, self._cores - round((busy - own) / passed)))
        self._moment, self._before = moment, now

    def _busy_seconds(self) -> float:
        """Time for which cores have worked since the machine was started, all added up [s]; 0 where nothing says it."""
        try:
            words = self._stat.read_text().split("\n", 1)[0].split()
            user, nice, system, _, _, *others = map(int, words[1:9])
        except (OSError, ValueError):
            return 0.0
        return (user + nice + system + sum(others)) / os.sysconf("SC_CLK_TCK")

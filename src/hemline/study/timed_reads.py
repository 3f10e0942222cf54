"""What arrives over a connection, up to a moment: a request that trickles in does not hold a thread for long."""

import io
import socket
import time


class TimedReads(io.RawIOBase):
    """Reads from a socket until the time is up.

    Args:
        connection: The socket; its own limit of time is set by each read.
        seconds: How long all reads together may take [s].
    """

    def __init__(self, connection: socket.socket, seconds: float):
        self._connection, self._ends = connection, time.monotonic() + seconds

    def readable(self) -> bool:
        """Always."""
        return True

    def readinto(self, buffer) -> int:
        """What has arrived, or comes next.

        Args:
            buffer: Where it is put.

        Raises:
            TimeoutError: The time is up.
        """
        left = self._ends - time.monotonic()
        if left <= 0:
            raise TimeoutError("the request took too long to arrive")
        self._connection.settimeout(left)
        return self._connection.recv_into(buffer)

"""Reads from a connection with a deadline, so that a slow request does not block a thread for long."""

import io
import socket
import time


class TimedReads(io.RawIOBase):
    """Reads from a socket until a deadline.

    Args:
        connection: The socket; each read sets its timeout.
        seconds: Longest time of all reads together [s].
    """

    def __init__(self, connection: socket.socket, seconds: float):
        self._connection, self._ends = connection, time.monotonic() + seconds

    def readable(self) -> bool:
        """Returns True."""
        return True

    def readinto(self, buffer) -> int:
        """Reads bytes that have arrived, or waits for the next ones.

        Args:
            buffer: Buffer for the bytes.

        Raises:
            TimeoutError: The deadline has passed.
        """
        left = self._ends - time.monotonic()
        if left <= 0:
            raise TimeoutError("the request took too long to arrive")
        self._connection.settimeout(left)
        return self._connection.recv_into(buffer)

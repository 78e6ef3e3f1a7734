"""Interface of every byte pipe."""

from __future__ import annotations

from typing import Protocol


class Transport(Protocol):
    """A pipe that carries bytes both ways and keeps their order.

    Attributes
    ----------
    port : str
        The name it was opened by.

    """

    port: str

    def read(self, timeout_s: float) -> bytes:
        """Return what has come, at least a byte; wait for it at most ``timeout_s``.

        ``b""`` means that nothing came, and only that.

        Raises
        ------
        TransportClosed
            If the peer is gone.

        """

    def write(self, data: bytes, timeout_s: float) -> None:
        """Send all of the data.

        Raises
        ------
        TransportClosed
            If the peer is gone; some of the data may have been sent.
        TransportTimeout
            If the pipe did not take it all in ``timeout_s``.

        """

    def close(self) -> None:
        """Close the pipe. Twice is fine."""

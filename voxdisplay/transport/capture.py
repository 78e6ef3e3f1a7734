"""Recording of all bytes that pass through a pipe, with times. Knows no packet.

A capture is text, a JSON object a line. The first names the port: ``{"voxdisplay_capture": 1,
"port": ...}``; another such line follows when a device that had gone away is back. Each other one
is a portion of bytes as it was written or read: ``{"s": seconds since the line that names the port,
"to": "device" or "host", "hex": ...}``.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Final, TextIO

from voxdisplay.transport.base import Transport

VERSION: Final = 1


class Capture:
    """A transport around another one that records what passes.

    Parameters
    ----------
    inner : Transport
        The pipe; it is closed with this one.
    file : text file
        Open for writing. Each portion is flushed, so that what led to a crash can be read.
    clock : callable
        Returns seconds, never going back.

    """

    def __init__(
        self, inner: Transport, file: TextIO, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.port = inner.port
        self._inner = inner
        self._file = file
        self._clock = clock
        self._began_s = clock()
        self._write_line({"voxdisplay_capture": VERSION, "port": self.port})

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        data = self._inner.read(timeout_s)
        if data:
            self._record("host", data)
        return data

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        self._record("device", data)
        self._inner.write(data, timeout_s)

    def close(self) -> None:
        """See `Transport.close`."""
        self._inner.close()

    def _record(self, to: str, data: bytes) -> None:
        seconds = round(self._clock() - self._began_s, 6)
        self._write_line({"s": seconds, "to": to, "hex": data.hex()})

    def _write_line(self, entry: dict[str, object]) -> None:
        self._file.write(json.dumps(entry) + "\n")
        self._file.flush()

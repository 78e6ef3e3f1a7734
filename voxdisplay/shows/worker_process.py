"""Process that draws and encodes frames of shows, beside the one that plays them.

A new interpreter, not a fork: threads and locks of the player are not inherited, and its main
program is not run again. It ends when the player closes its input, or has ended. Must not know
displays.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from typing import IO, Any, Final, Self, TypeAlias

from voxdisplay.frame import Frame
from voxdisplay.shows.show import EncodedFrame, Show

Encoding: TypeAlias = tuple[int, tuple[str, ...], float]
"""For a device and its line: longest payload, features, and bytes per second."""

_SIZE: Final = struct.Struct("<Q")
_CLOSE_S: Final = 2.0


class WorkerProcess:
    """A process that prepares frames in the order of the requests.

    Parameters
    ----------
    process : Popen
    data : sequence of bytes
        What it is to be told first.

    Attributes
    ----------
    ready : bool
        True when it has loaded the shows.
    ended : bool
        True when it has ended by itself, or cannot load the shows.

    """

    def __init__(self, process: subprocess.Popen[bytes], data: Sequence[bytes]) -> None:
        self.ready = self.ended = False
        self._process = process
        self._replies: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._serve, args=(data,), daemon=True)
        self._reader.start()

    @classmethod
    def start(cls, shows: Sequence[Show]) -> Self | None:
        """Start a process; None if the shows cannot be sent to one, or there can be none."""
        try:
            data = pickle.dumps(tuple(shows))
        except Exception:  # noqa: BLE001 - pickle raises whatever a class does
            return None
        group: dict[str, Any] = {"process_group": 0}  # Ctrl-C is for the player
        if sys.platform == "win32":
            group = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
        try:
            process = subprocess.Popen(  # noqa: S603 - this very interpreter
                [sys.executable, "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                **group,
            )
        except OSError:
            return None
        return cls(process, (pickle.dumps(sys.path), data))

    def _serve(self, first: Sequence[bytes]) -> None:
        for data in first:  # more than a pipe holds: the process has to start first
            self._send(data)
        assert self._process.stdout is not None  # noqa: S101 - a pipe
        with contextlib.suppress(OSError, ValueError):  # it was closed meanwhile
            while (reply := _receive(self._process.stdout)) is not None:
                self._replies.put(reply)
        self._replies.put(None)

    def _send(self, data: bytes) -> None:
        assert self._process.stdin is not None  # noqa: S101 - a pipe
        with contextlib.suppress(OSError):  # it has ended: `results` finds that out
            self._process.stdin.write(_SIZE.pack(len(data)) + data)
            self._process.stdin.flush()

    def request(self, key: int, show: int, number: int, encoding: Encoding) -> None:
        """Request a frame.

        Parameters
        ----------
        key : int
            Comes back with the result.
        show : int
            Index of the show.
        number : int
            Of the frame.
        encoding : tuple

        """
        self._send(pickle.dumps((key, show, number, encoding)))

    def results(self) -> Iterator[tuple[int, EncodedFrame, float]]:
        """Yield what is ready: key, frame, and the seconds it took.

        Raises
        ------
        Exception
            That which a show has raised.

        """
        while True:
            try:
                data = self._replies.get_nowait()
            except queue.Empty:
                return
            if data is None:
                self.ended = True
                return
            reply = pickle.loads(data)  # noqa: S301 - of our own process
            if reply is None:
                self.ready = True
            elif isinstance(reply, BaseException):
                raise reply
            else:
                yield reply

    def close(self) -> None:
        """End the process. Twice is fine."""
        assert self._process.stdin is not None  # noqa: S101 - a pipe
        assert self._process.stdout is not None  # noqa: S101
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(_CLOSE_S)
        except subprocess.TimeoutExpired:  # in the middle of a frame
            self._process.kill()
            self._process.wait()
        self._reader.join()
        self._process.stdout.close()


def _receive(stream: IO[bytes]) -> bytes | None:
    """Return the next message; None at the end."""
    head = stream.read(_SIZE.size)
    if len(head) < _SIZE.size:
        return None
    (size,) = _SIZE.unpack(head)
    data = stream.read(size)
    return data if len(data) == size else None


def encode_frame(frame: Frame, encoding: Encoding) -> EncodedFrame:
    """Return a frame as payloads and digest."""
    max_payload, features, bytes_per_s = encoding
    coded = frame.iter_payloads(max_payload, features, bytes_per_s)
    payloads = tuple(payload for some in coded for payload in some)
    return EncodedFrame(payloads, frame.digest(), frame.output_note)


def main() -> None:
    """Prepare frames until the input ends."""
    source = sys.stdin.buffer
    target = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what shows print must not come between

    def reply(value: Any) -> None:
        data = pickle.dumps(value)
        target.write(_SIZE.pack(len(data)) + data)
        target.flush()

    paths, data = _receive(source), _receive(source)
    if paths is None or data is None:
        return
    sys.path[:] = pickle.loads(paths)  # noqa: S301 - of the player
    try:
        shows: tuple[Show, ...] = pickle.loads(data)  # noqa: S301
    except Exception:  # noqa: BLE001 - classes of its main program: the player prepares them itself
        return
    with contextlib.suppress(BrokenPipeError):  # the player has ended
        reply(None)
        while (message := _receive(source)) is not None:
            key, show, number, encoding = pickle.loads(message)  # noqa: S301
            began_s = time.perf_counter()
            try:
                encoded = encode_frame(shows[show].frame(number), encoding)
            except Exception as error:  # noqa: BLE001 - raised again by the player
                reply(_picklable(error))
                continue
            reply((key, encoded, time.perf_counter() - began_s))


def _picklable(error: Exception) -> Exception:
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - of our own
    except Exception:  # noqa: BLE001 - whatever its class does
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


if __name__ == "__main__":
    main()

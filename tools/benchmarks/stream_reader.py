"""Counting device for benchmarks: acknowledges everything, draws nothing, at a given line rate.

It checks every packet, acknowledges, grants credit and reports at once that a frame is on display
(protocol.md, sections 3 to 6 and 9). It understands what a host sends over a lossless pipe: HELLO,
DATA in order, and STATUS. Knows no op, page or fault.
"""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass

from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.packet_stream import PacketStream

_CHUNK = 1 << 16
# A paced line is read in portions of this much time: short beside what the host may have ahead.
_PORTION_S = 0.0005
_MOST_UNANSWERED = 8  # section 9
_MODULUS = 256


class Counting:
    """Device endpoint: bytes in, answers out."""

    def __init__(self, info: packets.Info) -> None:
        self._info = info
        self._stream = PacketStream()
        self._session = 0
        self._taken = 0
        self._unanswered = 0
        self._shown: int | None = None
        self.frames = 0

    def receive(self, data: bytes) -> bytes:
        """Return the answers to some bytes."""
        out = b""
        for packet in self._stream.feed(data):
            match packet:
                case packets.Hello(session=session):
                    self._session, self._taken, self._shown = session, 0, None
                    out += packets.encode(_of_session(self._info, session))
                case packets.Data(seq=seq, flags=flags):
                    if seq != self._taken % _MODULUS:
                        raise ValueError(f"DATA {seq} came instead of {self._taken % _MODULUS}")
                    self._taken += 1
                    self._unanswered += 1
                    if flags & spec.DATA_FLAG_COMMIT:
                        self._shown = packet.frame
                        self.frames += 1
                    if flags & spec.DATA_FLAG_COMMIT or self._unanswered > _MOST_UNANSWERED:
                        out += self._ack()
                case packets.Status(seq=tag):
                    out += self._ack(tag)
        if self._unanswered:
            out += self._ack()
        return out

    def _ack(self, tag: int | None = None) -> bytes:
        self._unanswered = 0
        flags = spec.ACK_FLAG_SHOWN * (self._shown is not None)
        flags |= spec.ACK_FLAG_ASKED * (tag is not None)
        return packets.encode(
            packets.Ack(
                seq=self._taken % _MODULUS, frame=self._shown or 0, flags=flags,
                last=(self._taken - 1) % _MODULUS if tag is None else tag,
                session=self._session, boot=self._info.boot, received=0,
                credit=self._info.rx_buffer, digest=0, damaged=self._stream.counters.damaged,
            )
        )  # fmt: skip


def _of_session(info: packets.Info, session: int) -> packets.Info:
    return packets.Info(
        **{name: getattr(info, name) for name, _, _ in packets.Info.LAYOUT if hasattr(info, name)}
        | {"session": session}
    )


@dataclass
class Heard:
    """Counts of what has come over the line.

    Attributes
    ----------
    bytes, frames : int
    seconds : float
        From the first byte on.

    """

    bytes: int = 0
    frames: int = 0
    seconds: float = 0.0


def serve(
    connection: socket.socket,
    info: packets.Info,
    bytes_per_s: float,
    tell: Callable[[Heard], None],
) -> None:
    """Be the device until the other end is closed.

    A line that is late because this process was kept waiting catches up with what lies there; one
    that lay idle does not.

    Parameters
    ----------
    connection : socket
    info : Info
    bytes_per_s : float
        What the line carries; 0: as much as it can.
    tell : callable
        Is told what has come, after each frame.

    """
    device, heard = Counting(info), Heard()
    portion = max(1, int(bytes_per_s * _PORTION_S)) if bytes_per_s else _CHUNK
    began_s = due_s = 0.0
    while True:
        if not select.select([connection], [], [], 0)[0]:
            select.select([connection], [], [])
            due_s = max(due_s, time.perf_counter())  # it lay idle
        data = connection.recv(portion)
        if not data:
            return
        began_s = began_s or time.perf_counter()
        if bytes_per_s:
            due_s = (due_s or began_s) + len(data) / bytes_per_s
            while (left_s := due_s - time.perf_counter()) > 0:
                time.sleep(left_s)
        answer = device.receive(data)
        if answer:
            connection.sendall(answer)
        heard.bytes += len(data)
        if device.frames > heard.frames:
            heard.frames, heard.seconds = device.frames, time.perf_counter() - began_s
            tell(heard)

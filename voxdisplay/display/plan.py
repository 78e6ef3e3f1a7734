"""Wire cost of a frame before it is sent, and frame rates by line.

Counted on the packets themselves, encoded as they would be for the line and the device. Must not
know ports or sessions; a device is what it announces.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Final, Self

from voxdisplay.display.device_info import DeviceInfo
from voxdisplay.frame import Frame
from voxdisplay.link.payload_size import INITIAL_PAYLOAD, clamp_payload
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.features import select_features
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.op_listing import list_ops

EVERY_FEATURE: Final = tuple(
    name.removeprefix("FEATURE_").lower() for name in vars(spec) if name.startswith("FEATURE_")
)
COMMON_BAUDS: Final = (
    115_200, 230_400, 460_800, 921_600, 1_000_000, 2_000_000, 3_000_000, 6_000_000, 12_000_000,
)  # fmt: skip
_BITS_PER_BYTE: Final = 10  # a start bit, eight, a stop bit


@dataclass(frozen=True, slots=True)
class Line:
    """A line, and its capacity in each direction.

    Attributes
    ----------
    name : str
    bytes_per_s : float

    """

    name: str
    bytes_per_s: float

    @classmethod
    def of_baud(cls, baud: int) -> Line:
        """Return a serial line of 8 data bits, no parity and 1 stop bit."""
        return cls(f"{baud} Bd", baud / _BITS_PER_BYTE)


# Bulk transfers at best, USB 2.0 specification, tables 5-9 and 5-10: 19 packets of 64 bytes in each
# frame of 1 ms, and 13 of 512 bytes in each microframe of 125 us.
USB_LINES: Final = (
    Line("USB full speed", 19 * 64 * 1000.0),
    Line("USB high speed", 13 * 512 * 8000.0),
)
COMMON_LINES: Final = (*map(Line.of_baud, COMMON_BAUDS), *USB_LINES)


@dataclass(frozen=True, slots=True)
class Receiver:
    """Properties of a device that the encoding of frames depends on.

    Attributes
    ----------
    features : tuple of str
        As in `DeviceInfo.features`; by default all.
    payload_bytes : int
        Longest payload that is sent as long as nothing was lost.
    refresh_hz : float
        Refresh ticks, and so frames, per second; 0: no limit.

    """

    features: tuple[str, ...] = EVERY_FEATURE
    payload_bytes: int = INITIAL_PAYLOAD
    refresh_hz: float = 0.0

    @classmethod
    def of_device(cls, info: DeviceInfo) -> Self:
        """Return the properties of a device."""
        longest = clamp_payload(INITIAL_PAYLOAD, info.max_payload_bytes, info.rx_buffer_bytes)
        return cls(info.features, longest, info.refresh_hz)


@dataclass(frozen=True, slots=True)
class OpCost:
    """Occurrences of an op, and the bytes of all of them."""

    count: int
    bytes: int


@dataclass(frozen=True, slots=True)
class Plan:
    """Wire cost of one frame.

    Attributes
    ----------
    line : Line
    receiver : Receiver
        What it was encoded for.
    voxels : int
        Lit voxels.
    packets : int
        DATA packets.
    op_bytes : int
        Bytes of ops, all packets together.
    wire_bytes : int
        Bytes on the wire from host to device: headers, check values and delimiting included.
    answer_bytes : int
        Bytes on the wire from device to host: an ACK for each packet, and one for the swap.
    ops : dict of str to OpCost
        By the ops' names, in the order of protocol.md, section 7.

    """

    line: Line
    receiver: Receiver
    voxels: int
    packets: int
    op_bytes: int
    wire_bytes: int
    answer_bytes: int
    ops: dict[str, OpCost]

    @property
    def seconds(self) -> float:
        """Time for which the line is busy with the frame; both directions are used at once."""
        return max(self.wire_bytes, self.answer_bytes) / self.line.bytes_per_s

    @property
    def frames_per_s(self) -> float:
        """Frame rate that the line and the refresh of the device allow, one frame after another.

        It is an upper limit: a device may take longer to draw a frame than to receive it.
        """
        carried = 1 / self.seconds
        most = self.receiver.refresh_hz
        return min(carried, most) if most else carried


def plan(
    frame: Frame,
    line: Line,
    receiver: Receiver = Receiver(),
    encoded: Sequence[bytes] | None = None,
) -> Plan:
    """Return the wire cost of a frame.

    Parameters
    ----------
    frame : Frame
        Of the display's grid and format.
    line : Line
        The line. The frame is encoded as the driver does when it knows that line.
    receiver : Receiver
        The device.
    encoded : sequence of bytes, optional
        Payloads of the frame, if it is encoded already, as in a recording.

    """
    longest, speed = receiver.payload_bytes, line.bytes_per_s
    if encoded is None:
        coded = frame.iter_payloads(longest, select_features(receiver.features, speed), speed)
        encoded = list(chain.from_iterable(coded))
    payloads = encoded or [b""]
    config = EncoderConfig(frame.grid, frame.format, longest)
    count: Counter[str] = Counter()
    size: Counter[str] = Counter()
    wire_bytes = 0
    for number, payload in enumerate(payloads):
        commit = number == len(payloads) - 1
        flags = spec.DATA_FLAG_CLEAR | commit * spec.DATA_FLAG_COMMIT
        data = packets.Data(seq=number % 256, frame=0, flags=flags, ops=payload)
        wire_bytes += len(packets.encode(data))
        for name, op_bytes in list_ops(payload, config):
            count[name] += 1
            size[name] += op_bytes
    return Plan(
        line=line,
        receiver=receiver,
        voxels=len(frame.lit()[0]),
        packets=len(payloads),
        op_bytes=sum(map(len, payloads)),
        wire_bytes=wire_bytes,
        answer_bytes=(len(payloads) + 1) * _ack_bytes(),
        ops={name: OpCost(count[name], size[name]) for name in sorted(count, key=_op_order)},
    )


def _ack_bytes() -> int:
    ack = packets.Ack(
        flags=0, last=1, session=0x0101, boot=0x0101, received=0x01010101, credit=0x01010101,
        digest=0x01010101, damaged=0x0101,
    )  # fmt: skip
    return len(packets.encode(ack))


def _op_order(name: str) -> int:
    """Return the sort key of an op: its value, as in the table of section 7; unknown ones last."""
    return int(getattr(spec, f"OP_{name}", 256))

"""Incremental parser of a device's responses, which records all that is malformed.

Everything that a device sends, in whatever check, passes here. A packet that is malformed in itself
is recorded under the rule that it breaks, for the checks of ``checks/all_responses``.
"""

from __future__ import annotations

from collections.abc import Iterator

from voxdisplay.conformance import packets
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.credit_limit import CreditLimit
from voxdisplay.conformance.packets import Response
from voxdisplay.wire import spec

_LONGEST_SEGMENT = packets.max_encoded_bytes(spec.LIMIT_MAX_PAYLOAD)
_ACK_WINDOW = (1 << spec.LIMIT_WINDOW - 1) - 1
_MAX_PER_RULE = 5


class ResponseReader:
    """Incremental parser of segments into responses.

    Attributes
    ----------
    device : AnnouncedDevice or None
        Set after the first INFO. Before, nothing is recorded: there may be boot text on the line.
    violations : dict of str to list of str
        The first few violations of each rule, by the rule's name.
    byte_count : int
        Number of bytes received.
    segment_count : int
        Number of segments received that could be packets, damaged ones included.
    credit_limit : CreditLimit
        To be told what is sent.
    """

    def __init__(self) -> None:
        self.device: AnnouncedDevice | None = None
        self.violations: dict[str, list[str]] = {}
        self.byte_count = self.segment_count = 0
        self.credit_limit = CreditLimit()
        self._segment = bytearray()

    def feed(self, come: bytes) -> Iterator[Response]:
        """Take bytes; yield the responses that they complete."""
        self.byte_count += len(come)
        *ended, rest = (bytes(self._segment) + come).split(b"\0")
        self._segment[:] = rest[-_LONGEST_SEGMENT:]
        for segment in ended:
            if answer := self._response(segment):
                yield answer

    def _response(self, segment: bytes) -> Response | None:
        if not segment:
            return None
        self.segment_count += len(segment) >= spec.LIMIT_MIN_SEGMENT
        packet = packets.cobs_decode(segment)
        if len(segment) < spec.LIMIT_MIN_SEGMENT or packet is None:
            self._record("delimited", f"{_hex(segment)} is not COBS of a packet")
            return None
        if packets.cobs_encode(packet) != segment:
            self._record(
                "delimited", f"{_hex(segment)} is not how section 3 encodes {_hex(packet)}"
            )
        inner = packets.decode_segment(segment)
        if inner is None:
            self._record("checked", f"{_hex(packet)} has a wrong check value")
            return None
        answer = Response(inner)
        if not answer.is_complete:
            self._record("whole", f"{_hex(inner)} has no type of a device, or is too short for it")
            return None
        self._check_response(answer)
        if less := self.credit_limit.check(answer):
            self._record("credit", less)
        return answer

    def _check_response(self, answer: Response) -> None:
        device = self.device
        if device is None:
            return
        if len(answer.body) - packets.HEADER_BYTES > device.max_payload:
            self._record("length", f"{answer.kind} of {len(answer.body)} bytes and check value")
        for what in _nonzero_reserved(answer):
            self._record("reserved", f"{what} in {answer}")
        if answer.kind == spec.TYPE_ACK:
            self._check_ack(answer, device)
        elif answer.kind == spec.TYPE_ERROR:
            try:
                answer.tail.decode()
            except UnicodeDecodeError:
                self._record("text", f"text {_hex(answer.tail)} of an ERROR is not UTF-8")

    def _check_ack(self, ack: Response, device: AnnouncedDevice) -> None:
        if ack.boot != device.boot:
            self._record("boot", f"boot id {ack.boot:04X}h in {ack}, {device.boot:04X}h in INFO")
        if ack.frame and not ack.flags & packets.SHOWN:
            self._record("frame", f"frame {ack.frame} without SHOWN in {ack}")
        if ack.digest and not device.has("DIGEST"):
            self._record("digest", f"a digest without DIGEST in {ack}")
        if ack.received & ~_ACK_WINDOW:
            self._record("received", f"a bit for a packet outside the window in {ack}")
        if ack.flags & packets.PENDING and not device.refresh:
            self._record("pending", f"PENDING although swaps happen at once in {ack}")

    def _record(self, rule: str, text: str) -> None:
        if self.device is not None:
            kept = self.violations.setdefault(rule, [])
            if len(kept) < _MAX_PER_RULE and text not in kept:
                kept.append(text)


def _nonzero_reserved(answer: Response) -> Iterator[str]:
    allowed = {
        spec.TYPE_ACK: packets.SHOWN | packets.PENDING | packets.ASKED,
        spec.TYPE_PAGE: packets.BACK,
    }
    if answer.flags & ~allowed.get(answer.kind, 0):
        yield f"reserved flags {answer.flags:X}h"
    if answer.kind == spec.TYPE_INFO and (answer.seq or answer.frame):
        yield f"seq {answer.seq} and frame {answer.frame}"
    if answer.kind in {spec.TYPE_INFO, spec.TYPE_PAGE} and answer.reserved:
        yield f"reserved {answer.reserved}"


def _hex(data: bytes) -> str:
    return data[:40].hex(" ").upper() + (" ..." if len(data) > 40 else "")

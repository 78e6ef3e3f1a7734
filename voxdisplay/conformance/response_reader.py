"""What comes from a device: segments -> answers, and a list of all that breaks the document.

Everything that a device sends, in whatever check, passes here. What is wrong with a packet in
itself is noted by the rule that it breaks, and looked at by the checks of ``checks/answers``.
"""

from __future__ import annotations

from collections.abc import Iterator

from voxdisplay.conformance import packets
from voxdisplay.conformance.announced import Said
from voxdisplay.conformance.packets import Answer
from voxdisplay.wire import spec

_LONGEST_SEGMENT = packets.wire_size(spec.LIMIT_MAX_PAYLOAD)
_ACK_WINDOW = (1 << spec.LIMIT_WINDOW - 1) - 1
_KEPT = 5


class Hearing:
    """An incremental reader of answers.

    Attributes
    ----------
    said : Said or None
        What the device announced; before that, anything may come (a boot text, say).
    faults : dict of str to list of str
        What was wrong, by the name of the rule; of each rule the first few.
    heard : int
        How many bytes came.
    segments : int
        How many segments came that could be packets, damaged ones included.
    """

    def __init__(self) -> None:
        self.said: Said | None = None
        self.faults: dict[str, list[str]] = {}
        self.heard = self.segments = 0
        self._segment = bytearray()

    def feed(self, come: bytes) -> Iterator[Answer]:
        """Take bytes; give the answers that they complete."""
        self.heard += len(come)
        *ended, rest = (bytes(self._segment) + come).split(b"\0")
        self._segment[:] = rest[-_LONGEST_SEGMENT:]
        for segment in ended:
            if answer := self._answer(segment):
                yield answer

    def _answer(self, segment: bytes) -> Answer | None:
        if not segment:
            return None
        self.segments += len(segment) >= spec.LIMIT_MIN_SEGMENT
        packet = packets.unstuff(segment)
        if len(segment) < spec.LIMIT_MIN_SEGMENT or packet is None:
            self._note("delimited", f"{_hex(segment)} is no COBS of a packet")
            return None
        if packets.stuff(packet) != segment:
            self._note("delimited", f"{_hex(segment)} is not how section 3 encodes {_hex(packet)}")
        inner = packets.unwire(segment)
        if inner is None:
            self._note("checked", f"{_hex(packet)} has a wrong check value")
            return None
        answer = Answer(inner)
        if not answer.whole:
            self._note("whole", f"{_hex(inner)} is of no type of a device, or too short for it")
            return None
        self._judge(answer)
        return answer

    def _judge(self, answer: Answer) -> None:
        said = self.said
        if said is None:
            return
        if len(answer.body) - packets.HEADER_BYTES > said.max_payload:
            self._note("length", f"{answer.kind} of {len(answer.body)} bytes and check value")
        for what in _reserved(answer):
            self._note("reserved", f"{what} in {answer}")
        if answer.kind == spec.TYPE_ACK:
            self._judge_ack(answer, said)
        elif answer.kind == spec.TYPE_ERROR:
            try:
                answer.tail.decode()
            except UnicodeDecodeError:
                self._note("text", f"text {_hex(answer.tail)} of an ERROR is no UTF-8")

    def _judge_ack(self, ack: Answer, said: Said) -> None:
        if ack.boot != said.boot:
            self._note("boot", f"boot id {ack.boot:04X}h in {ack}, {said.boot:04X}h in INFO")
        if ack.frame and not ack.flags & packets.SHOWN:
            self._note("frame", f"frame {ack.frame} without SHOWN in {ack}")
        if ack.digest and not said.has("DIGEST"):
            self._note("digest", f"a digest without DIGEST in {ack}")
        if ack.received & ~_ACK_WINDOW:
            self._note("received", f"a bit for a packet outside the window in {ack}")
        if ack.flags & packets.PENDING and not said.refresh:
            self._note("pending", f"PENDING although swaps happen at once in {ack}")

    def _note(self, rule: str, text: str) -> None:
        if self.said is not None:
            kept = self.faults.setdefault(rule, [])
            if len(kept) < _KEPT and text not in kept:
                kept.append(text)


def _reserved(answer: Answer) -> Iterator[str]:
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

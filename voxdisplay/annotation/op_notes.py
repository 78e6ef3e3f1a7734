"""One line per op of a payload, noted by the reference decoder while it draws.

Knows packets by their payloads alone, and no rule but those of section 7 of protocol.md.
"""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.conformance import packets
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.reference_decoder import ReferenceDecoder
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

_OPS = {
    spec.OP_END: "END",
    spec.OP_PEN: "PEN",
    spec.OP_MOVE: "MOVE",
    spec.OP_LINE: "LINE",
    spec.OP_BOX: "BOX",
    spec.OP_DOTS: "DOTS",
    spec.OP_COLORS: "COLORS",
    spec.OP_HOLD: "HOLD",
    spec.OP_FADE: "FADE",
    spec.OP_RAMP: "RAMP",
    spec.OP_ARC: "ARC",
    spec.OP_ARC2: "ARC2",
    spec.OP_SLABS: "SLABS",
    spec.OP_VALUES: "VALUES",
}
# Ops whose low five bits hold an operand.
_OPS_WITH_OPERAND = {
    spec.OP_STEP: "STEP",
    spec.OP_FROM: "FROM",
    spec.OP_OCT: "OCT",
    spec.OP_SKIP: "SKIP",
    spec.OP_RUN: "RUN",
    spec.OP_LIT: "LIT",
    spec.OP_DIFF: "DIFF",
}


@dataclass(frozen=True)
class Remark:
    """A remark on a packet.

    Attributes
    ----------
    text : str
    section : str
        Section of protocol.md that the packet violates; empty if it violates none.

    """

    text: str
    section: str = ""


def op_name(op: int) -> str:
    """Return the name of an op byte."""
    return _OPS.get(op) or _OPS_WITH_OPERAND.get(op & 0xE0, "") or f"op {op:02X}"


class AnnotatingDecoder(ReferenceDecoder):
    """Reference decoder that notes each op as it draws.

    Attributes
    ----------
    remarks : list of Remark
        One for each op.
    written : dict of int to int
        Pixel values by scan-order index.
    used : set of int
        Op bytes that occurred, without their operands' bits.

    """

    def __init__(self, device: AnnouncedDevice) -> None:
        super().__init__(device, _RecordingPage(self))
        self.remarks: list[Remark] = []
        self.written: dict[int, int] = {}
        self.used: set[int] = set()
        self._drawn = 0

    def _op(self, op: int) -> None:
        at, pen, self._drawn = self._op_at, self.pen, 0
        super()._op(op)
        self.used.add(op if op in _OPS else op & 0xE0)
        text = f"{at + packets.HEADER_BYTES:>5}  {self._describe_op(op, at, pen)}"
        self.remarks.append(Remark(text))

    def _describe_op(self, op: int, at: int, pen: int) -> str:
        operands = self._payload[at + 1 : self._at]
        words = [f"{op_name(op):6}"]
        if op & 0xE0 in {spec.OP_STEP, spec.OP_FROM} and op not in _OPS:
            main, signs = self.axes_of(op & 0x1F)
            words.append("".join("-+"[sign > 0] + "xyz"[axis] for axis, sign in enumerate(signs)))
            words.append(f"by {'xyz'[main]},")
        elif op & 0xE0 == spec.OP_OCT:
            words.append(f"side {1 << (op & 0x1F)},")
        if op == spec.OP_HOLD:
            words.append(f"{operands[0]} ticks,")
        if op in {spec.OP_PEN, spec.OP_COLORS, spec.OP_FADE, spec.OP_RAMP}:
            words.append(operands[:16].hex(" ") + (" ..." if len(operands) > 16 else ""))
        if self._drawn:
            words.append(f"{self._drawn} voxels,")
        if self.pen != pen and op != spec.OP_PEN:
            words.append(f"pen {self.pen:X}h,")
        if op != spec.OP_END:
            words.append(f"cursor {self._cursor_text()}")
        return " ".join(words)

    def _cursor_text(self) -> str:
        if self.cursor >= self.device.voxel_count:
            return "past the end"
        return "({}, {}, {})".format(*self.device.voxel_at(self.cursor))

    def record_write(self, index: int, value: int) -> None:
        """Record a voxel that is written."""
        self.written[index] = value
        self._drawn += 1


class _RecordingPage(Page):
    """A page that reports each write to its decoder."""

    def __init__(self, decoder: AnnotatingDecoder) -> None:
        super().__init__()
        self._decoder = decoder

    def write(self, index: int, value: int) -> None:
        """See `Page.write`."""
        super().write(index, value)
        self._decoder.record_write(index, value)

"""Annotated segments of a capture: packet descriptions with remarks. Knows no file.

A capture is read from the host's end of the line: what was sent may have been lost, and what was
received may be damaged.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from voxdisplay.annotation.capture_file import Portion, Segment, split_segments
from voxdisplay.annotation.line_monitor import LineMonitor
from voxdisplay.annotation.op_notes import Remark
from voxdisplay.conformance import packets
from voxdisplay.wire import spec


@dataclass
class AnnotatedSegment:
    """A segment with its description.

    Attributes
    ----------
    segment : Segment
    description : str
        Type and fields of the packet, or why it is none.
    body : bytes or None
        Header and payload; None if it is no packet.
    remarks : list of Remark

    """

    segment: Segment
    description: str
    body: bytes | None
    remarks: list[Remark]

    @property
    def is_violation(self) -> bool:
        """True if something of it violates protocol.md."""
        return any(remark.section for remark in self.remarks)

    def json(self) -> dict[str, Any]:
        """Return the keys that ``annotate --json`` prints of a segment."""
        segment = self.segment
        return {
            "s": segment.seconds if segment.is_terminated else None,
            "to": segment.to,
            "offset": segment.offset,
            "wire_bytes": len(segment.data) + 1,
            "what": self.description,
            "packet": None if self.body is None else self.body.hex(),
            "notes": [
                {"section": remark.section or None, "text": remark.text} for remark in self.remarks
            ],
        }


def annotate(portions: Iterable[Portion]) -> Iterator[AnnotatedSegment]:
    """Yield each segment that is not empty, annotated."""
    monitor = LineMonitor()
    for segment in split_segments(portions):
        if not segment.data:
            monitor.delimiter(segment.to)
            continue
        whole = segment.is_terminated and len(segment.data) >= spec.LIMIT_MIN_SEGMENT
        body = packets.decode_segment(segment.data) if whole else None
        if body is not None:
            remarks = monitor.packet(segment.to, body, len(segment.data) + 1)
            yield AnnotatedSegment(segment, packets.describe(body), body, remarks)
        else:
            remarks = monitor.noise(segment.to, segment.data)
            yield AnnotatedSegment(segment, _describe_noise(segment), None, remarks)


def _describe_noise(segment: Segment) -> str:
    size = len(segment.data)
    if not segment.is_terminated:
        return f"{size} bytes without an end"
    if size < spec.LIMIT_MIN_SEGMENT:
        return f"{size} bytes that are no packet"
    return f"a damaged segment of {size} bytes"

"""Explains a capture, packet by packet and op by op, and says where it breaks protocol.md.

``voxdisplay push SCENE --capture FILE`` writes a capture. It is read as by somebody who sits at the
host's end of the line: what was sent may have been lost, and what was heard may be damaged. Ops are
read with the plain decoder of the conformance kit, which tells what each frame must show.

    python tools/annotate.py capture.jsonl            all packets, with their ops
    python tools/annotate.py capture.jsonl --brief    a line a packet
    python tools/annotate.py capture.jsonl --json     an object a packet
    python tools/annotate.py capture.jsonl --quiet    only what breaks protocol.md

Exit codes: 0 nothing breaks it, 1 something does, 2 the file is no capture.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from annotate_ops import Note
from annotate_rules import Monitor

from voxdisplay.conformance import packets
from voxdisplay.transport.capture import VERSION
from voxdisplay.wire import spec

HOST, DEVICE = "host", "device"
_SHORTENED = 48  # bytes of hex that are shown of a packet


class NoCapture(Exception):  # noqa: N818 - what the file is
    """The file is no capture; the message says where and why."""


@dataclass
class Portion:
    """Bytes as they were written or read."""

    seconds: float
    to: str
    data: bytes


@dataclass
class Segment:
    """What stands between two 00 of one direction, and where it begins in that stream."""

    seconds: float
    to: str
    at: int
    data: bytes


def read_capture(path: Path) -> Iterator[Portion]:
    """Give the portions of a capture file."""
    with path.open(encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            try:
                entry = json.loads(line)
                if number == 1 or "voxdisplay_capture" in entry:
                    if entry["voxdisplay_capture"] != VERSION:
                        raise NoCapture(f"{path}: a capture of another version")
                    continue
                to = {HOST: HOST, DEVICE: DEVICE}[entry["to"]]
                yield Portion(float(entry["s"]), to, bytes.fromhex(entry["hex"]))
            except (ValueError, KeyError, TypeError) as error:
                raise NoCapture(
                    f"{path}, line {number}: not a line of a capture: {error}"
                ) from error


@dataclass
class _Stream:
    """One direction, cut at its 00."""

    at: int = 0
    held: bytearray = field(default_factory=bytearray)

    def feed(self, portion: Portion) -> Iterator[Segment]:
        self.held += portion.data
        *whole, rest = bytes(self.held).split(b"\0")
        for data in whole:
            yield Segment(portion.seconds, portion.to, self.at, data)
            self.at += len(data) + 1
        self.held = bytearray(rest)


def segments(portions: Iterator[Portion]) -> Iterator[Segment]:
    """Cut both directions into segments, in the order of time."""
    streams = {HOST: _Stream(), DEVICE: _Stream()}
    for portion in portions:
        yield from streams[portion.to].feed(portion)
    for to, stream in streams.items():
        if stream.held:
            yield Segment(float("inf"), to, stream.at, bytes(stream.held))


@dataclass
class Explained:
    """A segment, what it is, and what is to be said of it."""

    segment: Segment
    what: str
    body: bytes | None
    notes: list[Note]

    @property
    def breaks(self) -> bool:
        """Whether something of it breaks protocol.md."""
        return any(note.section for note in self.notes)

    def as_json(self) -> dict[str, Any]:
        """Give it for a script."""
        return {
            "s": None if self.segment.seconds == float("inf") else self.segment.seconds,
            "to": self.segment.to,
            "offset": self.segment.at,
            "wire_bytes": len(self.segment.data) + 1,
            "what": self.what,
            "packet": None if self.body is None else self.body.hex(),
            "notes": [{"section": note.section or None, "text": note.text} for note in self.notes],
        }


def explain(capture: Iterator[Portion]) -> Iterator[Explained]:
    """Explain each segment that is more than nothing."""
    monitor = Monitor()
    for segment in segments(capture):
        if not segment.data:
            monitor.delimiter(segment.to)
            continue
        ended = segment.seconds != float("inf")
        body = packets.decode_segment(segment.data) if ended and len(segment.data) >= 8 else None
        if body is not None:
            notes = monitor.packet(segment.to, body, len(segment.data) + 1)
            yield Explained(segment, packets.describe(body), body, notes)
        else:
            what = _what_it_is(segment.data, ended=ended)
            yield Explained(segment, what, None, monitor.noise(segment.to, segment.data))


def _what_it_is(data: bytes, *, ended: bool) -> str:
    if not ended:
        return f"{len(data)} bytes without an end"
    if len(data) < spec.LIMIT_MIN_SEGMENT:
        return f"{len(data)} bytes that are no packet"
    return f"a damaged segment of {len(data)} bytes"


def show(explained: Explained, *, brief: bool) -> None:
    """Print one segment for a person."""
    segment = explained.segment
    arrow = "->" if segment.to == DEVICE else "<-"
    when = "   the end" if segment.seconds == float("inf") else f"{segment.seconds:10.6f}"
    print(f"{when} {arrow} {segment.at:>8}  {explained.what}  ({len(segment.data) + 1} bytes)")
    if explained.body is None:
        text = segment.data[:_SHORTENED]
        print(f"{'':24}{text.hex(' ')}{' ...' if len(segment.data) > len(text) else ''}  {text!r}")
    for note in explained.notes:
        if note.section:
            print(f"{'':24}!! section {note.section}: {note.text}")
        elif not brief:
            print(f"{'':24}{note.text}")


def main() -> int:
    """Explain a file; give 1 if something in it breaks protocol.md."""
    parser = argparse.ArgumentParser(
        description=(__doc__ or "").splitlines()[0],
        epilog="exit codes: 0 nothing breaks protocol.md, 1 something does, 2 no capture",
    )
    parser.add_argument("capture", type=Path, help="what push --capture has written")
    parser.add_argument("--brief", action="store_true", help="a line a packet, without its ops")
    parser.add_argument("--quiet", action="store_true", help="only what breaks protocol.md")
    parser.add_argument("--json", action="store_true", help="an object a line")
    options = parser.parse_args()
    broken = packets_seen = 0
    try:
        for explained in explain(read_capture(options.capture)):
            packets_seen += explained.body is not None
            broken += explained.breaks
            if options.quiet and not explained.breaks:
                continue
            if options.json:
                print(json.dumps(explained.as_json()))
            else:
                show(explained, brief=options.brief or options.quiet)
    except (NoCapture, OSError) as error:
        print(f"annotate: {error}", file=sys.stderr)
        return 2
    if not options.json:
        verdict = f"{broken} of them break protocol.md" if broken else "nothing breaks protocol.md"
        print(f"{packets_seen} packets; {verdict}")
    return bool(broken)


if __name__ == "__main__":
    sys.exit(main())

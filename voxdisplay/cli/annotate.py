"""``voxdisplay annotate``: a capture explained packet by packet and op by op."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from voxdisplay.cli.options import json_option
from voxdisplay.cli.output import plural, print_json, print_stdout
from voxdisplay.printable_text import printable

if TYPE_CHECKING:
    from voxdisplay.annotation.annotate import AnnotatedSegment

_EXIT_VIOLATION: Final = 1
_MAX_HEX_BYTES: Final = 48  # of a segment that is no packet


@click.command(
    epilog="""\b
    Examples:
      voxdisplay push curve.json --port /dev/ttyUSB0 --capture log.jsonl
      voxdisplay annotate log.jsonl
      voxdisplay annotate log.jsonl --violations

    Exit codes: 0 nothing violates protocol.md; 1 something does; 2 the file is no capture."""
)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--brief", is_flag=True, help="Print one line per packet, without its ops.")
@click.option("--violations", is_flag=True, help="Print only packets that violate protocol.md.")
@json_option
def annotate(*, file: Path, brief: bool, violations: bool, as_json: bool) -> None:
    """Explain FILE, a capture that push --capture has written, packet by packet and op by op.

    A packet that violates protocol.md is marked by !! and the section. The capture is read as from
    the host's end of the line: what was sent may have been lost, what was received may be damaged.
    """
    from voxdisplay.annotation.annotate import annotate as annotated  # noqa: PLC0415
    from voxdisplay.annotation.capture_file import CaptureError, read_portions  # noqa: PLC0415

    packets = violating = 0
    rows = []
    try:
        for segment in annotated(read_portions(file)):
            packets += segment.body is not None
            violating += segment.is_violation
            if violations and not segment.is_violation:
                continue
            if as_json:
                rows.append(segment.json())
            else:
                _print_segment(segment, with_ops=not (brief or violations))
    except CaptureError as failure:
        raise click.ClickException(str(failure)) from failure
    except OSError as failure:
        raise click.ClickException(f"cannot read {file}: {failure.strerror}") from failure
    if as_json:
        print_json({"packets": packets, "violations": violating, "segments": rows})
    else:
        found = f"{violating} of them violate" if violating else "nothing violates"
        print_stdout(f"{plural(packets, 'packet')}; {found} protocol.md")
    if violating:
        raise click.exceptions.Exit(_EXIT_VIOLATION)


def _print_segment(annotated: AnnotatedSegment, *, with_ops: bool) -> None:
    from voxdisplay.annotation.capture_file import DEVICE  # noqa: PLC0415

    segment = annotated.segment
    arrow = "->" if segment.to == DEVICE else "<-"
    when = f"{segment.seconds:10.6f}" if segment.is_terminated else "   the end"
    size = len(segment.data) + 1
    print_stdout(
        f"{when} {arrow} {segment.offset:>8}  {printable(annotated.description)}  ({size} bytes)"
    )
    if annotated.body is None:
        data = segment.data[:_MAX_HEX_BYTES]
        more = " ..." if len(segment.data) > len(data) else ""
        print_stdout(f"{'':24}{data.hex(' ')}{more}  {data!r}")
    for remark in annotated.remarks:
        if remark.section:
            print_stdout(f"{'':24}!! section {remark.section}: {printable(remark.text)}")
        elif with_ops:
            print_stdout(f"{'':24}{printable(remark.text)}")

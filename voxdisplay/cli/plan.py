"""``voxdisplay plan``: what a scene will cost on the wire, before there is a display."""

from __future__ import annotations

from typing import Any, Literal

import click

import voxdisplay as vd
from voxdisplay.cli.options import SizeType, fit_option, json_option, note, plural, print_json
from voxdisplay.cli.scenes import draw
from voxdisplay.plan import COMMON_LINES, TYPICAL_MAX_PAYLOAD, Line, Plan, plan

_DEFAULT_GRID = vd.Grid(128, 128, 128)
_MANY = 10_000  # frames a second, from which on the line is not what limits them


@click.command(
    name="plan",
    epilog="""\b
    Examples:
      voxdisplay plan curve.json
      voxdisplay plan curve.json --baud 921600 --size 64x64x64 --format mono1
      voxdisplay plan curve.json --port /dev/ttyUSB0 --json
    """,
)
@click.argument("scene", type=click.Path())
@click.option(
    "--port",
    "-p",
    metavar="PORT",
    help="Ask this display for its size, format, longest packet and refresh rate.",
)
@click.option(
    "--baud",
    type=click.IntRange(min=50),
    metavar="RATE",
    help="Bits per second of a serial line.  [default: all common rates, and USB]",
)
@click.option(
    "--size",
    type=SizeType(),
    metavar="NX,NY,NZ",
    help="Size of the display.  [default: the port's, else the scene's, else 128,128,128]",
)
@click.option(
    "--format",
    "format_",
    type=click.Choice([format_.value for format_ in vd.PixelFormat]),
    help="Pixel format of the display.  [default: the port's, else rgb888]",
)
@fit_option
@json_option
def plan_command(
    *,
    scene: str,
    port: str | None,
    baud: int | None,
    size: vd.Grid | None,
    format_: str | None,
    fit: Literal["contain", "none"],
    as_json: bool,
) -> None:
    """Say how many packets and bytes SCENE takes, and how many a second a line carries.

    SCENE is a JSON file, or - for stdin. Nothing is shown.
    """
    loaded = vd.load_scene(scene)
    grid, kind = loaded.size or _DEFAULT_GRID, "rgb888"
    max_payload, refresh_hz = TYPICAL_MAX_PAYLOAD, 0.0
    if port:
        with vd.open(port, baud=baud or 115200) as display:
            said = display.info
        grid, kind = said.grid, said.format.value
        max_payload, refresh_hz = said.max_payload_bytes, said.refresh_hz
    frame = vd.Frame(size or grid, format_ or kind)
    fitted, remark = loaded.fitted(frame.grid, fit)
    if remark:
        note(remark)
    draw(fitted, frame)
    cost = plan(frame, max_payload)
    lines = (Line.serial(baud),) if baud else COMMON_LINES
    if as_json:
        print_json(_facts(frame, cost, lines, max_payload, refresh_hz))
    else:
        click.echo(_table(frame, cost, lines, refresh_hz))


def _facts(
    frame: vd.Frame, cost: Plan, lines: tuple[Line, ...], max_payload: int, refresh_hz: float
) -> dict[str, Any]:
    return {
        "size": list(frame.grid),
        "format": frame.format.value,
        "max_payload_bytes": max_payload,
        "refresh_hz": refresh_hz or None,
        "voxels": cost.voxels,
        "packets": cost.packets,
        "op_bytes": cost.op_bytes,
        "wire_bytes": cost.wire_bytes,
        "answer_bytes": cost.answer_bytes,
        "ops": {name: {"count": op.count, "bytes": op.bytes} for name, op in cost.ops.items()},
        "lines": [
            {
                "line": line.name,
                "bytes_per_s": line.bytes_per_s,
                "frame_s": cost.seconds_on(line),
                "frames_per_s": cost.rate_on(line, refresh_hz),
            }
            for line in lines
        ],
    }


def _table(frame: vd.Frame, cost: Plan, lines: tuple[Line, ...], refresh_hz: float) -> str:
    both = f"{plural(cost.wire_bytes, 'byte')} to it, {plural(cost.answer_bytes, 'byte')} back"
    said = [
        f"{plural(cost.voxels, 'voxel')} on a display of {frame.grid} {frame.format.value}",
        f"{plural(cost.packets, 'packet')}, {both}",
        "",
        f"{'op':<8}{'count':>9}{'bytes':>10}",
    ]
    for name, op in cost.ops.items():
        said.append(f"{name:<8}{op.count:>9}{op.bytes:>10}{op.bytes / cost.op_bytes:>7.0%}")
    rest = cost.wire_bytes - cost.op_bytes
    said += [
        f"{'packing':<8}{'':>9}{rest:>10}   headers, check values, delimiting",
        "",
        f"{'line':<16}{'one frame':>12}{'frames/s':>12}",
    ]
    for line in lines:
        rate = cost.rate_on(line, refresh_hz)
        mark = "  as fast as it is refreshed" if rate == refresh_hz else ""
        said.append(f"{line.name:<16}{_time(cost.seconds_on(line)):>12}{_rate(rate):>12}{mark}")
    return "\n".join(said)


def _time(seconds: float) -> str:
    """Write a time in three figures."""
    unit, size = next(
        ((unit, size) for unit, size in (("s", 1.0), ("ms", 1e-3)) if seconds >= size), ("us", 1e-6)
    )
    value = seconds / size
    return f"{value:.{max(0, 3 - len(str(int(value))))}f} {unit}"


def _rate(frames_per_s: float) -> str:
    if frames_per_s >= _MANY:
        return f"> {_MANY}"
    return f"{frames_per_s:.0f}" if frames_per_s >= 100 else f"{frames_per_s:.3g}"

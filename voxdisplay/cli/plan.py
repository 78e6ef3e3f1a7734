"""``voxdisplay plan``: what a scene will cost on the wire, before there is a display."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Literal

import click

import voxdisplay as vd
from voxdisplay.cli.options import (
    SizeType,
    baud_option,
    complete_port,
    fit_option,
    json_option,
)
from voxdisplay.cli.output import (
    note,
    plural,
    print_json,
)
from voxdisplay.cli.scene_drawing import draw
from voxdisplay.display.baud import DEFAULT_BAUD, Baud, open_at_rate
from voxdisplay.display.plan import COMMON_LINES, EVERY_FEATURE, Line, Plan, Receiver, plan

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

_DEFAULT_GRID = vd.Grid(128, 128, 128)
_TIMEOUT_S = 5.0
_MANY = 10_000  # frames a second, from which on the line is not what limits them


class FeaturesType(click.ParamType[tuple[str, ...]]):
    """Names of features, such as line,box; all; or none."""

    name = "features"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, ...]:
        """Read them, or fail with a message."""
        text = str(value).lower().strip()
        if text in ("all", "none"):
            return EVERY_FEATURE if text == "all" else ()
        names = [name.strip() for name in text.split(",")]
        for name in names:
            if name not in EVERY_FEATURE:
                known = ", ".join(EVERY_FEATURE)
                self.fail(f"{name!r} is no feature: there are {known}; all; none", param, ctx)
        return tuple(name for name in EVERY_FEATURE if name in names)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer another one."""
        from click.shell_completion import CompletionItem  # noqa: PLC0415 - only for this

        del ctx, param
        before, comma, begun = incomplete.rpartition(",")
        names = EVERY_FEATURE if comma else ("all", "none", *EVERY_FEATURE)
        had = before.split(",")
        return [
            CompletionItem(before + comma + name)
            for name in names
            if name.startswith(begun) and name not in had
        ]


@click.command(
    name="plan",
    epilog="""\b
    Examples:
      voxdisplay plan curve.json
      voxdisplay plan curve.json --baud 921600 --size 64x64x64 --format mono1
      voxdisplay plan curve.json --features line,box
      voxdisplay plan curve.json --port /dev/ttyUSB0 --json
    """,
)
@click.argument("scene", type=click.Path())
@click.option(
    "--port",
    "-p",
    metavar="PORT",
    shell_complete=complete_port,
    help="Ask this display for its size, format, features, longest packet and refresh rate.",
)
@baud_option(None, "all common rates, and USB")
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
@click.option(
    "--features",
    type=FeaturesType(),
    metavar="NAMES",
    help="What the display takes besides the ops that all take: names from protocol.md, section "
    "5, such as line,box; all; none.  [default: the port's, else all]",
)
@fit_option
@json_option
def plan_command(
    *,
    scene: str,
    port: str | None,
    baud: Baud | None,
    size: vd.Grid | None,
    format_: str | None,
    features: tuple[str, ...] | None,
    fit: Literal["contain", "none"],
    as_json: bool,
) -> None:
    """Say how many packets and bytes SCENE takes, and how many a second a line carries.

    SCENE is a JSON file, or - for stdin. Nothing is shown. What is counted is what `push` sends to
    a display that shows something else, once the line is known.
    """
    loaded = vd.load_scene(scene)
    grid, kind, receiver = loaded.size or _DEFAULT_GRID, "rgb888", Receiver()
    if port:
        said, baud = _ask(port, baud)
        grid, kind, receiver = said.grid, said.format.value, Receiver.of(said)
    elif baud == "auto":
        raise click.UsageError("--baud auto finds the rate of a display: which --port is it at?")
    if features is not None:
        receiver = replace(receiver, features=features)
    own = "palette" in receiver.features
    frame = vd.Frame(size or grid, format_ or kind, own_palette=own)
    fitted, remark = loaded.fitted(frame.grid, fit)
    if remark:
        note(remark)
    draw(fitted, frame)
    lines = (Line.serial(baud),) if baud else COMMON_LINES
    plans = [plan(frame, line, receiver) for line in lines]
    if as_json:
        print_json(_facts(frame, plans))
    else:
        click.echo(_table(frame, plans))


def _ask(port: str, baud: Baud | None) -> tuple[vd.DeviceInfo, int | None]:
    """Ask a display what it is; give the rate of its line, too, if that was given or found."""
    transport = open_at_rate(port, baud or DEFAULT_BAUD, _TIMEOUT_S, note)
    found = getattr(transport, "baud", None) if baud == "auto" else baud
    with vd.open(transport) as display:
        return display.info, found


def _facts(frame: vd.Frame, plans: list[Plan]) -> dict[str, Any]:
    first = plans[0]
    return {
        "size": list(frame.grid),
        "format": frame.format.value,
        "features": list(first.receiver.features),
        "max_payload_bytes": first.receiver.payload_bytes,
        "refresh_hz": first.receiver.refresh_hz or None,
        "voxels": first.voxels,
        "line": first.line.name,
        **_sizes(first),
        "ops": {name: asdict(op) for name, op in first.ops.items()},
        "lines": [
            {
                "line": cost.line.name,
                "bytes_per_s": cost.line.bytes_per_s,
                **_sizes(cost),
                "frame_s": cost.seconds,
                "frames_per_s": cost.frames_per_s,
            }
            for cost in plans
        ],
    }


def _sizes(cost: Plan) -> dict[str, int]:
    names = ("packets", "op_bytes", "wire_bytes", "answer_bytes")
    return {name: getattr(cost, name) for name in names}


def _table(frame: vd.Frame, plans: list[Plan]) -> str:
    first = plans[0]
    both = f"{plural(first.wire_bytes, 'byte')} to it, {plural(first.answer_bytes, 'byte')} back"
    display = f"{frame.grid} {frame.format.value}, {_features(first.receiver.features)}"
    said = [
        f"{plural(first.voxels, 'voxel')} on a display of {display}",
        f"over {first.line.name}: {plural(first.packets, 'packet')}, {both}",
        "",
        f"{'op':<8}{'count':>9}{'bytes':>10}",
    ]
    for name, op in first.ops.items():
        said.append(f"{name:<8}{op.count:>9}{op.bytes:>10}{op.bytes / first.op_bytes:>7.0%}")
    rest = first.wire_bytes - first.op_bytes
    said += [
        f"{'packing':<8}{'':>9}{rest:>10}   headers, check values, delimiting",
        "",
        f"{'line':<16}{'packets':>9}{'bytes':>10}{'one frame':>12}{'frames/s':>12}",
    ]
    for cost in plans:
        rate = cost.frames_per_s
        mark = "  as fast as it is refreshed" if rate == cost.receiver.refresh_hz else ""
        said.append(
            f"{cost.line.name:<16}{cost.packets:>9}{cost.wire_bytes:>10}"
            f"{_time(cost.seconds):>12}{_rate(rate):>12}{mark}"
        )
    return "\n".join(said)


def _features(names: tuple[str, ...]) -> str:
    """Say what is assumed of a display, or was announced."""
    if names == EVERY_FEATURE:
        return "with all features"
    return f"features: {', '.join(names) or 'none'}"


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

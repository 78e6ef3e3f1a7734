"""``voxdisplay plan``: bytes and frames per second that a scene takes on the wire."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Final

import click

import voxdisplay as vd
from voxdisplay.cli.model_files import ModelOptions, load_shown, model_options
from voxdisplay.cli.options import (
    DEFAULT_SIZE_TEXT,
    baud_option,
    complete_port,
    display_size_option,
    fit_option,
    format_option,
    json_option,
    no_reset,
    no_reset_option,
    quiet_option,
    scene_argument,
)
from voxdisplay.cli.output import note, plural, print_json, print_stdout
from voxdisplay.cli.param_types import FeaturesType
from voxdisplay.cli.show_films import is_show_file, open_show_file

if TYPE_CHECKING:
    from voxdisplay.display.baud import Baud
    from voxdisplay.display.plan import Plan
    from voxdisplay.display.show_plan import ShowPlan
    from voxdisplay.frame import Fit
    from voxdisplay.shows.show import Show

_TIMEOUT_S: Final = 5.0
_MAX_RATE: Final = 10_000  # frames a second, from which on the line is not what limits them


@click.command(
    name="plan",
    epilog="""\b
    Examples:
      voxdisplay plan curve.json
      voxdisplay plan curve.json --baud 921600 --size 64x64x64 --format mono1
      voxdisplay plan curve.json --features line,box
      voxdisplay plan curve.json --port /dev/ttyUSB0 --json
      voxdisplay plan day.vxs
    """,
)
@scene_argument()
@click.option(
    "--port",
    "-p",
    metavar="PORT",
    shell_complete=complete_port,
    help="Ask this display for its size, format, features, longest packet and refresh rate.",
)
@baud_option(None, "all common rates, and USB")
@no_reset_option
@display_size_option(
    "Size of the display in voxels.  "
    f"[default: the port's, else the scene's, else {DEFAULT_SIZE_TEXT}]"
)
@format_option("Pixel format of the display.  [default: the port's, else rgb888]")
@click.option(
    "--features",
    type=FeaturesType(),
    metavar="NAMES",
    help="Features of the display, named as in protocol.md, section 5, such as line,box; all; "
    "none.  [default: the port's, else all]",
)
@fit_option
@model_options
@quiet_option
@json_option
def plan_command(
    *,
    scene: str,
    port: str | None,
    baud: Baud | None,
    size: vd.Grid | None,
    format_: str | None,
    features: tuple[str, ...] | None,
    fit: Fit,
    model: ModelOptions,
    as_json: bool,
) -> None:
    """Print how many packets and bytes SCENE takes, and how many frames per second a line carries.

    SCENE is a JSON file, - for stdin, or a recording. Nothing is shown. Counts what `push` sends to
    a display that shows something else, once the rate of the line is known.
    """
    from voxdisplay.cli.scene_drawing import (  # noqa: PLC0415 - as in push
        draw_scene,
        fit_scene,
        note_choices,
    )
    from voxdisplay.display.plan import COMMON_LINES, Line, Receiver, plan  # noqa: PLC0415

    loaded = load_shown(scene, model)
    played = open_show_file(scene, None, None, fit) if is_show_file(scene) else None
    grid, kind, receiver = loaded.size or vd.Grid(128, 128, 128), "rgb888", Receiver()
    if played:
        kind = played.frame(0).format.value
    if port:
        info, baud = _ask(port, baud)
        grid, kind, receiver = info.grid, info.format.value, Receiver.of_device(info)
    elif baud == "auto":
        raise click.UsageError("--baud auto finds the rate of a display: name its --port")
    if features is not None:
        receiver = replace(receiver, features=features)
    own = "palette" in receiver.features
    frame = vd.Frame(size or grid, format_ or kind, own_palette=own)
    lines = (Line.of_baud(baud),) if baud else COMMON_LINES
    if played:
        show = open_show_file(scene, frame.grid, frame.format.value, fit)
    else:
        fitted = fit_scene(loaded, frame.grid, fit)
        show = fitted.show_on(frame, fit="none")
    if played or fitted.duration:
        from voxdisplay.display.show_plan import plan_show  # noqa: PLC0415

        if not played:
            note_choices(fitted)
        costs = plan_show(show, lines, receiver)
        if as_json:
            print_json(_facts(costs.worst_frame, costs.worst_plans) | _show_facts(show, costs))
        else:
            print_stdout(_show_table(show, costs))
        return
    draw_scene(fitted, frame)
    plans = [plan(frame, line, receiver) for line in lines]
    if as_json:
        print_json(_facts(frame, plans))
    else:
        print_stdout(_table(frame, plans))


def _ask(port: str, baud: Baud | None) -> tuple[vd.DeviceInfo, int | None]:
    """Return what a display announces, and the rate of its line if that was given or found."""
    from voxdisplay.display.baud import DEFAULT_BAUD, open_at_rate  # noqa: PLC0415

    transport = open_at_rate(port, baud or DEFAULT_BAUD, _TIMEOUT_S, note, reset=not no_reset())
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


def _show_facts(show: Show, costs: ShowPlan) -> dict[str, Any]:
    """Return what there is to say of a show, beside the facts of its worst frame."""
    worst = costs.worst_plans[0]
    return {
        "frames": show.frame_count,
        "fps": show.fps,
        "duration_s": show.duration,
        "frames_compared": costs.looked_at,
        "worst": {
            "frame": costs.worst,
            "time_s": costs.worst / show.fps,
            "voxels": worst.voxels,
            "wire_bytes": worst.wire_bytes,
        },
        "mean": {"voxels": costs.mean_voxels, "wire_bytes": costs.mean_bytes[0]},
        "lines": [
            {
                "line": cost.line.name,
                "bytes_per_s": cost.line.bytes_per_s,
                **_sizes(cost),
                "frame_s": cost.seconds,
                "frames_per_s": cost.frames_per_s,
                "mean_wire_bytes": mean,
                "mean_frames_per_s": _mean_rate(cost, mean),
            }
            for cost, mean in zip(costs.worst_plans, costs.mean_bytes, strict=True)
        ],
    }


def _mean_rate(cost: Plan, mean_bytes: float) -> float:
    """Return the frames per second of the mean frame, as far as the device refreshes."""
    carried = cost.line.bytes_per_s / max(mean_bytes, cost.answer_bytes)
    most = cost.receiver.refresh_hz
    return min(carried, most) if most else carried


def _show_table(show: Show, costs: ShowPlan) -> str:
    frame, worst = costs.worst_frame, costs.worst_plans[0]
    display = f"{frame.grid} {frame.format.value}, {_features(worst.receiver.features)}"
    what = f"{plural(show.frame_count, 'frame')} in {show.duration:g} s at {show.fps:g} fps"
    compared = "" if costs.looked_at == show.frame_count else f" of {costs.looked_at} compared"
    most = f"{plural(worst.voxels, 'voxel')}, {plural(worst.wire_bytes, 'byte')}"
    mean_frame = (
        f"{plural(round(costs.mean_voxels), 'voxel')}, {plural(round(costs.mean_bytes[0]), 'byte')}"
    )
    rows = [
        f"{what} on a display of {display}",
        f"worst frame{compared}: {costs.worst}, at {costs.worst / show.fps:.4g} s: {most}",
        f"mean frame: {mean_frame}, over {worst.line.name}",
        "",
        f"{'line':<16}{'worst bytes':>13}{'frames/s':>10}{'mean bytes':>13}{'frames/s':>10}",
    ]
    for cost, mean in zip(costs.worst_plans, costs.mean_bytes, strict=True):
        enough = "" if cost.frames_per_s >= show.fps else "  less than the show has"
        rows.append(
            f"{cost.line.name:<16}{cost.wire_bytes:>13}{_rate(cost.frames_per_s):>10}"
            f"{mean:>13.0f}{_rate(_mean_rate(cost, mean)):>10}{enough}"
        )
    return "\n".join(rows)


def _sizes(cost: Plan) -> dict[str, int]:
    names = ("packets", "op_bytes", "wire_bytes", "answer_bytes")
    return {name: getattr(cost, name) for name in names}


def _table(frame: vd.Frame, plans: list[Plan]) -> str:
    first = plans[0]
    both = f"{plural(first.wire_bytes, 'byte')} to it, {plural(first.answer_bytes, 'byte')} back"
    display = f"{frame.grid} {frame.format.value}, {_features(first.receiver.features)}"
    rows = [
        f"{plural(first.voxels, 'voxel')} on a display of {display}",
        f"over {first.line.name}: {plural(first.packets, 'packet')}, {both}",
        "",
        f"{'op':<8}{'count':>9}{'bytes':>10}",
    ]
    for name, op in first.ops.items():
        rows.append(f"{name:<8}{op.count:>9}{op.bytes:>10}{op.bytes / first.op_bytes:>7.0%}")
    rest = first.wire_bytes - first.op_bytes
    rows += [
        f"{'packing':<8}{'':>9}{rest:>10}   headers, check values, delimiting",
        "",
        f"{'line':<16}{'packets':>9}{'bytes':>10}{'one frame':>12}{'frames/s':>12}",
    ]
    for cost in plans:
        rate = cost.frames_per_s
        mark = "  as fast as it is refreshed" if rate == cost.receiver.refresh_hz else ""
        rows.append(
            f"{cost.line.name:<16}{cost.packets:>9}{cost.wire_bytes:>10}"
            f"{_time(cost.seconds):>12}{_rate(rate):>12}{mark}"
        )
    return "\n".join(rows)


def _features(names: tuple[str, ...]) -> str:
    """Return the features that are assumed or were announced, as text."""
    from voxdisplay.display.plan import EVERY_FEATURE  # noqa: PLC0415

    if names == EVERY_FEATURE:
        return "with all features"
    return f"features: {', '.join(names) or 'none'}"


def _time(seconds: float) -> str:
    """Return a time as text of three figures."""
    unit, size = next(
        ((unit, size) for unit, size in (("s", 1.0), ("ms", 1e-3)) if seconds >= size), ("us", 1e-6)
    )
    value = seconds / size
    return f"{value:.{max(0, 3 - len(str(int(value))))}f} {unit}"


def _rate(frames_per_s: float) -> str:
    if frames_per_s >= _MAX_RATE:
        return f"> {_MAX_RATE}"
    return f"{frames_per_s:.0f}" if frames_per_s >= 100 else f"{frames_per_s:.3g}"

"""``voxdisplay test-pattern``: patterns that tell axes apart, and a check of axes in memory."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import click

import voxdisplay as vd
from voxdisplay.cli.options import json_option, open_display, port_options, quiet_option
from voxdisplay.cli.output import (
    device_json,
    exit_if_lost,
    note,
    parts_json,
    print_json,
    print_stdout,
    progress_bar,
)
from voxdisplay.cli.param_types import RangeType
from voxdisplay.cli.profile_options import standing_options

if TYPE_CHECKING:
    from voxdisplay.display.baud import Baud
    from voxdisplay.display.test_patterns import AxisFinding, PatternFrame
    from voxdisplay.raster.pixel_format import Pixels

PATTERNS: Final = ("axes", "corners", "plane", "all")
_DIRECTIONS: Final = {"x": "right", "y": "away", "z": "up"}
_LEGENDS: Final = {
    "axes": "x is red with one tick at its far end, y green with two, z blue with three; "
    "they meet in white at voxel (0, 0, 0)",
    "corners": "a corner is as red as x is far, as green as y, as blue as z; (0, 0, 0) is grey",
    "plane": "a red plane marches along x, a green one along y, a blue one along z",
    "all": "every voxel is lit",
}
_ONE_COLOR_LEGENDS: Final = {
    "axes": "x has one tick at its far end, y two, z three; they meet at voxel (0, 0, 0)",
    "corners": "all eight corners are lit. On a display of one colour they look alike: they show "
    "that no corner is missing; which axis is which, --pattern axes shows",
    "plane": "a plane marches along x first, then along y, then along z, each time from voxel 0 on",
}


@click.command(
    name="test-pattern",
    epilog="""\b
    Examples:
      voxdisplay test-pattern --port /dev/ttyUSB0
      voxdisplay test-pattern --pattern corners --check
      voxdisplay test-pattern --pattern plane --brightness 20
    """,
)
@port_options
@standing_options
@click.option(
    "--pattern",
    "name",
    type=click.Choice(PATTERNS),
    default="axes",
    help="Axes or corners, labelled by colour; a plane that marches along each axis; all voxels.  "
    "[default: axes]",
)
@click.option(
    "--brightness",
    type=RangeType("percent", 0, 100, "20"),
    metavar="PERCENT",
    help="Brightness, 0 to 100.  [default: 100; plane 50, all 5]",
)
@click.option(
    "--check",
    is_flag=True,
    help="Read the page back and report for each axis whether it is right, mirrored or swapped in "
    "the display's memory. Exit code 1 if one is not right.",
)
@click.option(
    "--ask",
    metavar="NAME",
    help="Show three arrows, ask where they point, and write the answers to a profile for "
    "--display NAME.",
)
@quiet_option
@json_option
def test_pattern(
    *,
    port: str | None,
    baud: Baud,
    timeout_s: float,
    name: str,
    brightness: float | None,
    check: bool,
    ask: str | None,
    as_json: bool,
) -> None:
    """Show a pattern by which the axes of a display can be told apart.

    --check examines the display's memory. Whether the optics show that memory the right way round,
    only eyes can see: the pattern is made for them.
    """
    from voxdisplay.cli.thumbnail import print_thumbnail  # noqa: PLC0415 - help starts fast
    from voxdisplay.display.test_patterns import BRIGHTNESS  # noqa: PLC0415

    share = BRIGHTNESS[name] if brightness is None else brightness / 100
    if ask is not None:
        _ask(ask, port, baud, timeout_s, share)
        return
    with open_display(port, baud, timeout_s) as display:
        check_result = _CheckResult()
        page = _show(display, name, share, check_result if check else None)
        if as_json:
            print_json(
                {
                    "port": display.port,
                    "device": device_json(display.info),
                    "pattern": name,
                    "brightness_percent": round(share * 100, 3),
                    "check": check_result.json() if check else None,
                    **parts_json(display),
                }
            )
        else:
            info = display.info
            print_stdout(f"{display.port}  {info.grid} {info.format.value}: {name}")
            print_stdout(legend(name, info.grid, one_color=info.format is vd.PixelFormat.MONO1))
            if check:
                print_stdout(check_result.text())
            if page is not None:
                print_thumbnail(display, page[0], page[1], baud)
        exit_if_lost(display)
    if check and not check_result.right:
        raise click.exceptions.Exit(1)


def _ask(name: str, port: str | None, baud: Baud, timeout_s: float, share: float) -> None:
    """Ask how a display stands, and write that to a profile."""
    from voxdisplay.cli.ask_orientation import (  # noqa: PLC0415 - help starts fast
        ask_axes,
        prepare_profile,
        write_profile,
    )

    path, keys = prepare_profile(name)
    port = keys.get("port") if port is None else port
    with open_display(port, baud, timeout_s, as_memory=True) as display:
        if display.parts:
            raise click.ClickException(
                "this display is made of parts: ask of each with --port, and copy its axes"
            )
        axes = ask_axes(display, share)
        display.clear()
        write_profile(path, keys, port, display.info.serial, axes)


def legend(name: str, grid: vd.Grid, *, one_color: bool) -> str:
    """Return a description of a pattern, for a person who looks at a display of a size."""
    if not one_color:
        return _LEGENDS[name]
    text = _ONE_COLOR_LEGENDS.get(name, _LEGENDS[name])
    if name == "axes":
        from voxdisplay.display.test_patterns import axes_with_ticks  # noqa: PLC0415

        missing = [axis for axis in "xyz" if axis not in axes_with_ticks(grid)]
        if missing:
            text += (
                f". This display is too small for the ticks of {', '.join(missing)}: only lengths "
                "tell those axes apart, or --pattern plane"
            )
    return text


class _CheckResult:
    """Findings of all pages that were read back."""

    def __init__(self) -> None:
        self.differing_voxels = 0
        self._axes: dict[str, AxisFinding] = {}

    def add(self, step: PatternFrame, page: Pixels) -> None:
        """Compare one more page. A wrong finding is not replaced by a right one."""
        from voxdisplay.display.test_patterns import compare_axes  # noqa: PLC0415

        meant = step.frame.readback()
        differs = meant != page
        self.differing_voxels += int((differs.any(axis=-1) if differs.ndim == 4 else differs).sum())
        for finding in compare_axes(meant, page, step.axes):
            before = self._axes.get(finding.axis)
            if before is None or before.correct is None or finding.correct is False:
                self._axes[finding.axis] = finding

    @property
    def right(self) -> bool:
        """True if everything read back is as it was meant."""
        return self.differing_voxels == 0

    def json(self) -> dict[str, Any]:
        """Return the keys of ``--json``."""
        return {
            "right": self.right,
            "differing_voxels": self.differing_voxels,
            "axes": {
                axis: {"right": finding.correct, "shown": finding.found}
                for axis, finding in self._axes.items()
            },
        }

    def text(self) -> str:
        """Return lines for a person."""
        lines = []
        for axis, finding in self._axes.items():
            lines.append(f"{axis} grows {_DIRECTIONS[axis]}: {_verdict(finding)}")
        differing = self.differing_voxels
        lines.append(
            f"read back: {differing} voxels differ" if differing else "read back: all as meant"
        )
        return "\n".join(lines)


def _verdict(finding: AxisFinding) -> str:
    if finding.correct is None:
        return "unknown: on this display the pattern looks the same either way"
    if finding.correct:
        return "yes"
    if finding.found is None:
        return "no: the page read back is not the pattern with axes swapped or mirrored"
    how = [
        *(["swapped"] if finding.axis not in finding.found else []),
        *(["mirrored"] if finding.found.startswith("-") else []),
    ]
    return f"no: {' and '.join(how)}, it is shown along {finding.found}"


def _show(
    display: vd.Display, name: str, share: float, check_result: _CheckResult | None
) -> tuple[vd.Frame, Pixels | None] | None:
    """Show all frames; return the last, and its page if it was read back."""
    from voxdisplay.display.test_patterns import pattern_frames  # noqa: PLC0415

    info = display.info
    total = sum(info.grid) if name == "plane" else 1
    output, last = display.frame().output, None
    with progress_bar("showing") as progress:
        for number, pattern in enumerate(pattern_frames(name, info.grid, info.format, share)):
            step = replace(pattern, frame=pattern.frame.with_output(output))
            page = None
            try:
                display.present(step.frame)
            except vd.DesyncError as failure:
                if check_result is None or "read" not in info.features:
                    raise
                note(str(failure))
            if check_result is not None and step.verify:
                page = display.read()
                check_result.add(step, page)
            last = step.frame, page
            if progress:
                progress(number + 1, total)
    return last

"""``voxdisplay test-pattern``: whether a display's axes are where they should be."""

from __future__ import annotations

from typing import Any

import click
import numpy as np

import voxdisplay as vd
from voxdisplay.cli.options import (
    json_option,
    open_display,
    port_options,
)
from voxdisplay.cli.output import (
    device_json,
    note,
    print_json,
    progress_bar,
)
from voxdisplay.cli.thumbnail import print_thumbnail
from voxdisplay.display import test_patterns
from voxdisplay.display.baud import Baud
from voxdisplay.raster.pixel_format import Pixels

_GROWS = {"x": "right", "y": "away", "z": "up"}
_LEGEND = {
    "axes": "x is red with one tick at its far end, y green with two, z blue with three; "
    "they meet in white at voxel (0, 0, 0)",
    "corners": "a corner is as red as x is far, as green as y, as blue as z; (0, 0, 0) is grey",
    "plane": "a red plane marches along x, a green one along y, a blue one along z",
    "all": "every voxel is lit",
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
@click.option(
    "--pattern",
    "name",
    type=click.Choice(test_patterns.NAMES),
    default="axes",
    show_default=True,
    help="Axes and corners, labelled by colour; a plane that marches along each axis; all voxels.",
)
@click.option(
    "--brightness",
    type=click.FloatRange(0, 100),
    metavar="PERCENT",
    help="How bright.  [default: 100; plane 50, all 5]",
)
@click.option(
    "--check",
    is_flag=True,
    help="Read the page back and say of each axis whether it is right, mirrored or swapped in the "
    "display's memory. Exit code 1 if one is not right.",
)
@click.option("--quiet", "-q", is_flag=True, help="No progress, and no picture on the terminal.")
@json_option
def test_pattern(
    *,
    port: str | None,
    baud: Baud,
    timeout_s: float,
    name: str,
    brightness: float | None,
    check: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Show a pattern that tells the axes of a display apart.

    The check is of the display's memory. Whether its optics show that memory the right way round,
    only eyes can tell: the pattern is made for them.
    """
    share = test_patterns.BRIGHTNESS[name] if brightness is None else brightness / 100
    with open_display(port, baud, timeout_s) as display:
        judged = _Judged()
        page = _show(display, name, share, judged if check else None, quiet=quiet)
        if as_json:
            print_json(
                {
                    "port": display.port,
                    "device": device_json(display.info),
                    "pattern": name,
                    "brightness_percent": round(share * 100, 3),
                    "check": judged.json() if check else None,
                }
            )
        else:
            click.echo(f"{display.port}  {display.info.grid} {display.info.format.value}: {name}")
            click.echo(_LEGEND[name])
            if check:
                click.echo(judged.text())
            if not quiet and page is not None:
                print_thumbnail(display, page[0], page[1], baud)
    if check and not judged.right:
        raise click.exceptions.Exit(1)


class _Judged:
    """What the pages that were read back say, all together."""

    def __init__(self) -> None:
        self.differing_voxels = 0
        self._axes: dict[str, test_patterns.AxisFinding] = {}

    def add(self, step: test_patterns.PatternFrame, page: Pixels) -> None:
        """Judge one page more. A wrong one is not made good by a right one."""
        meant = step.frame.array()
        differs = meant != page
        self.differing_voxels += int((differs.any(axis=-1) if differs.ndim == 4 else differs).sum())
        for finding in test_patterns.compare_axes(meant, page, step.axes):
            before = self._axes.get(finding.axis)
            if before is None or before.right is None or finding.right is False:
                self._axes[finding.axis] = finding

    @property
    def right(self) -> bool:
        """Whether everything read back is as it was meant."""
        return self.differing_voxels == 0

    def json(self) -> dict[str, Any]:
        """Give it for a script."""
        return {
            "right": self.right,
            "differing_voxels": self.differing_voxels,
            "axes": {
                axis: {"right": finding.right, "shown": finding.shown}
                for axis, finding in self._axes.items()
            },
        }

    def text(self) -> str:
        """Give it for a person."""
        lines = []
        for axis, finding in self._axes.items():
            lines.append(f"{axis} grows {_GROWS[axis]}: {_verdict(finding)}")
        differing = self.differing_voxels
        lines.append(
            f"read back: {differing} voxels differ" if differing else "read back: all as meant"
        )
        return "\n".join(lines)


def _verdict(finding: test_patterns.AxisFinding) -> str:
    if finding.right is None:
        return "cannot be told: on this display the pattern looks the same either way"
    if finding.right:
        return "yes"
    if finding.shown is None:
        return "no: what was read back is no pattern that is swapped or mirrored"
    how = [
        *(["swapped"] if finding.axis not in finding.shown else []),
        *(["mirrored"] if finding.shown.startswith("-") else []),
    ]
    return f"no: {' and '.join(how)}, it is shown along {finding.shown}"


def _show(
    display: vd.Display, name: str, share: float, judged: _Judged | None, *, quiet: bool
) -> tuple[vd.Frame, Pixels | None] | None:
    """Show all steps; give the last frame, and its page if it was read back."""
    info = display.info
    total = sum(info.grid) if name == "plane" else 1
    last = None
    with progress_bar("showing", hidden=quiet) as progress:
        for number, step in enumerate(
            test_patterns.pattern_frames(name, info.grid, info.format, share)
        ):
            page = None
            try:
                display.present(step.frame)
            except vd.DesyncError as error:
                if judged is None or "read" not in info.features:
                    raise
                note(str(error))
            if judged is not None and step.verify:
                page = display.read()
                judged.add(step, np.asarray(page))
            last = step.frame, page
            if progress:
                progress(number + 1, total)
    return last

"""``voxdisplay push``: a scene becomes a proved picture."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, TextIO

import click

import voxdisplay as vd
from voxdisplay.cli.image_output import PictureFileType, save_page
from voxdisplay.cli.options import (
    capture_option,
    fit_option,
    json_option,
    open_display,
    port_options,
    reconnect_option,
)
from voxdisplay.cli.output import (
    device_json,
    note,
    plural,
    print_json,
    progress_bar,
)
from voxdisplay.cli.scene_drawing import draw
from voxdisplay.cli.signals import (
    OnExit,
    close_on_exit,
    on_exit_option,
)
from voxdisplay.cli.thumbnail import print_thumbnail
from voxdisplay.display.baud import Baud


@click.command(
    epilog="""\b
    Examples:
      voxdisplay push examples/paper-curve.json
      voxdisplay push curve.json --port /dev/ttyUSB0 --verify
      voxdisplay push curve.json --port tcp://127.0.0.1:5000 --preview shown.png
      cat curve.json | voxdisplay push - --port tcp://127.0.0.1:5000 --json
    """
)
@click.argument("scene", type=click.Path())
@port_options
@fit_option
@click.option("--verify", is_flag=True, help="Read the page back and compare it voxel by voxel.")
@click.option(
    "--preview",
    type=PictureFileType(),
    metavar="FILE",
    help="Read the page back, and draw what the display says it shows: .png, .gif, .mp4 or .html.",
)
@click.option("--quiet", "-q", is_flag=True, help="No progress, and no picture on the terminal.")
@reconnect_option
@on_exit_option
@capture_option
@json_option
def push(
    *,
    scene: str,
    port: str | None,
    baud: Baud,
    timeout_s: float,
    fit: Literal["contain", "none"],
    verify: bool,
    preview: Path | None,
    quiet: bool,
    reconnect_s: float,
    on_exit: OnExit,
    capture: TextIO | None,
    as_json: bool,
) -> None:
    """Show SCENE, a JSON file or - for stdin, on a display.

    Waits until the device has shown it and its digest agrees.
    """
    if preview:
        import voxdisplay.view.picture  # noqa: F401, PLC0415 - an extra: missed before all else
    loaded = vd.load_scene(scene)
    display = open_display(port, baud, timeout_s, reconnect_s=reconnect_s, capture=capture)
    with close_on_exit(display, on_exit):
        fitted, remark = loaded.fitted(display.info.grid, fit)
        if remark:
            note(remark)
        frame = display.frame()
        draw(fitted, frame)
        with progress_bar("sending", hidden=quiet) as progress:
            receipt = display.present(frame, progress=progress)
        assert receipt is not None  # noqa: S101 - it waited
        if receipt.repaired:
            note(f"the display showed something else at first, and was sent the frame again: "
                 f"{receipt.repaired}")  # fmt: skip
        page = None
        if verify or preview:
            with progress_bar("reading back", hidden=quiet) as progress:
                page = (
                    display.verify(frame, progress=progress)
                    if verify
                    else display.read(progress=progress)
                )
        if as_json:
            print_json(
                {
                    "port": display.port,
                    "device": device_json(display.info),
                    "frame": receipt.frame,
                    "voxels": receipt.voxels,
                    "packets": receipt.packets,
                    "wire_bytes": receipt.wire_bytes,
                    "retransmitted": receipt.retransmitted,
                    "elapsed_s": round(receipt.elapsed_s, 6),
                    "digest": None if receipt.digest is None else f"{receipt.digest:08x}",
                    "repaired": receipt.repaired,
                    "verified": verify or None,
                }
            )
        else:
            click.echo(_summary(display, receipt, verify=verify))
        if preview and page is not None:  # what was shown has been said, if this fails
            save_page(preview, page, display.info, frame.palette)
        if not quiet and not as_json:
            print_thumbnail(display, frame, page, baud)


def _summary(display: vd.Display, receipt: vd.Receipt, *, verify: bool) -> str:
    info = display.info
    again = f", {receipt.retransmitted} sent again" if receipt.retransmitted else ""
    device = f"{info.name or 'a display'} {info.firmware}".strip()
    cost = f"{plural(receipt.packets, 'packet')}, {plural(receipt.wire_bytes, 'byte')}"
    took = f"{receipt.elapsed_s * 1000:.1f} ms"
    lines = [
        f"{display.port}  {device}, {info.grid} {info.format.value}, protocol {info.protocol}",
        f"{plural(receipt.voxels, 'voxel')} shown: {cost}, {took}{again}",
    ]
    if receipt.digest is not None:
        lines.append(f"proved: the display's digest {receipt.digest:08x} is the frame's")
    if verify:
        lines.append(f"verified: all {info.grid.voxels} voxels read back as they were meant")
    return "\n".join(lines)

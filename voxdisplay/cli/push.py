"""``voxdisplay push``: show a scene and prove by digest or readback that it is shown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

import voxdisplay as vd
from voxdisplay.cli.model_files import ModelOptions, load_shown, model_options
from voxdisplay.cli.options import (
    capture_option,
    fit_option,
    image_file_option,
    json_option,
    on_exit_option,
    open_display,
    port_options,
    quiet_option,
    reconnect_option,
    scene_argument,
)
from voxdisplay.cli.output import (
    device_json,
    exit_if_lost,
    note,
    parts_json,
    plural,
    print_json,
    print_stdout,
    progress_bar,
)
from voxdisplay.cli.profile_options import picture_options

if TYPE_CHECKING:
    from voxdisplay.cli.signals import OnExit
    from voxdisplay.display.baud import Baud
    from voxdisplay.frame import Fit


@click.command(
    epilog="""\b
    Examples:
      voxdisplay push examples/paper-curve.json
      voxdisplay push curve.json --port /dev/ttyUSB0 --verify
      voxdisplay push curve.json --port tcp://127.0.0.1:5000 --preview shown.png
      cat curve.json | voxdisplay push - --port tcp://127.0.0.1:5000 --json
    """
)
@scene_argument()
@port_options
@picture_options
@fit_option
@model_options
@click.option("--verify", is_flag=True, help="Read the page back and compare it voxel by voxel.")
@image_file_option(
    "--preview",
    help_text="Read the page back and draw it: .png, .gif, .mp4 or .html.",
)
@quiet_option
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
    fit: Fit,
    model: ModelOptions,
    verify: bool,
    preview: Path | None,
    reconnect_s: float,
    on_exit: OnExit,
    capture: TextIO | None,
    as_json: bool,
) -> None:
    """Show SCENE, a JSON file or - for stdin, on a display.

    Waits until the device has shown it and its digest agrees. An LED cube on artnet:, sacn:, ddp:,
    opc:, wled: or adalight: answers nothing: what was sent to it is not proved.
    """
    from voxdisplay.cli.image_output import save_page_image  # noqa: PLC0415 - help starts fast
    from voxdisplay.cli.scene_drawing import draw_scene, fit_scene  # noqa: PLC0415
    from voxdisplay.cli.signals import close_on_exit  # noqa: PLC0415
    from voxdisplay.cli.thumbnail import print_thumbnail  # noqa: PLC0415

    if preview:
        import voxdisplay.view.picture  # noqa: F401, PLC0415 - an extra: missed before all else
    loaded = load_shown(scene, model)
    display = open_display(port, baud, timeout_s, reconnect_s=reconnect_s, capture=capture)
    with close_on_exit(display, on_exit):
        frame = display.frame()
        fitted = fit_scene(loaded, frame.grid, fit, frame.pitch)
        if fitted.duration:
            note("this scene moves: its beginning is shown; voxdisplay play shows all of it")
        draw_scene(fitted, frame)
        with progress_bar("sending") as progress:
            receipt = display.present(frame, progress=progress)
        assert receipt is not None  # noqa: S101 - it waited
        if receipt.repaired:
            note(f"the display showed something else at first; the frame was sent again: "
                 f"{receipt.repaired}")  # fmt: skip
        page = None
        if (verify or preview) and not getattr(receipt, "lost", ()):
            with progress_bar("reading back") as progress:
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
                    "verified": page is not None if verify else None,
                    **parts_json(display, receipt),
                }
            )
        else:
            print_stdout(_summary(display, receipt, verify=verify))
        # After the summary: the picture is shown, whether or not its image can be written.
        if preview and page is not None:
            save_page_image(preview, page, display.info, frame.memory.palette)
        if not as_json:
            print_thumbnail(display, frame, page, baud, fitted)
        exit_if_lost(display)


def _summary(display: vd.Display, receipt: vd.Receipt, *, verify: bool) -> str:
    info = display.info
    again = f", {receipt.retransmitted} retransmitted" if receipt.retransmitted else ""
    device = f"{info.name or 'a display'} {info.firmware}".strip()
    cost = f"{plural(receipt.packets, 'packet')}, {plural(receipt.wire_bytes, 'byte')}"
    elapsed = f"{receipt.elapsed_s * 1000:.1f} ms"
    shown = "shown" if display.answers else "sent"
    lines = [
        f"{display.port}  {device}, {info.grid} {info.format.value}, protocol {info.protocol}",
        f"{plural(receipt.voxels, 'voxel')} {shown}: {cost}, {elapsed}{again}",
    ]
    if not display.answers:
        lines.append("not proved: nothing answers on this port")
    lines += _parts_lines(receipt)
    if receipt.digest is not None:
        lines.append(f"proved: the display's digest {receipt.digest:08x} is the frame's")
    if verify and not getattr(receipt, "lost", ()):
        lines.append(f"verified: all {info.grid.voxels} voxels read back as they were meant")
    return "\n".join(lines)


def _parts_lines(receipt: vd.Receipt) -> list[str]:
    """Return a line on each part of a display that is made of several."""
    lines = []
    for part in getattr(receipt, "parts", ()):
        share = part.receipt
        if share is None:
            lines.append(f"  {part.name} ({part.port}): lost: {part.lost}")
            continue
        proof = "not proved" if share.digest is None else f"proved by {share.digest:08x}"
        cost = f"{plural(share.voxels, 'voxel')}, {plural(share.wire_bytes, 'byte')}"
        lines.append(f"  {part.name} ({part.port}): {cost}, {proof}")
    return lines

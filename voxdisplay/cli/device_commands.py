"""``voxdisplay info``, ``clear`` and ``read``: one exchange with a display."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from voxdisplay.cli.options import json_option, open_display, port_options, quiet_option
from voxdisplay.cli.output import (
    device_json,
    exit_if_lost,
    note,
    parts_json,
    plural,
    print_json,
    print_stdout,
)
from voxdisplay.cli.profile_options import standing_options

if TYPE_CHECKING:
    from voxdisplay.display.baud import Baud


@click.command(
    epilog="""\b
    Examples:
      voxdisplay info
      voxdisplay info --port /dev/ttyUSB0 --baud auto
      voxdisplay info --port usb: --json
    """
)
@port_options
@standing_options
@quiet_option
@json_option
def info(*, port: str | None, baud: Baud, timeout_s: float, as_json: bool) -> None:
    """Print size, format and features of a display, as it announces them."""
    with open_display(port, baud, timeout_s) as display:
        device = display.info
        facts = {
            "port": display.port,
            "name": device.name,
            **device_json(device),
            "serial": device.serial,
            "refresh_hz": device.refresh_hz,
            "max_payload_bytes": device.max_payload_bytes,
            "rx_buffer_bytes": device.rx_buffer_bytes,
            "features": list(device.features),
            "boot": device.boot,
            **parts_json(display),
        }
    if as_json:
        print_json(facts)
        return
    facts |= {"size": str(device.grid), "features": ", ".join(device.features)}
    facts |= {
        f"part {number}": f"{part['name']}: {part['port']}, {'x'.join(map(str, part['size']))} at "
        f"{','.join(map(str, part['at']))}, axes {','.join(part['axes'])}"
        for number, part in enumerate(facts.pop("parts", ()), 1)
    }
    width = max(map(len, facts))
    print_stdout("\n".join(f"{key:<{width}}  {value}" for key, value in facts.items()))


@click.command(
    epilog="""\b
    Examples:
      voxdisplay clear --port /dev/ttyUSB0
      voxdisplay clear --port tcp://127.0.0.1:5000 --json
    """
)
@port_options
@standing_options
@quiet_option
@json_option
def clear(*, port: str | None, baud: Baud, timeout_s: float, as_json: bool) -> None:
    """Make a display dark, and wait until it is."""
    with open_display(port, baud, timeout_s) as display:
        receipt = display.clear()
        if as_json:
            print_json(
                {
                    "port": display.port,
                    "device": device_json(display.info),
                    "wire_bytes": receipt.wire_bytes,
                    "elapsed_s": round(receipt.elapsed_s, 6),
                    "digest": None if receipt.digest is None else f"{receipt.digest:08x}",
                    **parts_json(display, receipt),
                }
            )
        else:
            unproved = "" if display.answers else " was sent, not proved: nothing answers there"
            print_stdout(f"{display.port}  dark{unproved}")
        exit_if_lost(display)


@click.command(
    epilog="""\b
    Examples:
      voxdisplay read --port /dev/ttyUSB0 -o page.npy
      voxdisplay read --port usb: -o page.vox --json
    """
)
@port_options
@standing_options
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="File to write: .npy, a numpy array indexed [z, y, x]; .npz, voxels and colors; .vox, "
    "for voxel editors; or .ply, a mesh.",
)
@quiet_option
@json_option
def read(*, port: str | None, baud: Baud, timeout_s: float, output: Path, as_json: bool) -> None:
    """Save what a display shows, read back from its memory."""
    from voxdisplay.cli.voxel_output import check_suffix, save_voxels  # noqa: PLC0415 - help starts without numpy

    check_suffix(output)
    with open_display(port, baud, timeout_s) as display:
        array, parts = display.read(), parts_json(display)
        device, name = device_json(display.info), display.port
        format_ = display.info.format
        unknown = format_.value == "index8" and "palette" in display.info.features
    lit = save_voxels(output, array, format_)
    if unknown and lit and output.suffix.lower() != ".npy":
        note("a palette cannot be read back: colours are those of the default one")
    if as_json:
        facts = {"port": name, "device": device, "output": str(output), "voxels": lit}
        print_json(facts | parts)
    else:
        note(f"{output}: {'x'.join(map(str, array.shape))}, {plural(lit, 'voxel')} lit")

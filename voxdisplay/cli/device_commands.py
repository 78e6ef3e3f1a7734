"""``voxdisplay info``, ``clear`` and ``read``: the display itself."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from voxdisplay.cli.options import (
    json_option,
    open_display,
    port_options,
)
from voxdisplay.cli.output import (
    device_json,
    note,
    plural,
    print_json,
)
from voxdisplay.display.baud import Baud


@click.command()
@port_options
@json_option
def info(*, port: str | None, baud: Baud, timeout_s: float, as_json: bool) -> None:
    """Say what a display says of itself."""
    with open_display(port, baud, timeout_s) as display:
        said = display.info
        facts = {
            "port": display.port,
            "name": said.name,
            **device_json(said),
            "serial": said.serial,
            "refresh_hz": said.refresh_hz,
            "max_payload_bytes": said.max_payload_bytes,
            "rx_buffer_bytes": said.rx_buffer_bytes,
            "features": list(said.features),
            "boot": said.boot,
        }
    if as_json:
        print_json(facts)
        return
    facts |= {"size": str(said.grid), "features": ", ".join(said.features)}
    width = max(map(len, facts))
    click.echo("\n".join(f"{key:<{width}}  {value}" for key, value in facts.items()))


@click.command()
@port_options
@json_option
def clear(*, port: str | None, baud: Baud, timeout_s: float, as_json: bool) -> None:
    """Make a display dark."""
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
                }
            )
        else:
            click.echo(f"{display.port}  dark")


@click.command()
@port_options
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.npy",
    help="Where to: a numpy array, indexed [z, y, x].",
)
@json_option
def read(*, port: str | None, baud: Baud, timeout_s: float, output: Path, as_json: bool) -> None:
    """Read back what a display shows."""
    if output.suffix != ".npy":
        raise click.BadParameter(f"{output} should end in .npy", param_hint="--output")
    with open_display(port, baud, timeout_s) as display:
        array = display.read()
        device, name = device_json(display.info), display.port
    try:
        np.save(output, array)
    except OSError as error:
        raise click.ClickException(f"{output} cannot be written: {error.strerror}") from error
    lit = int(np.count_nonzero(array.any(axis=-1) if array.ndim == 4 else array))
    if as_json:
        print_json({"port": name, "device": device, "output": str(output), "voxels": lit})
    else:
        note(f"{output}: {'x'.join(map(str, array.shape))}, {plural(lit, 'voxel')} lit")

"""``voxdisplay ports``: the list of ports, and on request a probe of each."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

import click

import voxdisplay as vd
from voxdisplay.cli.options import (
    baud_option,
    json_option,
    no_reset,
    no_reset_option,
    quiet_option,
    timeout_option,
)
from voxdisplay.cli.output import device_json, note, plural, print_json, print_stdout

if TYPE_CHECKING:
    from voxdisplay.display.baud import Baud
    from voxdisplay.display.scan import ProbeResult
    from voxdisplay.transport.discovery import FoundPort

_SLACK_S: Final = 2.0


@click.command(
    epilog="""\b
    Examples:
      voxdisplay ports
      voxdisplay ports --probe
      voxdisplay ports --probe --baud auto --json
    """
)
@click.option(
    "--probe",
    is_flag=True,
    help="Open each port, send HELLO and print what answers. It changes no picture, but many "
    "boards restart when their port is opened, and a device that is no display receives a few "
    "bytes that it does not know.",
)
@timeout_option(3.0)
@baud_option()
@no_reset_option
@quiet_option
@json_option
def ports(*, probe: bool, timeout_s: float, baud: Baud, as_json: bool) -> None:
    """List what can be opened: serial ports and displays on USB.

    With --probe, all ports are asked at the same time, each for --timeout.
    """
    from voxdisplay.transport import discovery  # noqa: PLC0415 - help starts without it

    found = discovery.all_ports()
    answers: dict[str, ProbeResult] = {}
    if probe:
        from voxdisplay.display import scan  # noqa: PLC0415 - loads numpy

        if sys.stderr.isatty():
            note(f"asking {plural(len(found), 'port')}, for up to {timeout_s:g} s ...")
        names = [port.port for port in found]
        answers = scan.probe_ports(
            names, baud=baud, timeout_s=timeout_s, slack_s=_SLACK_S, reset=not no_reset()
        )
    if as_json:
        print_json({"ports": [_port_json(port, answers.get(port.port)) for port in found]})
        return
    width = max(len(port.port) for port in found)
    for port in found:
        ids = f"  {port.vid:04x}:{port.pid:04x}" if port.vid is not None else ""
        number = f"  serial {port.serial_number}" if port.serial_number else ""
        product = port.product if port.product and port.product not in port.description else ""
        print_stdout(
            f"{port.port:<{width}}  {port.description}{'  ' * bool(product)}{product}{ids}{number}"
        )
        if probe:
            print_stdout(f"{'':<{width}}  {_result_text(answers[port.port])}")


def _result_text(answer: ProbeResult) -> str:
    if isinstance(answer, str):
        return f"no display: {answer}"
    name = f"{answer.name or 'a display'} {answer.firmware}".strip()
    number = f", serial {answer.serial}" if answer.serial else ""
    return f"DISPLAY: {name}, {answer.grid} {answer.format.value}{number}"


def _port_json(port: FoundPort, answer: ProbeResult | None) -> dict[str, Any]:
    facts = {**asdict(port), "kind": port.kind}
    if isinstance(answer, vd.DeviceInfo):
        device = {"name": answer.name, **device_json(answer), "serial": answer.serial}
        facts |= {"answers": True, "device": device, "trouble": None}
    elif answer is not None:
        facts |= {"answers": False, "device": None, "trouble": answer}
    return facts

"""``voxdisplay conformance``: checks of a device against protocol.md."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from voxdisplay.cli.options import (
    baud_option,
    default_port,
    json_option,
    no_reset,
    no_reset_option,
    port_option,
    quiet_option,
    timeout_option,
)
from voxdisplay.cli.output import note, print_json, print_stdout, progress_bar
from voxdisplay.cli.param_types import seconds_type
from voxdisplay.printable_text import printable

if TYPE_CHECKING:
    from voxdisplay.conformance.announced_device import AnnouncedDevice
    from voxdisplay.conformance.catalogue import Check
    from voxdisplay.conformance.run import Result
    from voxdisplay.display.baud import Baud

_EXIT_BROKEN = 1


@click.command(
    epilog="""\b
    Examples:
      voxdisplay conformance --port /dev/ttyUSB0
      voxdisplay conformance --port tcp://10.0.0.9:5000 --only 7.3 --only 9/status
      voxdisplay conformance --only digest --list

    Exit codes: 0 all that concerns the device holds; 1 something does not, or could not be
    examined; 2 usage; 3 the port cannot be opened."""
)
@port_option
@baud_option()
@no_reset_option
@timeout_option(1.0)
@click.option(
    "--opening",
    "opening_s",
    type=seconds_type(0.1),
    default=5.0,
    metavar="SECONDS",
    help="Longest wait for the first answer: a board may restart when its port is opened.  "
    "[default: 5]",
)
@click.option(
    "--only",
    multiple=True,
    metavar="SECTION/NAME",
    help="Run only these checks: 7, 7.3, 7.3/line-ties, line-*. May be given several times.",
)
@click.option("--list", "as_list", is_flag=True, help="List the checks, and what each requires.")
@click.option(
    "--seed",
    type=int,
    default=0,
    metavar="N",
    help="Seed of the random numbers.  [default: 0]",
)
@click.option("--verbose", "-v", is_flag=True, help="Show all packets of every check.")
@quiet_option
@json_option
def conformance(
    *,
    port: str | None,
    baud: Baud,
    timeout_s: float,
    opening_s: float,
    only: tuple[str, ...],
    as_list: bool,
    seed: int,
    verbose: bool,
    as_json: bool,
) -> None:
    """Check that a device keeps to protocol.md, sentence by sentence.

    Takes any device behind any kind of port. Draws on the display; afterwards the display is as it
    was, if it can be read back, otherwise dark.

    An answer may take --timeout, plus a refresh period and its time on a serial line. Later ones,
    as a busy computer makes them, are waited for and counted.
    """
    from voxdisplay.conformance import report, run  # noqa: PLC0415 - only what is needed

    try:
        selected = run.select_checks(only)
    except ValueError as error:
        raise click.BadParameter(f"{error}; --list lists them", param_hint="--only") from error
    if as_list:
        _list(selected, as_json=as_json)
        return
    from voxdisplay.display.baud import DEFAULT_BAUD, open_at_rate  # noqa: PLC0415

    port = default_port(port)
    pipe = open_at_rate(port, baud, opening_s, note, reset=not no_reset())
    done = 0
    try:
        with progress_bar("checking") as progress:

            def on_result(result: Result) -> None:
                nonlocal done
                done += 1
                if progress:
                    progress(min(done, len(selected)), len(selected))
                if verbose and not as_json:
                    text = f"{result.check.id}: {result.verdict.value} {result.reason}".rstrip()
                    print_stdout(printable(text))
                    print_stdout("\n".join(report.transcript_lines(result.log)))

            outcome = run.run_checks(
                pipe,
                only,
                timeout_s=timeout_s,
                opening_s=opening_s,
                baud=getattr(pipe, "baud", DEFAULT_BAUD),
                seed=seed,
                on_connected=lambda device, saved: _announce(port, device, saved=saved),
                on_result=on_result,
            )
    finally:
        pipe.close()
    if as_json:
        print_json(report.as_json(port, outcome))
    else:
        for line in report.report_lines(outcome, transcripts=not verbose):
            red = line.startswith("BROKEN") and sys.stdout.isatty()
            print_stdout(click.style(line, fg="red") if red else line)
    if not outcome.holds:
        raise click.exceptions.Exit(_EXIT_BROKEN)


def _announce(port: str, device: AnnouncedDevice, *, saved: bool) -> None:
    note(f"{port}  {device}")
    afterwards = "as it was" if saved else "dark: what it shows cannot be read back"
    note(f"this draws on the display; afterwards it will be {afterwards}")


def _list(checks: list[Check], *, as_json: bool) -> None:
    if as_json:
        rows = [
            {"section": check.section, "name": check.name, "demands": check.requirement}
            for check in checks
        ]
        print_json({"checks": rows})
        return
    width = max(len(check.id) for check in checks)
    for check in sorted(checks, key=lambda check: check.order):
        print_stdout(f"{check.id:<{width}}  {check.requirement}")

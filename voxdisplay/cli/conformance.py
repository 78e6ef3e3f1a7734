"""``voxdisplay conformance``: tell whether a device keeps to protocol.md."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from voxdisplay.cli.options import (
    DEFAULT_PORT,
    SecondsType,
    baud_option,
    json_option,
    port_option,
    timeout_option,
)
from voxdisplay.cli.output import (
    note,
    print_json,
    progress_bar,
)
from voxdisplay.display.baud import DEFAULT_BAUD, Baud, open_at_rate

if TYPE_CHECKING:  # the kit is imported when it is used: the other commands start without it
    from voxdisplay.conformance.announced_device import AnnouncedDevice
    from voxdisplay.conformance.catalogue import Check
    from voxdisplay.conformance.run import Result

_EXIT_BROKEN = 1


@click.command(
    epilog="""\b
    voxdisplay conformance --port /dev/ttyUSB0
    voxdisplay conformance --port tcp://192.168.1.9:5000 --only 7.3 --only 9/status
    voxdisplay conformance --only digest --list

    Exit codes: 0 all that concerns the device holds; 1 something does not, or could not be looked
    at; 2 usage; 3 the port cannot be opened."""
)
@port_option
@baud_option()
@timeout_option(1.0)
@click.option(
    "--opening",
    "opening_s",
    type=SecondsType(0.1),
    default=5.0,
    metavar="SECONDS",
    show_default=True,
    help="How long the first answer may take: a board may start anew when its port is opened.",
)
@click.option(
    "--only",
    multiple=True,
    metavar="SECTION/NAME",
    help="Make only these checks: 7, 7.3, 7.3/line-ties, line-*. May be given several times.",
)
@click.option("--list", "as_list", is_flag=True, help="List the checks, and what each demands.")
@click.option("--seed", default=0, show_default=True, help="Where all that is random begins.")
@click.option("--verbose", "-v", is_flag=True, help="Show all packets of every check.")
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

    It takes any device behind any kind of port. It draws on the display; afterwards the display is
    as it was, if it can be read back, otherwise dark.

    An answer may take --timeout, and besides a refresh period and its time on a serial line.
    """
    from voxdisplay.conformance import report, run  # noqa: PLC0415 - only what is needed

    try:
        selected = run.select_checks(only)
    except ValueError as error:
        raise click.BadParameter(f"{error}; --list lists them", param_hint="--only") from error
    if as_list:
        _list(selected, as_json=as_json)
        return
    if port is None:
        note("no --port: using the built-in emulator, sim:")
        port = DEFAULT_PORT
    pipe = open_at_rate(port, baud, opening_s, note)
    done = 0
    try:
        with progress_bar("checking") as progress:

            def ended(result: Result) -> None:
                nonlocal done
                done += 1
                if progress:
                    progress(min(done, len(selected)), len(selected))
                if verbose and not as_json:
                    text = f"{result.check.id}: {result.verdict.value} {result.reason}".rstrip()
                    click.echo(report.clean(text))
                    click.echo("\n".join(report.transcript_lines(result.log)))

            outcome = run.run_checks(
                pipe,
                only,
                timeout_s=timeout_s,
                opening_s=opening_s,
                baud=getattr(pipe, "baud", DEFAULT_BAUD),
                seed=seed,
                greeted=lambda said, kept: _announce(port, said, kept=kept),
                ended=ended,
            )
    finally:
        pipe.close()
    if as_json:
        print_json(report.as_json(port, outcome))
    else:
        for line in report.report_lines(outcome, transcripts=not verbose):
            click.secho(line, fg="red" if line.startswith("BROKEN") else None)
    if not outcome.holds:
        raise click.exceptions.Exit(_EXIT_BROKEN)


def _announce(port: str, said: AnnouncedDevice, *, kept: bool) -> None:
    from voxdisplay.conformance.report import clean  # noqa: PLC0415 - only what is needed

    note(f"{port}  {clean(str(said))}")
    afterwards = "as it was" if kept else "dark: what it shows cannot be read back"
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
        click.echo(f"{check.id:<{width}}  {check.requirement}")

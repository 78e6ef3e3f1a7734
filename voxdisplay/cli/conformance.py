"""``voxdisplay conformance``: does a device keep to protocol.md?"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import groupby

import click

from voxdisplay.cli.options import DEFAULT_PORT, json_option, note, plural, print_json
from voxdisplay.conformance.catalogue import Check
from voxdisplay.conformance.run import Report, Result, Verdict, chosen, examine
from voxdisplay.conformance.said import Said
from voxdisplay.transport import open_transport

_LAST_LINES = 8  # of a transcript, without --verbose
_EXIT_BROKEN = 1
_SECTIONS = {
    "2": "scan order",
    "2.1": "pixel formats",
    "3": "delimiting",
    "4": "packets",
    "5": "HELLO and INFO",
    "6": "frames and pages",
    "7": "ops",
    "7.1": "chains",
    "7.2": "counts",
    "7.3": "shapes",
    "7.4": "bricks",
    "7.5": "differences",
    "7.6": "palette",
    "7.7": "range-coded chains",
    "7.8": "the grid's edges",
    "8": "digest",
    "9": "ACK",
    "9.1": "window",
    "9.2": "credit",
    "10": "READ and PAGE",
    "11": "ERROR",
    "12": "malformed input",
}


@click.command(
    epilog="""\b
    voxdisplay conformance --port /dev/ttyUSB0
    voxdisplay conformance --port tcp://192.168.1.9:5000 --only 7.3 --only 9/status
    voxdisplay conformance --list

    Exit codes: 0 all that concerns the device holds; 1 something does not; 2 usage; 3 the port
    cannot be opened."""
)
@click.option(
    "--port",
    "-p",
    envvar="VOXDISPLAY_PORT",
    metavar="PORT",
    help="As of voxdisplay push. Default: $VOXDISPLAY_PORT, else sim:, the built-in emulator.",
)
@click.option(
    "--baud",
    type=click.IntRange(min=50),
    default=115200,
    metavar="RATE",
    show_default=True,
    help="Bits per second of a serial line.",
)
@click.option(
    "--timeout",
    "timeout_s",
    type=click.FloatRange(min=0.01),
    default=1.0,
    metavar="SECONDS",
    show_default=True,
    help="How long an answer may take, beyond a refresh period and the time on a serial line.",
)
@click.option(
    "--opening",
    "opening_s",
    type=click.FloatRange(min=0.1),
    default=5.0,
    metavar="SECONDS",
    show_default=True,
    help="How long the first answer may take: a board may restart when its port is opened.",
)
@click.option(
    "--only",
    multiple=True,
    metavar="SECTION/NAME",
    help="Make only these checks: 7, 7.3, 7.3/line-ties, line-*. May be given several times.",
)
@click.option("--list", "as_list", is_flag=True, help="List the checks, and what each demands.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of all that is random.")
@click.option("--verbose", "-v", is_flag=True, help="Show all that went over the wire.")
@json_option
def conformance(
    *,
    port: str | None,
    baud: int,
    timeout_s: float,
    opening_s: float,
    only: tuple[str, ...],
    as_list: bool,
    seed: int,
    verbose: bool,
    as_json: bool,
) -> None:
    """Check that a device keeps to protocol.md, sentence by sentence.

    Any device, behind any kind of port. It draws on the display; afterwards the display is as it
    was, if the device can be read, otherwise dark.
    """
    try:
        selected = chosen(only)
    except ValueError as error:
        raise click.BadParameter(
            f"{error}: voxdisplay conformance --list lists them", param_hint="--only"
        ) from error
    if as_list:
        _print_list(selected, as_json=as_json)
        return
    port = port or DEFAULT_PORT
    pipe = open_transport(port, baud=baud)
    try:
        with _progress(len(selected)) as bar:

            def ended(result: Result) -> None:
                if bar:
                    bar.update(1)
                if verbose and not as_json:
                    _print_verbose(result)

            report = examine(
                pipe,
                only,
                timeout_s=timeout_s,
                opening_s=opening_s,
                baud=baud,
                seed=seed,
                greeted=lambda said, kept: _announce(port, said, kept=kept),
                ended=ended,
            )
    finally:
        pipe.close()
    if as_json:
        print_json(_json(port, report))
    else:
        _print_report(report, verbose=verbose)
    if not report.holds:
        raise click.exceptions.Exit(_EXIT_BROKEN)


def _announce(port: str, said: Said, *, kept: bool) -> None:
    note(f"{port}  {_clean(str(said))}")
    note(
        "this draws on the display; it will be "
        + ("as it was afterwards" if kept else "dark afterwards, as it cannot be read back")
    )


@contextmanager
def _progress(count: int) -> Iterator[click.progressbar | None]:  # type: ignore[valid-type]
    if not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=count, label="checking", file=sys.stderr) as bar:
        yield bar


def _print_list(checks: list[Check], *, as_json: bool) -> None:
    if as_json:
        print_json(
            {
                "checks": [
                    {"section": c.section, "name": c.name, "demands": c.demands} for c in checks
                ]
            }
        )
        return
    width = max(len(check.id) for check in checks)
    for check in _by_section(checks):
        click.echo(f"{check.id:<{width}}  {check.demands}")


def _order(section: str) -> tuple[int, ...]:
    return tuple(map(int, section.split(".")))


def _by_section(checks: list[Check]) -> list[Check]:
    return sorted(checks, key=lambda check: _order(check.section))


def _print_report(report: Report, *, verbose: bool) -> None:
    for result in report.results:
        if result.verdict is Verdict.BROKEN:
            _print_broken(result, verbose=verbose)
    ordered = sorted(report.results, key=lambda result: _order(result.check.section))
    for section, group in groupby(ordered, key=lambda result: result.check.section):
        results = list(group)
        counts = ", ".join(
            f"{number} {verdict.value.replace('holds', 'hold') if number > 1 else verdict.value}"
            for verdict in Verdict
            if (number := sum(result.verdict is verdict for result in results))
        )
        click.echo(f"{section:>4}  {_SECTIONS.get(section, ''):<20}  {counts}")
    skipped = [result for result in ordered if result.verdict is Verdict.NOT_APPLICABLE]
    for reason, group in groupby(
        sorted(skipped, key=lambda result: result.reason), key=lambda result: result.reason
    ):
        names = ", ".join(result.check.id for result in group)
        click.echo(f"not applicable, {_clean(reason)}: {names}")
    click.echo(_summary(report))
    click.echo(f"the display is {report.left}")


def _summary(report: Report) -> str:
    broken = report.count(Verdict.BROKEN)
    held = report.count(Verdict.HOLDS)
    not_run = report.count(Verdict.NOT_RUN)
    if report.holds:
        return f"the device keeps to protocol.md in all that was looked at: {plural(held, 'check')}"
    missed = f", {not_run} not run" if not_run else ""
    return f"{broken} broken, {held} hold{missed}"


def _print_broken(result: Result, *, verbose: bool) -> None:
    check = result.check
    click.echo(click.style(f"BROKEN  {check.id}", fg="red", bold=True))
    click.echo(f"  section {check.section} demands: {check.demands}")
    click.echo(f"  must be   {_clean(result.must)}")
    click.echo(f"  was       {_clean(result.came)}")
    if result.likely:
        click.echo(f"  likely    {_clean(result.likely)}")
    if not verbose:
        left_out = len(result.log) - _LAST_LINES
        if left_out > 0:
            click.echo(f"     ... {plural(left_out, 'packet')} before: -v shows them")
        for line in result.log[-_LAST_LINES:]:
            click.echo(f"     {_clean(str(line))}")
    click.echo()


def _print_verbose(result: Result) -> None:
    click.echo(f"{result.check.id}  {result.verdict.value}  {_clean(result.reason)}".rstrip())
    for line in result.log:
        click.echo(f"     {_clean(str(line))}")


def _clean(text: str) -> str:
    """Keep a device's text from steering the terminal."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def _json(port: str, report: Report) -> dict[str, object]:
    said = report.said
    return {
        "port": port,
        "device": said
        and {
            "name": said.name,
            "firmware": said.firmware,
            "serial": said.serial,
            "size": list(said.grid),
            "format": said.format,
            "refresh_hz": said.refresh / 1000,
            "max_payload_bytes": said.max_payload,
            "rx_buffer_bytes": said.rx_buffer,
            "features": said.features,
        },
        "conforms": report.holds,
        "counts": {verdict.value.replace(" ", "_"): report.count(verdict) for verdict in Verdict},
        "display": report.left,
        "results": [
            {
                "section": result.check.section,
                "name": result.check.name,
                "demands": result.check.demands,
                "verdict": result.verdict.value.replace(" ", "_"),
                "must": result.must or None,
                "was": result.came or None,
                "likely": result.likely or None,
                "reason": result.reason or None,
                "transcript": [
                    {"sent": line.sent, "hex": line.data.hex(" ").upper(), "text": line.text}
                    for line in result.log
                ]
                if result.verdict is Verdict.BROKEN
                else None,
            }
            for result in report.results
        ],
    }

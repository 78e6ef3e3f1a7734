"""Presentation of the results, as lines for a person and as one JSON object for a script."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from operator import attrgetter
from typing import Any

from voxdisplay.conformance.announced_device import FEATURES, FORMATS
from voxdisplay.conformance.catalogue import SECTIONS
from voxdisplay.conformance.dialogue import LogEntry
from voxdisplay.conformance.run import Report, Result, Verdict
from voxdisplay.printable_text import printable

_LAST_LINES = 8  # of a transcript, unless all is shown
_LAST_ERRORS = 3  # received in a check: they are shown, whatever was waited for


def report_lines(report: Report, *, transcripts: bool) -> Iterator[str]:
    """Yield the violations, the counts of each section, and the conclusion.

    Parameters
    ----------
    report : Report
    transcripts : bool
        True if the last packets of each broken check are shown.
    """
    for result in report.results:
        if result.verdict is Verdict.BROKEN:
            yield from violation_lines(result, transcript=transcripts)
    ordered = sorted(report.results, key=lambda result: result.check.order)
    for section, group in groupby(ordered, key=lambda result: result.check.section):
        counts = _counts([result.verdict for result in group])
        yield f"{section:>4}  {SECTIONS.get(section, ''):<20}  {counts}"
    skipped = (result for result in ordered if result.verdict is Verdict.NOT_APPLICABLE)
    for reason, group in groupby(sorted(skipped, key=attrgetter("reason")), attrgetter("reason")):
        yield printable(
            f"not applicable, {reason}: {', '.join(result.check.id for result in group)}"
        )
    if report.late_responses:
        slowest = f"the slowest {report.slowest_response_s:.2f} s"
        yield f"responses later than the limit: {report.late_responses}, {slowest}"
    yield _conclusion(report)
    yield f"on display now: {report.display_state}"


def _counts(verdicts: list[Verdict]) -> str:
    numbers = {verdict: verdicts.count(verdict) for verdict in Verdict}
    words = {Verdict.HOLDS: "hold" if numbers[Verdict.HOLDS] > 1 else "holds"}
    return ", ".join(
        f"{number} {words.get(verdict, verdict.value)}"
        for verdict, number in numbers.items()
        if number
    )


def _conclusion(report: Report) -> str:
    held = report.count(Verdict.HOLDS)
    if report.holds:
        return f"conforms: all {held} checks that apply hold"
    not_run = report.count(Verdict.NOT_RUN)
    if not held + report.count(Verdict.BROKEN) + not_run:
        return "no check was made: none of these applies to the device"
    missed = f", {not_run} not run" if not_run else ""
    return f"{report.count(Verdict.BROKEN)} broken, {held} hold{missed}"


def violation_lines(result: Result, *, transcript: bool) -> Iterator[str]:
    """Yield what is wrong: what must be, what was, and the last packets."""
    check = result.check
    yield f"BROKEN {check.id}"
    yield f"  section {check.section}: {check.requirement}"
    if result.last_sent:
        yield printable(f"  sent:    {str(result.last_sent).removeprefix('-> ')}")
    yield printable(f"  must be: {result.expected}")
    yield printable(f"  was:     {result.actual}")
    for error in result.errors[-_LAST_ERRORS:]:
        if error not in result.actual:
            yield printable(f"  came:    {error}")
    if result.likely_cause:
        yield printable(f"  likely:  {result.likely_cause}")
    if transcript:
        if len(result.log) > _LAST_LINES:
            yield f"    ... {len(result.log) - _LAST_LINES} before; -v shows all"
        yield from transcript_lines(result.log[-_LAST_LINES:])
    yield ""


def transcript_lines(log: tuple[LogEntry, ...]) -> Iterator[str]:
    """Yield packets sent (->) and received (<-), without COBS and check value, as section 17.5."""
    for line in log:
        yield printable(f"    {line}")


def as_json(port: str, report: Report) -> dict[str, Any]:
    """Return the results as one JSON object, with transcripts of the broken checks."""
    device = report.device
    return {
        "port": port,
        "device": device
        and {
            "name": device.name,
            "firmware": device.firmware,
            "serial": device.serial,
            "size": list(device.grid),
            "format": FORMATS.get(device.format, str(device.format)).lower(),
            "refresh_hz": device.refresh / 1000,
            "max_payload_bytes": device.max_payload,
            "rx_buffer_bytes": device.rx_buffer,
            "features": [name.lower() for name in FEATURES if device.has(name)],
        },
        "conforms": report.holds,
        "counts": {_key(verdict): report.count(verdict) for verdict in Verdict},
        "on_display": report.display_state,
        "late_responses": report.late_responses,
        "slowest_response_s": round(report.slowest_response_s, 3),
        "checks": [_result_json(result) for result in report.results],
    }


def _key(verdict: Verdict) -> str:
    return verdict.value.replace(" ", "_")


def _result_json(result: Result) -> dict[str, Any]:
    is_broken = result.verdict is Verdict.BROKEN
    return {
        "section": result.check.section,
        "name": result.check.name,
        "demands": result.check.requirement,
        "verdict": _key(result.verdict),
        "sent_hex": result.last_sent.data.hex(" ").upper()
        if is_broken and result.last_sent
        else None,
        "must": result.expected or None,
        "was": result.actual or None,
        "likely": result.likely_cause or None,
        "errors": result.errors if is_broken else None,
        "reason": result.reason or None,
        "transcript": [
            {"sent": line.sent, "hex": line.data.hex(" ").upper(), "text": line.text}
            for line in result.log
        ]
        if is_broken
        else None,
    }

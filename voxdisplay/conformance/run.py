"""Execution of the checks, one after the other, and their results. Prints nothing."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeVar

from voxdisplay.conformance import checks as _checks  # noqa: F401 - they register themselves
from voxdisplay.conformance import handshake_diagnosis
from voxdisplay.conformance.announced_device import FORMATS, AnnouncedDevice
from voxdisplay.conformance.catalogue import CHECKS, HANDSHAKE, Check
from voxdisplay.conformance.dialogue import LogEntry, NoResponse, NotApplicable, Violation
from voxdisplay.conformance.packets import NoSuchFieldError
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.saved_page import restore_page, save_page
from voxdisplay.errors import TransportError
from voxdisplay.transport import Transport
from voxdisplay.wire import spec

_T = TypeVar("_T")
_MAX_SILENT_CHECKS = 3  # in a row; then the device is given up
_HURRY_AFTER = 3  # checks broken by silence; then less time is given


class Verdict(enum.Enum):
    """Outcome of a check."""

    HOLDS = "holds"
    BROKEN = "broken"
    NOT_APPLICABLE = "not applicable"
    NOT_RUN = "not run"


@dataclass(frozen=True, slots=True)
class Result:
    """Result of one check.

    Attributes
    ----------
    check : Check
    verdict : Verdict
    expected, actual, likely_cause : str
        If it is broken: what the document requires, what the device did, and the probable bug.
    reason : str
        If it was not run: why.
    log : tuple of LogEntry
        Packets sent and received, oldest first.
    """

    check: Check
    verdict: Verdict
    expected: str = ""
    actual: str = ""
    likely_cause: str = ""
    reason: str = ""
    log: tuple[LogEntry, ...] = ()

    @property
    def errors(self) -> list[str]:
        """ERRORs received in the check, in words, each once."""
        kind = spec.TYPE_ERROR
        received = (line for line in self.log if not line.sent and line.data[0] >> 4 == kind)
        return list(dict.fromkeys(line.text for line in received))

    @property
    def last_sent(self) -> LogEntry | None:
        """Latest packet sent, if possible one other than STATUS and READ."""
        polls = {spec.TYPE_STATUS << 4, spec.TYPE_READ << 4}
        sent = [entry for entry in self.log if entry.sent]
        others = [entry for entry in sent if entry.data[0] not in polls]
        return (others or sent)[-1] if sent else None


@dataclass(slots=True)
class Report:
    """Results of a run.

    Attributes
    ----------
    device : AnnouncedDevice or None
        None if the device did not respond.
    results : list of Result
        In the order of the checks.
    display_state : str
        What is on display now, in words.
    late_responses, slowest_response_s : int, float
        Number of responses that took longer than the limit, and the longest that any took.
    """

    device: AnnouncedDevice | None = None
    results: list[Result] = field(default_factory=list)
    display_state: str = "unknown"
    late_responses: int = 0
    slowest_response_s: float = 0.0

    def count(self, verdict: Verdict) -> int:
        """Return the number of checks with a verdict."""
        return sum(result.verdict is verdict for result in self.results)

    @property
    def holds(self) -> bool:
        """True if every check that applies to the device was run, at least one, and holds."""
        failed = self.count(Verdict.BROKEN) + self.count(Verdict.NOT_RUN)
        return not failed and self.count(Verdict.HOLDS) > 0


def select_checks(patterns: Iterable[str]) -> list[Check]:
    """Return the checks that any of the patterns selects; all, if there is no pattern.

    Raises
    ------
    ValueError
        If a pattern selects none.
    """
    patterns = list(patterns)
    for pattern in patterns:
        if not any(check.matches(pattern) for check in CHECKS):
            raise ValueError(f"{pattern!r} matches no check")
    return [
        check
        for check in CHECKS
        if not patterns or any(check.matches(pattern) for pattern in patterns)
    ]


def run_checks(
    pipe: Transport,
    only: Iterable[str] = (),
    *,
    timeout_s: float = 1.0,
    opening_s: float = 5.0,
    baud: int = 115200,
    seed: int = 0,
    clock: Callable[[], float] = time.monotonic,
    on_connected: Callable[[AnnouncedDevice, bool], object] | None = None,
    on_result: Callable[[Result], object] | None = None,
) -> Report:
    """Check the device at the other end of a pipe against protocol.md.

    Parameters
    ----------
    pipe : Transport
    only : iterable of str
        Sections, names or patterns of checks; all, if there are none.
    timeout_s, opening_s, baud, seed, clock
        As of `Probe`.
    on_connected : callable, optional
        Called before anything is drawn, with the announced device and whether its picture could be
        saved.
    on_result : callable, optional
        Called with the result of each check.

    Returns
    -------
    Report

    Raises
    ------
    ValueError
        If a pattern of ``only`` selects no check.
    """
    selected = select_checks(only)
    probe = Probe(pipe, timeout_s=timeout_s, opening_s=opening_s, baud=baud, seed=seed, clock=clock)
    report = Report()
    failure = _handshake(probe)
    if failure:
        report.results += _all_not_run(failure, selected)
        if on_result:
            for result in report.results:
                on_result(result)
        return report
    report.device = probe.device
    saved = _none_if_port_lost(lambda: save_page(probe))
    if on_connected:
        on_connected(probe.device, saved is not None)
    try:
        for result in _run_selected(probe, selected):
            report.results.append(result)
            if on_result:
                on_result(result)
    finally:  # after an interrupt, too
        report.late_responses = probe.late_count
        report.slowest_response_s = probe.slowest_s
        report.display_state = (
            _none_if_port_lost(lambda: restore_page(probe, saved)) or "unknown: the port is gone"
        )
    return report


def _handshake(probe: Probe) -> Result | None:
    """Open the first session; return the violation if the device cannot be tested at all."""
    likely = ""
    try:
        responded = probe.handshake()
        if not responded:
            likely = handshake_diagnosis.diagnose_silence(probe)
    except TransportError as error:
        responded, likely = False, str(error)
    device = probe.device
    is_sound = (
        device.format in FORMATS
        and device.voxel_count
        and device.max_payload >= spec.LIMIT_MIN_PAYLOAD
    )
    if responded and is_sound:
        return None
    came = str(probe.info) if responded else "no response that could be parsed"
    must = "an INFO that describes the device"
    return Result(HANDSHAKE, Verdict.BROKEN, must, came, likely, log=tuple(probe.log))


def _all_not_run(failure: Result, selected: list[Check]) -> Iterator[Result]:
    yield failure
    for check in selected:
        yield Result(check, Verdict.NOT_RUN, reason="the handshake failed")


def _run_selected(probe: Probe, selected: list[Check]) -> Iterator[Result]:
    """Run the checks until the device or the port is gone."""
    silent, gone = 0, ""
    for check in selected:
        if gone:
            yield Result(check, Verdict.NOT_RUN, reason=gone)
            continue
        try:
            result = _run_check(probe, check)
            silent = 0
        except _DeviceLost as lost:
            result = lost.result
            silent += 1
            gone = "the device does not respond any more" if silent == _MAX_SILENT_CHECKS else ""
        except TransportError as error:
            gone = str(error)
            result = _violation(probe, check, Violation("the port stays open", gone))
        yield result


class _DeviceLost(Exception):  # noqa: N818
    """The device does not even respond to HELLO."""

    def __init__(self, result: Result) -> None:
        super().__init__()
        self.result = result


def _run_check(probe: Probe, check: Check) -> Result:
    """Run one check in a session of its own; afterwards the device must respond to HELLO."""
    obstacle = check.not_applicable_reason(probe.device)
    if obstacle:
        return Result(check, Verdict.NOT_APPLICABLE, reason=obstacle)
    probe.start_check(check.id)
    result = Result(check, Verdict.HOLDS)
    timeouts = probe.timeout_count
    try:
        probe.open_session()
        check.run(probe)
    except NotApplicable as reason:
        result = Result(check, Verdict.NOT_APPLICABLE, reason=str(reason))
    except Violation as broken:
        result = _violation(probe, check, broken)
    except NoSuchFieldError as field:
        result = _violation(probe, check, Violation("a response of another type", str(field)))
    made = tuple(probe.log)
    if result.verdict is Verdict.BROKEN and probe.timeout_count > timeouts:
        probe.silent_failures += 1
        probe.is_hurried = probe.silent_failures >= _HURRY_AFTER
    try:
        probe.open_session()
    except NoResponse as silent:
        worse = _violation(probe, check, silent)
        raise _DeviceLost(result if result.verdict is Verdict.BROKEN else worse) from silent
    except Violation as restarted:
        if result.verdict is not Verdict.BROKEN:
            return _violation(probe, check, restarted)
        result = replace(result, likely_cause=restarted.likely_cause)
    return replace(result, log=made)


def _violation(probe: Probe, check: Check, broken: Violation) -> Result:
    return Result(
        check,
        Verdict.BROKEN,
        broken.expected,
        broken.actual,
        broken.likely_cause,
        log=tuple(probe.log),
    )


def _none_if_port_lost(do: Callable[[], _T]) -> _T | None:
    """Return the result of a call; None if the port is lost meanwhile."""
    try:
        return do()
    except TransportError:
        return None

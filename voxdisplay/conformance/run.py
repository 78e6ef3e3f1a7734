"""One check after the other, and what came of each. Prints nothing."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeVar

from voxdisplay.conformance import checks as _checks  # noqa: F401 - they enlist themselves
from voxdisplay.conformance import handshake_diagnosis
from voxdisplay.conformance.announced_device import FORMATS, AnnouncedDevice
from voxdisplay.conformance.catalogue import CHECKS, Check
from voxdisplay.conformance.dialogue import LogEntry, NoResponse, NotApplicable, Violation
from voxdisplay.conformance.packets import NoSuchFieldError
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.saved_page import restore_page, save_page
from voxdisplay.errors import TransportError
from voxdisplay.transport import Transport
from voxdisplay.wire import spec

_T = TypeVar("_T")
_MAX_SILENT_CHECKS = 3  # checks in a row without any answer, and the device is given up


class Verdict(enum.Enum):
    """What came of a check."""

    HOLDS = "holds"
    BROKEN = "broken"
    NOT_APPLICABLE = "not applicable"
    NOT_RUN = "not run"


@dataclass(frozen=True, slots=True)
class Result:
    """What came of one check.

    Attributes
    ----------
    check : Check
    verdict : Verdict
    must, came, likely : str
        If it is broken: what the document demands here, what was, and the probable mistake.
    reason : str
        If it was not made: why.
    log : tuple of Line
        What went over the wire, oldest first.
    """

    check: Check
    verdict: Verdict
    expected: str = ""
    actual: str = ""
    likely_cause: str = ""
    reason: str = ""
    log: tuple[LogEntry, ...] = ()

    @property
    def last_sent(self) -> LogEntry | None:
        """The latest packet that was sent and did not only ask."""
        asking = {spec.TYPE_STATUS << 4, spec.TYPE_READ << 4}
        lines = [line for line in self.log if line.sent]
        told = [line for line in lines if line.data[0] not in asking]
        return (told or lines)[-1] if lines else None


@dataclass(slots=True)
class Report:
    """What came of an examination.

    Attributes
    ----------
    device : Said or None
        What the device announced, None if it did not answer.
    results : list of Result
        In the order of the checks.
    left : str
        What is on display now.
    """

    device: AnnouncedDevice | None = None
    results: list[Result] = field(default_factory=list)
    display_state: str = "unknown"

    def count(self, verdict: Verdict) -> int:
        """Count the checks of which this came."""
        return sum(result.verdict is verdict for result in self.results)

    @property
    def holds(self) -> bool:
        """Whether every check that concerns the device was made, and holds."""
        return not self.count(Verdict.BROKEN) and not self.count(Verdict.NOT_RUN)


def select_checks(patterns: Iterable[str]) -> list[Check]:
    """Give the checks that any of the patterns names; all, if there is no pattern.

    Raises
    ------
    ValueError
        If a pattern names none.
    """
    patterns = list(patterns)
    for pattern in patterns:
        if not any(check.matches(pattern) for check in CHECKS):
            raise ValueError(f"no check is named by {pattern!r}")
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
    greeted: Callable[[AnnouncedDevice, bool], object] | None = None,
    ended: Callable[[Result], object] | None = None,
) -> Report:
    """Examine the device at the other end of a pipe.

    Parameters
    ----------
    pipe : Transport
    only : iterable of str
        Sections, names or patterns of checks; all, if there are none.
    timeout_s, opening_s, baud, seed, clock
        As of `Probe`.
    greeted : callable, optional
        Is told what the device announced, and whether its picture could be kept, before anything
        is drawn.
    ended : callable, optional
        Is told what came of each check.

    Returns
    -------
    Report

    Raises
    ------
    ValueError
        If ``only`` names no check.
    """
    selected = select_checks(only)
    probe = Probe(pipe, timeout_s=timeout_s, opening_s=opening_s, baud=baud, seed=seed, clock=clock)
    report = Report()
    stranger = _handshake(probe)
    if stranger:
        report.results += _all_not_run(stranger, selected)
        if ended:
            for result in report.results:
                ended(result)
        return report
    report.device = probe.device
    kept = _none_if_port_lost(lambda: save_page(probe))
    if greeted:
        greeted(probe.device, kept is not None)
    try:
        for result in _run_selected(probe, selected):
            report.results.append(result)
            if ended:
                ended(result)
    finally:  # also when somebody has seen enough
        report.display_state = (
            _none_if_port_lost(lambda: restore_page(probe, kept)) or "unknown: the port is gone"
        )
    return report


def _handshake(probe: Probe) -> Result | None:
    """Say hello; give what is wrong if the device cannot be talked to at all."""
    likely = ""
    try:
        met = probe.handshake()
        if not met:
            likely = handshake_diagnosis.diagnose_silence(probe)
    except TransportError as error:
        met, likely = False, str(error)
    device = probe.device
    is_sound = (
        device.format in FORMATS
        and device.voxel_count
        and device.max_payload >= spec.LIMIT_MIN_PAYLOAD
    )
    if met and is_sound:
        return None
    came = str(probe.info) if met else "nothing that could be read"
    must = "an INFO that says what the device is"
    return Result(
        handshake_diagnosis.CHECK, Verdict.BROKEN, must, came, likely, log=tuple(probe.log)
    )


def _all_not_run(stranger: Result, selected: list[Check]) -> Iterator[Result]:
    yield stranger
    for check in selected:
        yield Result(check, Verdict.NOT_RUN, reason="the device cannot be talked to")


def _run_selected(probe: Probe, selected: list[Check]) -> Iterator[Result]:
    """Make the checks, until the device or the port is gone."""
    deaf, gone = 0, ""
    for check in selected:
        if gone:
            yield Result(check, Verdict.NOT_RUN, reason=gone)
            continue
        try:
            result = _run_check(probe, check)
            deaf = 0
        except _DeviceLost as unheard:
            result = unheard.result
            deaf += 1
            gone = "the device does not answer any more" if deaf == _MAX_SILENT_CHECKS else ""
        except TransportError as error:
            gone = str(error)
            result = _violation(probe, check, Violation("the port stays open", gone))
        yield result


class _DeviceLost(Exception):  # noqa: N818
    """The device does not even answer HELLO."""

    def __init__(self, result: Result) -> None:
        super().__init__()
        self.result = result


def _run_check(probe: Probe, check: Check) -> Result:
    """Make one check, in a session of its own; afterwards the device must answer HELLO."""
    obstacle = check.not_applicable_reason(probe.device)
    if obstacle:
        return Result(check, Verdict.NOT_APPLICABLE, reason=obstacle)
    probe.start_check(check.id)
    result = Result(check, Verdict.HOLDS)
    try:
        probe.open_session()
        check.run(probe)
    except NotApplicable as reason:
        result = Result(check, Verdict.NOT_APPLICABLE, reason=str(reason))
    except Violation as broken:
        result = _violation(probe, check, broken)
    except NoSuchFieldError as field:
        result = _violation(probe, check, Violation("an answer of another type", str(field)))
    made = tuple(probe.log)
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
    """Do something that a lost port may end."""
    try:
        return do()
    except TransportError:
        return None

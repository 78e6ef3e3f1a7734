"""Checks of section 7.12: frames that are held (op HOLD).

A hold is counted by the device's ticks, and observed by the kit's clock, so only what is certain is
judged. A hold of n ticks lasts for n periods from an exchange that cannot have been before its
frame was sent: a frame that is still pending after less than that is held, and one on display after
less than that is not. On a busy computer an answer may come too late to tell: then the check is
made again, with a longer hold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.catalogue import (
    check,
    feature,
    min_voxels,
    readable_display,
    refresh_tick,
)
from voxdisplay.conformance.dialogue import NoResponse, Violation
from voxdisplay.conformance.packets import CLEAR, COMMIT, PENDING, SHOWN, Response, data, status
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_HELD_S = 0.4  # several times what an answer takes
_LEAST_TICKS = 4
_CERTAIN = 0.75  # of a hold: the rest is for the device's clock
_TRIES = 5
_FINDINGS = 2  # tries that find the same violation


def can_hold(device: AnnouncedDevice) -> str:
    """Require that frames can be held."""
    return feature("HOLD")(device) or refresh_tick(device)


def _ticks(probe: Probe, attempt: int) -> int:
    """Return the ticks of a hold that is observed, longer with each attempt."""
    device = probe.device
    longest = min(spec.LIMIT_MAX_HOLD, spec.LIMIT_MAX_HELD * device.refresh // 1_000_000)
    if longest < _LEAST_TICKS:
        probe.skip("a refresh tick takes too long to hold a frame for some of them")
    return min(max(_LEAST_TICKS, round((1 + attempt) * _HELD_S / device.period_s)), longest)


def _observe(probe: Probe, attempt: Callable[[int], bool]) -> None:
    """Make attempts until one is certain; raise a violation that was found twice.

    Parameters
    ----------
    probe : Probe
    attempt : callable
        Takes the ticks of its hold, raises `Violation`, and returns whether the answers came soon
        enough for a device that breaks the requirement to be found.
    """
    found: list[Violation] = []
    for number in range(_TRIES):
        try:
            if attempt(_ticks(probe, number)):
                return
        except NoResponse:
            raise
        except Violation as violation:
            found.append(violation)
            if len(found) == _FINDINGS:
                break
        probe.open_session()
    if found:
        raise found[-1]
    probe.skip("this computer is too busy to observe a hold")


def _await_exchange(probe: Probe, most_s: float, what: str) -> float:
    """Poll until the current frame is on display; return when it was pending for certain.

    Raises
    ------
    Violation
        If a STATUS that was sent more than ``most_s`` seconds from now is answered with PENDING.
    """
    began_s = pending_s = probe.clock()
    while True:
        asked_s = probe.clock()
        probe.poll_status()
        if not probe.state.flags & PENDING or asked_s - began_s > most_s:
            probe.require_ack(probe.state, what, pending=0, shown=1, frame=probe.frame)
            return pending_s
        pending_s = asked_s
        probe.wait_two_ticks()


def _is_held(probe: Probe, ticks: int, payloads: Sequence[bytes], what: str) -> bool:
    """Present a frame that is held; require that it is pending for its hold, and not for longer.

    Parameters
    ----------
    probe : Probe
    ticks : int
        The hold.
    payloads : sequence of bytes
        The ops of the frame's packets.
    what : str
        The likely cause if it is exchanged before.

    Returns
    -------
    bool
        False if the answers came too late to tell.
    """
    held_s = ticks * probe.device.period_s
    began_s = probe.clock()  # the hold counts from an exchange behind this
    probe.show(b"")
    *first, last = payloads
    for payload in first:
        probe.draw(payload)
    probe.draw(last, commit=True)
    probe.stay_silent(held_s / 2)
    probe.poll_status()
    is_certain = probe.clock() - began_s < _CERTAIN * held_s
    if is_certain:
        probe.require_ack(probe.state, what, pending=1)
    _await_exchange(probe, held_s, "the frame was held for longer than its hold")
    probe.frame += 1
    return is_certain


def _is_shown_soon(probe: Probe, ticks: int, from_s: float, what: str) -> bool:
    """Require that the frame that was sent waits for its tick only.

    Parameters
    ----------
    probe : Probe
    ticks : int
        The hold for which a device that is wrong keeps it pending.
    from_s : float
        Time of `Probe.clock` before that hold began.
    what : str
        The likely cause if it waits for longer.

    Returns
    -------
    bool
        False if the answers came too late to tell.
    """
    held_s = ticks * probe.device.period_s
    _await_exchange(probe, held_s / 2, what)
    return probe.clock() - from_s < _CERTAIN * held_s


@check(
    "7.12",
    "hold-draws-nothing",
    "HOLD changes neither cursor nor pen",
    can_hold,
    readable_display,
    min_voxels(3),
)
def hold_draws_nothing(probe: Probe) -> None:
    device = probe.device
    for ticks in (0, 1):
        hold = ops.hold(ticks)
        probe.show(ops.pen(device, 1) + ops.run() + hold + ops.run() + hold)


@check(
    "7.12",
    "hold-draws-no-fade",
    "HOLD does not end a fade, nor count a voxel of it",
    can_hold,
    feature("FADE"),
    readable_display,
    min_voxels(2),
)
def hold_draws_no_fade(probe: Probe) -> None:
    device = probe.device
    axis = max(range(3), key=lambda axis: device.grid[axis])
    forth, back = 8 * axis, 8 * axis + (1 << axis)
    payload = ops.fade(device, ((1, 2, 9), (200, 100, 3)), 5, 0)
    payload += ops.chain(device, forth, [0], (0, 0, 0)) + ops.hold(0) + ops.chain(device, back, [0])
    probe.show(payload)


@check("7.12", "held", "a frame stays on display for as many ticks as HOLD says", can_hold)
def held(probe: Probe) -> None:
    early = "the frame was exchanged before its hold was over"
    _observe(probe, lambda ticks: _is_held(probe, ticks, [ops.hold(ticks)], early))


@check("7.12", "longest-counts", "the longest HOLD of a frame counts, in any packet", can_hold)
def longest_counts(probe: Probe) -> None:
    def attempt(ticks: int) -> bool:
        first = ops.hold(1) + ops.hold(ticks) + ops.hold(2)
        longest = "the longest of several HOLD counts, not the last one"
        return _is_held(probe, ticks, [first, ops.hold(0)], longest)

    _observe(probe, attempt)


@check(
    "7.12",
    "since-the-swap",
    "a hold counts from the exchange before, whenever the frame comes",
    can_hold,
)
def since_the_swap(probe: Probe) -> None:
    def attempt(ticks: int) -> bool:
        probe.show(b"")
        probe.stay_silent((ticks + 1) * probe.device.period_s)
        from_s = probe.clock()
        probe.draw(ops.hold(ticks))
        probe.draw(ops.hold(ticks), commit=True)
        wrong = "a hold counts from the exchange before, not from its packet"
        return _is_shown_soon(probe, ticks, from_s, wrong)

    _observe(probe, attempt)


@check("7.12", "hold-is-dropped", "a hold is dropped with a frame that is abandoned", can_hold)
def hold_is_dropped(probe: Probe) -> None:
    def attempt(ticks: int) -> bool:
        from_s = probe.clock()
        probe.show(b"")
        probe.draw(ops.hold(ticks))
        probe.frame += 1
        probe.draw(b"", commit=True)
        wrong = "the hold of a frame that was dropped counts for the next one"
        return _is_shown_soon(probe, ticks, from_s, wrong)

    _observe(probe, attempt)


@check("7.12", "one-frame-alone", "a hold is that of one frame", can_hold)
def one_frame_alone(probe: Probe) -> None:
    def attempt(ticks: int) -> bool:
        probe.show(b"")
        probe.draw(ops.hold(ticks), commit=True)
        from_s = _await_exchange(
            probe, 2 * ticks * probe.device.period_s, "the frame was held for longer than its hold"
        )
        probe.frame += 1
        probe.draw(b"", commit=True)
        wrong = "the hold of a frame counts for the next one, too"
        return _is_shown_soon(probe, ticks, from_s, wrong)

    _observe(probe, attempt)


@check("7.12", "first-is-not-held", "the first frame of a session is not held", can_hold)
def first_is_not_held(probe: Probe) -> None:
    def attempt(ticks: int) -> bool:
        from_s = probe.clock()
        probe.show(b"")
        probe.open_session()
        probe.draw(ops.hold(spec.LIMIT_MAX_HOLD), commit=True)
        wrong = "at HELLO, `since` is 255: no hold outlives its session"
        return _is_shown_soon(probe, ticks, from_s, wrong)

    _observe(probe, attempt)


@check("7.12", "hello-drops-held", "HELLO drops a frame that is held", can_hold)
def hello_drops_held(probe: Probe) -> None:
    def attempt(ticks: int) -> bool:
        from_s = probe.clock()
        probe.show(b"")
        probe.draw(ops.hold(ticks), commit=True)
        probe.open_session()
        probe.draw(b"", commit=True)
        wrong = "the hold of a frame of an earlier session counts"
        return _is_shown_soon(probe, ticks, from_s, wrong)

    _observe(probe, attempt)


@check("7.12", "next-is-held-up", "packets of the next frame wait for the hold", can_hold)
def next_is_held_up(probe: Probe) -> None:
    _observe(probe, lambda ticks: _is_held_up(probe, ticks))


def _is_held_up(probe: Probe, ticks: int) -> bool:
    """Send a frame that is held, and a packet behind it; require that this one waits."""
    held_s = ticks * probe.device.period_s
    began_s = probe.clock()
    probe.show(b"")
    first, second = probe.seq, probe.frame
    probe.send(
        data(first, second, ops.hold(ticks), CLEAR | COMMIT),
        data(first + 1, second + 1, b"", CLEAR),
        status(77),
    )
    must = "the packet behind a held frame waits for the tick"
    for answer in probe.responses():
        if answer.kind == spec.TYPE_ACK and answer.next == (first + 2) % 256:
            probe.require(_is_shown(answer, second), must, answer)
            is_early = probe.clock() - began_s < _CERTAIN * held_s
            probe.require(not is_early, must, answer)
            break
    else:
        probe.fail("ACK of the packet behind a held frame", "nothing")
    return True


def _is_shown(ack: Response, frame: int) -> bool:
    return bool(ack.flags & SHOWN) and ack.frame == frame

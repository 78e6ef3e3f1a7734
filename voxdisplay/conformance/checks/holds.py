"""Checks of section 7.12: frames that are held (op HOLD).

A time is compared with a pause of the kit's own only where that pause is several ticks longer or
shorter. On a busy computer a pause may take longer than asked: then the check is made once more.
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
from voxdisplay.conformance.packets import CLEAR, COMMIT, PENDING, data, status
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_HELD_S = 0.4  # the round trip of a STATUS has room in half of it
_LEAST_TICKS = 4
_TRIES = 5


def can_hold(device: AnnouncedDevice) -> str:
    """Require that frames can be held."""
    return feature("HOLD")(device) or refresh_tick(device)


def _ticks(probe: Probe) -> int:
    """Return the ticks of a hold that lasts long enough to be observed."""
    period_s = probe.device.period_s
    ticks = min(max(_LEAST_TICKS, round(_HELD_S / period_s)), spec.LIMIT_MAX_HOLD)
    if 1000 * ticks * period_s > spec.LIMIT_MAX_HELD:
        probe.skip("a refresh tick takes too long to hold a frame for some of them")
    return ticks


def _show_held(probe: Probe, what: str, payloads: Callable[[int], Sequence[bytes]]) -> None:
    """Present a frame that is held; require that it is still pending after half of its hold.

    Parameters
    ----------
    probe : Probe
    what : str
        The likely cause if it is not.
    payloads : callable
        Returns the packets' ops, of which the longest HOLD is the number of ticks it is given.
    """
    ticks = _ticks(probe)
    held_s = ticks * probe.device.period_s
    for _ in range(_TRIES):
        began_s = probe.clock()  # the hold counts from a swap behind this
        probe.show(b"")
        *first, last = payloads(ticks)
        for payload in first:
            probe.draw(payload)
        probe.draw(last, commit=True)
        probe.stay_silent(held_s / 2)
        probe.poll_status()
        in_time = probe.clock() - began_s < held_s
        if in_time:
            probe.require_ack(probe.state, what, pending=1)
        probe.await_shown(probe.frame, [probe.state])
        if in_time:
            return
        probe.frame += 1
    probe.skip("this computer is too busy to observe a hold")


def _require_shown_soon(probe: Probe, what: str) -> None:
    """Require that the frame that was sent is on display after two ticks.

    A device that is late has half the time for which a frame is held wrongly.
    """
    until_s = probe.clock() + _ticks(probe) * probe.device.period_s / 2
    while True:
        probe.wait_two_ticks()
        probe.poll_status()
        if not probe.state.flags & PENDING or probe.clock() > until_s:
            break
    probe.require_ack(probe.state, what, pending=0, shown=1, frame=probe.frame)


def _first_frame(probe: Probe) -> int:
    """Present a dark frame; return the ticks of a hold for the next one."""
    ticks = _ticks(probe)
    probe.show(b"")
    return ticks


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
    _show_held(probe, early, lambda ticks: [ops.hold(ticks)])
    _require_shown_soon(probe, "")


@check("7.12", "longest-counts", "the longest HOLD of a frame counts, in any packet", can_hold)
def longest_counts(probe: Probe) -> None:
    _show_held(
        probe,
        "the longest of several HOLD counts, not the last one",
        lambda ticks: [ops.hold(1) + ops.hold(ticks) + ops.hold(2), ops.hold(0)],
    )


@check(
    "7.12",
    "since-the-swap",
    "a hold counts from the exchange before, whenever the frame comes",
    can_hold,
)
def since_the_swap(probe: Probe) -> None:
    ticks = _first_frame(probe)
    probe.stay_silent((ticks + 1) * probe.device.period_s)
    probe.draw(ops.hold(ticks))
    probe.draw(ops.hold(ticks), commit=True)
    _require_shown_soon(probe, "a hold counts from the exchange before, not from its packet")


@check("7.12", "hold-is-dropped", "a hold is dropped with a frame that is abandoned", can_hold)
def hold_is_dropped(probe: Probe) -> None:
    ticks = _first_frame(probe)
    probe.draw(ops.hold(ticks))
    probe.frame += 1
    probe.draw(b"", commit=True)
    _require_shown_soon(probe, "the hold of a frame that was dropped counts for the next one")


@check("7.12", "one-frame-alone", "a hold is that of one frame", can_hold)
def one_frame_alone(probe: Probe) -> None:
    ticks = _first_frame(probe)
    probe.draw(ops.hold(ticks), commit=True)
    probe.await_shown(probe.frame, [probe.state])
    probe.frame += 1
    probe.draw(b"", commit=True)
    _require_shown_soon(probe, "the hold of a frame counts for the next one, too")


@check("7.12", "first-is-not-held", "the first frame of a session is not held", can_hold)
def first_is_not_held(probe: Probe) -> None:
    _first_frame(probe)
    probe.open_session()
    probe.draw(ops.hold(spec.LIMIT_MAX_HOLD), commit=True)
    _require_shown_soon(probe, "at HELLO, `since` is 255: no hold outlives its session")


@check("7.12", "hello-drops-held", "HELLO drops a frame that is held", can_hold)
def hello_drops_held(probe: Probe) -> None:
    ticks = _first_frame(probe)
    probe.draw(ops.hold(ticks), commit=True)
    probe.open_session()
    probe.draw(b"", commit=True)
    _require_shown_soon(probe, "the hold of a frame of an earlier session counts")


@check("7.12", "next-is-held-up", "packets of the next frame wait for the hold", can_hold)
def next_is_held_up(probe: Probe) -> None:
    ticks = _first_frame(probe)
    first, second = probe.seq, probe.frame
    sent_s = probe.clock()
    probe.send(
        data(first, second, ops.hold(ticks), CLEAR | COMMIT),
        data(first + 1, second + 1, b"", CLEAR),
        status(77),
    )
    for answer in probe.responses():
        waited_s = probe.clock() - sent_s
        if answer.kind == spec.TYPE_ACK and answer.next == (first + 2) % 256:
            early = waited_s < (ticks / 2) * probe.device.period_s
            probe.require(not early, "the packet behind a held frame waits for the tick", answer)
            return
    probe.fail("ACK of the packet behind a held frame", "nothing")

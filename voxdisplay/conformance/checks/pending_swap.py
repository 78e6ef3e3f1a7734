"""Checks of sections 6 and 13: packets while a whole frame waits for its tick."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, min_voxels, readable_display, refresh_tick
from voxdisplay.conformance.checks.frames import lit_page
from voxdisplay.conformance.packets import (
    ASKED,
    CLEAR,
    COMMIT,
    PENDING,
    SHOWN,
    Response,
    data,
    hello,
    status,
)
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_ATTEMPTS = 8
_COMPARISONS = 12
_SWAPS = 24
_LONGEST_PAUSE_S = 1.0
_TAG = 77  # of a STATUS that is sent between other packets


def index_of_swap(responses: list[Response], frame: int) -> int:
    """Return the position of the first response that reports a frame as on display."""
    for at, answer in enumerate(responses):
        if answer.kind == spec.TYPE_ACK and answer.flags & SHOWN and answer.frame == frame:
            return at
    return len(responses)


@check("6", "pending", "a whole frame is pending until its tick: PENDING in ACK", refresh_tick)
def pending(probe: Probe) -> None:
    for frame in range(_ATTEMPTS):
        probe.send(data(frame, frame, b"", CLEAR | COMMIT))
        ack = next(probe.responses(), None)
        if ack is None:
            probe.fail("ACK", "nothing")
        is_shown = ack.flags & SHOWN and ack.frame == frame
        probe.require(
            bool(is_shown or ack.flags & PENDING), "PENDING in the ACK of a whole frame", ack
        )
        responses = probe.poll_status()
        probe.await_shown(frame, [*responses, probe.state])
        probe.poll_status()
        probe.require_ack(probe.state, "on display, a frame is not pending any more", pending=0)
        if not is_shown:
            return


@check(
    "6", "swaps-at-a-tick", "pages are exchanged at a tick, not when a frame is whole", refresh_tick
)
def swaps_at_a_tick(probe: Probe) -> None:
    """Judge many swaps together: any one of them may have met its tick.

    Frames whose COMMIT is sent at any time of a period wait for anything up to a period. One late
    answer is the host's: the second longest wait counts.
    """
    period_s = probe.device.period_s
    waits_s: list[float] = []
    for frame in range(_SWAPS):
        probe.stay_silent(probe.rng.random() * min(period_s, _LONGEST_PAUSE_S))
        sent_s = probe.clock()
        probe.send(data(frame, frame, b"", CLEAR | COMMIT))
        probe.await_shown(frame)
        waits_s = sorted([*waits_s, probe.clock() - sent_s])
        if frame and waits_s[-2] - waits_s[0] > period_s / 3:
            return
    round_trip_s = _round_trip_s(probe)
    if round_trip_s > period_s / 4:
        probe.skip("the port is too slow to tell a tick from the next")
    if waits_s[-2] - round_trip_s > period_s / 2:
        return  # it does wait, if only for the STATUS that was sent then: see swap-reported
    probe.fail(
        f"frames that wait for a tick, for up to {1000 * period_s:.1f} ms",
        f"{_SWAPS} frames, sent at any time, were shown after {1000 * waits_s[0]:.1f} ms to"
        f" {1000 * waits_s[-2]:.1f} ms",
        "the pages are exchanged as soon as a frame is whole, although INFO announces a refresh",
    )


def _round_trip_s(probe: Probe) -> float:
    """Return the median time between a STATUS and its response, in seconds."""
    times_s = []
    for _ in range(9):
        sent_s = probe.clock()
        probe.poll_status()
        times_s.append(probe.clock() - sent_s)
    return sorted(times_s)[len(times_s) // 2]


@check("6", "next-waits", "while f is pending, a packet of f + 1 waits for the tick", refresh_tick)
def next_waits(probe: Probe) -> None:
    for _ in range(3):
        probe.open_session()
        responses = probe.send_and_poll(
            data(0, 0, ops.single_voxel(probe.device, 0), CLEAR | COMMIT),
            data(1, 1, ops.single_voxel(probe.device, 0, 0), 0),
        )
        responses.append(probe.state)
        at = index_of_swap(responses, 0)
        for answer in responses[:at]:
            early = answer.kind == spec.TYPE_ACK and answer.next == 2
            probe.require(not early, "the swap of frame 0 before anything behind it", answer)
        probe.require(
            at < len(responses), "frame 0 on display before anything behind it", responses[-1]
        )
        probe.require_displayed(probe.state, lit_page(probe, 0))


@check(
    "6", "waits-unchecked", "a packet that waits for the tick is not checked before", refresh_tick
)
def waits_unchecked(probe: Probe) -> None:
    for packet, code, offset in (
        (data(1, 1, b"\x1f"), spec.CODE_OP, 3),
        (data(1, 9), spec.CODE_FRAME, 2),
        (data(1, 1, b"", 2), spec.CODE_FIELD, 0),
        (data(64, 1), spec.CODE_SEQUENCE, 1),
    ):
        responses = _responses_behind_pending(probe, packet)
        errors = [at for at, answer in enumerate(responses) if answer.kind == spec.TYPE_ERROR]
        probe.require(
            bool(errors), "ERROR after the swap", responses[-1] if responses else "nothing"
        )
        error = responses[errors[0]]
        probe.require(
            index_of_swap(responses, 0) < errors[0],
            "frame 0 on display before the packet that waits is refused",
            error,
        )
        right = (error.code, error.offset) == (code, offset)
        probe.require(right, f"ERROR with code {code} at offset {offset}", error)


def _responses_behind_pending(probe: Probe, packet: bytes) -> list[Response]:
    """Send a packet behind a frame's COMMIT, again if the tick came in between."""
    for _ in range(_ATTEMPTS):
        probe.open_session()
        responses = probe.send_and_poll(data(0, 0, b"", CLEAR | COMMIT), packet)
        if any(answer.kind == spec.TYPE_ACK and answer.flags & PENDING for answer in responses):
            break
    return responses


@check(
    "6", "all-waits", "everything behind a packet that waits for the tick waits, too", refresh_tick
)
def all_waits(probe: Probe) -> None:
    for _ in range(3):
        probe.open_session()
        session = probe.session % 65535 + 1
        responses = probe.send_and_poll(
            data(0, 0, b"", CLEAR | COMMIT), data(1, 1), status(_TAG), hello(session)
        )
        probe.session = session
        swap = index_of_swap(responses, 0)
        early = [answer for answer in responses[:swap] if _answers_status(answer)]
        probe.require(not early, "frame 0 on display before STATUS is answered", early)
        kinds = [answer.kind for answer in responses]
        probe.require(spec.TYPE_INFO in kinds, "INFO", responses[-1] if responses else "nothing")
        info = kinds.index(spec.TYPE_INFO)
        probe.require(
            index_of_swap(responses, 0) < info,
            "frame 0 on display before HELLO is taken",
            responses[info],
        )


def _answers_status(answer: Response) -> bool:
    return answer.kind == spec.TYPE_ACK and bool(answer.flags & ASKED) and answer.last == _TAG


@check(
    "9.1",
    "duplicate-while-pending",
    "a duplicate does not wait for the tick, whatever its frame",
    refresh_tick,
)
def duplicate_while_pending(probe: Probe) -> None:
    """Compare with a STATUS alone: the tick may come before either is answered."""

    def overtakes_the_tick(*between: bytes) -> bool:
        probe.open_session()
        responses = probe.send_and_poll(data(0, 0, b"", CLEAR | COMMIT), *between, status(_TAG))
        return any(_answers_status(answer) and answer.flags & PENDING for answer in responses)

    alone = 0
    for _ in range(_COMPARISONS):
        alone += overtakes_the_tick()
        if overtakes_the_tick(data(0, 1)):
            return
    probe.require(
        alone < _COMPARISONS * 3 // 4,
        "ACK, and what comes behind it answered, while frame 0 is pending",
        f"no answer before the swap in {_COMPARISONS} attempts, but {alone} without the duplicate",
        "whether a packet is a duplicate is tested before whether it waits",
    )


@check(
    "6",
    "own-while-pending",
    "a packet of f is refused while f is pending: FRAME at 2",
    refresh_tick,
)
def own_while_pending(probe: Probe) -> None:
    responses = probe.send_and_poll(data(0, 0, b"", CLEAR | COMMIT), data(1, 0))
    errors = [answer for answer in responses if answer.kind == spec.TYPE_ERROR]
    probe.require(bool(errors), "ERROR FRAME", responses[-1] if responses else "nothing")
    right = (errors[0].code, errors[0].offset) == (spec.CODE_FRAME, 2)
    probe.require(right, "ERROR FRAME at offset 2", errors[0])


@check(
    "6",
    "one-after-another",
    "consecutive frames are shown in their order",
    readable_display,
    min_voxels(3),
)
def one_after_another(probe: Probe) -> None:
    for frame in range(6):
        probe.show(ops.single_voxel(probe.device, frame % 3), clear=frame % 3 == 0)

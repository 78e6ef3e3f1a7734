"""Checks of sections 6 and 13: packets while a whole frame waits for its tick."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, min_voxels, readable_display, refresh_tick
from voxdisplay.conformance.checks.frames import lit_page
from voxdisplay.conformance.packets import CLEAR, COMMIT, PENDING, SHOWN, Response, data, hello
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_ATTEMPTS = 8


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
    for frame, ops_, code, offset in (
        (1, b"\x1f", spec.CODE_OP, 3),
        (9, b"", spec.CODE_FRAME, 2),
    ):
        probe.open_session()
        responses = probe.send_and_poll(data(0, 0, b"", CLEAR | COMMIT), data(1, frame, ops_))
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


@check(
    "6", "all-waits", "everything behind a packet that waits for the tick waits, too", refresh_tick
)
def all_waits(probe: Probe) -> None:
    for _ in range(3):
        probe.open_session()
        session = probe.session % 65535 + 1
        responses = probe.send_and_poll(data(0, 0, b"", CLEAR | COMMIT), data(1, 1), hello(session))
        probe.session = session
        kinds = [answer.kind for answer in responses]
        probe.require(spec.TYPE_INFO in kinds, "INFO", responses[-1] if responses else "nothing")
        info = kinds.index(spec.TYPE_INFO)
        probe.require(
            index_of_swap(responses, 0) < info,
            "frame 0 on display before HELLO is taken",
            responses[info],
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

"""Section 6 and 13: what happens while a whole frame waits for its tick."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, seen, ticking, voxels
from voxdisplay.conformance.checks.frames import lit
from voxdisplay.conformance.packets import CLEAR, COMMIT, PENDING, SHOWN, Answer, data, hello
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_ATTEMPTS = 8


def shown_at(come: list[Answer], frame: int) -> int:
    """Give where among the answers a frame is first said to be on display."""
    for at, answer in enumerate(come):
        if answer.kind == spec.TYPE_ACK and answer.flags & SHOWN and answer.frame == frame:
            return at
    return len(come)


@check("6", "pending", "a whole frame is pending until its tick, and ACK says so", ticking)
def pending(probe: Probe) -> None:
    for frame in range(_ATTEMPTS):
        probe.send(data(frame, frame, b"", CLEAR | COMMIT))
        ack = next(probe.answers(), None)
        if ack is None:
            probe.fail("ACK", "nothing")
        is_shown = ack.flags & SHOWN and ack.frame == frame
        probe.demand(
            bool(is_shown or ack.flags & PENDING), "PENDING in the ACK of a whole frame", ack
        )
        come = probe.sync()
        probe.await_shown(frame, [*come, probe.state])
        probe.sync()
        probe.demand_ack(probe.state, "on display, a frame is not pending any more", pending=0)
        if not is_shown:
            return


@check("6", "next-waits", "while f is pending, a packet of f + 1 is not taken", ticking)
def next_waits(probe: Probe) -> None:
    for _ in range(3):
        probe.open()
        come = probe.say(
            data(0, 0, ops.dot(probe.said, 0), CLEAR | COMMIT),
            data(1, 1, ops.dot(probe.said, 0, 0), 0),
        )
        come.append(probe.state)
        at = shown_at(come, 0)
        for answer in come[:at]:
            early = answer.kind == spec.TYPE_ACK and answer.next == 2
            probe.demand(not early, "the swap of frame 0 before anything behind it", answer)
        probe.demand(at < len(come), "frame 0 on display before anything behind it", come[-1])
        probe.look(probe.state, lit(probe, 0))


@check("6", "waits-unchecked", "what waits is not checked before the tick", ticking)
def waits_unchecked(probe: Probe) -> None:
    for frame, ops_, code, offset in (
        (1, b"\x1f", spec.CODE_OP, 3),
        (9, b"", spec.CODE_FRAME, 2),
    ):
        probe.open()
        come = probe.say(data(0, 0, b"", CLEAR | COMMIT), data(1, frame, ops_))
        errors = [at for at, answer in enumerate(come) if answer.kind == spec.TYPE_ERROR]
        probe.demand(bool(errors), "ERROR after the swap", come[-1] if come else "nothing")
        error = come[errors[0]]
        probe.demand(
            shown_at(come, 0) < errors[0], "frame 0 on display before what waits is refused", error
        )
        right = (error.code, error.offset) == (code, offset)
        probe.demand(right, f"ERROR with code {code} at offset {offset}", error)


@check("6", "all-waits", "nor is anything taken that came behind a packet that waits", ticking)
def all_waits(probe: Probe) -> None:
    for _ in range(3):
        probe.open()
        session = probe.session % 65535 + 1
        come = probe.say(data(0, 0, b"", CLEAR | COMMIT), data(1, 1), hello(session))
        probe.session = session
        kinds = [answer.kind for answer in come]
        probe.demand(spec.TYPE_INFO in kinds, "INFO", come[-1] if come else "nothing")
        info = kinds.index(spec.TYPE_INFO)
        probe.demand(
            shown_at(come, 0) < info, "frame 0 on display before HELLO is taken", come[info]
        )


@check("6", "own-while-pending", "a packet of f is refused while f is pending: FRAME at 2", ticking)
def own_while_pending(probe: Probe) -> None:
    come = probe.say(data(0, 0, b"", CLEAR | COMMIT), data(1, 0))
    errors = [answer for answer in come if answer.kind == spec.TYPE_ERROR]
    probe.demand(bool(errors), "ERROR FRAME", come[-1] if come else "nothing")
    right = (errors[0].code, errors[0].offset) == (spec.CODE_FRAME, 2)
    probe.demand(right, "ERROR FRAME at offset 2", errors[0])


@check(
    "6", "one-after-another", "frames sent one behind the other are shown in turn", seen, voxels(3)
)
def one_after_another(probe: Probe) -> None:
    for frame in range(6):
        probe.show(ops.dot(probe.said, frame % 3), clear=frame % 3 == 0)

"""Section 9.2: the device has the room that it promises."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, ticking
from voxdisplay.conformance.checks.pending_swap import shown_at
from voxdisplay.conformance.packets import ASKED, CLEAR, COMMIT, data, status, wire
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_BURST_BYTES = 1 << 16
_IDLE_S = 1.5


def filling(probe: Probe, first: int, frame: int, room: int) -> list[bytes]:
    """Give DATA packets that fill so many bytes on the wire, as far as the window allows."""
    packets: list[bytes] = []
    size = min(probe.said.max_payload, max(room // 24, 32))
    for seq in range(first, first + spec.LIMIT_WINDOW):
        packet = data(seq, frame, bytes(min(size, max(room - 16, 0))))
        cost = len(wire(packet))
        if cost > room:
            break
        packets.append(packet)
        room -= cost
    return packets


@check("9.2", "returned", "what has been taken gives its room back: credit never runs out")
def returned(probe: Probe) -> None:
    said = probe.said
    least = spec.LIMIT_RESERVE + said.longest_wire
    size = said.max_payload
    for _ in range(min(4 * said.rx_buffer, _BURST_BYTES) // size + 8):
        probe.draw(bytes(size))
        probe.demand(
            probe.state.credit >= least,
            f"credit for 64 bytes and the longest packet, {least}, when all has been taken",
            probe.state,
            "credit is the room behind the packet named by `last`, not what is left of a total",
        )


@check(
    "9.2",
    "not-withdrawn",
    "room that was promised is not taken back",
)
def not_withdrawn(probe: Probe) -> None:
    said = probe.said
    room = min(said.rx_buffer, _BURST_BYTES) - spec.LIMIT_RESERVE
    burst = filling(probe, 0, 0, room)
    ends, end = [], 0
    for packet in burst:
        end += len(wire(packet))
        ends.append(end)
    promised = said.rx_buffer
    for answer in probe.say(*burst):
        if answer.kind != spec.TYPE_ACK or answer.flags & ASKED or answer.last >= len(ends):
            continue
        reach = ends[answer.last] + answer.credit
        probe.demand(
            reach >= promised,
            f"credit {promised - ends[answer.last]} at least, promised before",
            answer,
            "credit counts from the end of the packet named by `last`, whatever of it has arrived",
        )
        promised = reach
    probe.demand_ack(probe.state, next=len(burst))


@check("9.2", "does-not-lapse", "credit, and its session, stay as they are while nothing is sent")
def does_not_lapse(probe: Probe) -> None:
    probe.sync()
    before = probe.state
    probe.rest(_IDLE_S + 2 * probe.said.period_s)
    probe.sync()
    likely = "a host that has nothing to say says nothing: the device must not count the time"
    probe.demand_ack(probe.state, likely, session=probe.session)
    left = before.credit - len(wire(status(0)))
    probe.demand(probe.state.credit >= left, f"credit {left} at least", probe.state, likely)
    burst = filling(probe, 0, 0, min(left, _BURST_BYTES) - spec.LIMIT_RESERVE)
    for answer in probe.say(*burst):
        probe.demand(answer.kind != spec.TYPE_ERROR, "all packets are taken", answer, likely)
    probe.demand_ack(probe.state, likely, next=len(burst), damaged=before.damaged)


@check(
    "9.2",
    "room-is-there",
    "all that credit allows is taken, also behind a frame that waits",
    ticking,
)
def room_is_there(probe: Probe) -> None:
    said = probe.said
    for round_ in range(3):
        probe.open()
        probe.sync()
        damaged = probe.state.damaged
        first = data(0, 0, ops.run(), CLEAR | COMMIT)
        room = min(said.rx_buffer, 1 << 20) - spec.LIMIT_RESERVE - len(wire(first))
        burst = filling(probe, 1, 1, room)
        come = probe.say(first, *burst)
        for answer in come:
            probe.demand(
                answer.kind != spec.TYPE_ERROR,
                f"{len(burst)} packets in the room of {said.rx_buffer} bytes are taken",
                answer,
                "a packet that waits still takes room: is rx_buffer what the device really has?",
            )
        probe.demand_ack(probe.state, next=(1 + len(burst)) % 256, damaged=damaged)
        probe.demand(shown_at([*come, probe.state], 0) <= len(come), "frame 0 is shown", round_)


@check("9.2", "zeros-between", "00 between packets needs no credit", ticking)
def zeros_between(probe: Probe) -> None:
    said = probe.said
    probe.sync()
    damaged = probe.state.damaged
    first = data(0, 0, b"", CLEAR | COMMIT)
    room = min(said.rx_buffer, 1 << 20) - spec.LIMIT_RESERVE - len(wire(first))
    burst = filling(probe, 1, 1, room)
    probe.raw(
        wire(first) + b"".join(wire(packet) + bytes(9) for packet in burst), "packets, and 00"
    )
    come = probe.sync()
    for answer in come:
        probe.demand(answer.kind != spec.TYPE_ERROR, "all packets are taken", answer)
    probe.demand_ack(probe.state, next=(1 + len(burst)) % 256, damaged=damaged)


@check(
    "11", "overrun", "more bytes than credit are told by OVERRUN, and the session goes on", ticking
)
def overrun(probe: Probe) -> None:
    said = probe.said
    if said.rx_buffer > _BURST_BYTES:
        probe.skip(f"it would take more than {said.rx_buffer} bytes")
    probe.sync()
    damaged = probe.state.damaged
    packets = [data(seq, 1, bytes(said.max_payload)) for seq in range(1, spec.LIMIT_WINDOW)]
    budget = said.rx_buffer + 2 * said.longest_wire
    burst: list[bytes] = []
    while packets and budget > 0:
        burst.append(packets.pop(0))
        budget -= len(wire(burst[-1]))
    probe.send(data(0, 0, b"", CLEAR | COMMIT), *burst)
    come = []
    for answer in probe.answers():  # a STATUS right behind might be lost, too
        come.append(answer)
        is_ack = answer.kind == spec.TYPE_ACK
        if is_ack and answer.last == len(burst):
            break
        if shown_at(come, 0) < len(come) and any(a.kind == spec.TYPE_ERROR for a in come):
            break
    come += probe.sync()
    errors = [answer for answer in come if answer.kind == spec.TYPE_ERROR]
    if not errors:
        probe.demand_ack(probe.state, next=1 + len(burst), damaged=damaged)
        probe.skip("the device took more than its credit in time, or the port held it back")
    for error in errors:
        fields = (error.code, error.offset, error.seq, error.frame, error.session)
        probe.demand(
            fields == (spec.CODE_OVERRUN, 0, 0, 0, probe.session),
            "ERROR OVERRUN with seq, frame and offset 0",
            error,
        )
    probe.demand_ack(
        probe.state, "OVERRUN does not end the session", session=probe.session, shown=1
    )
    grown = (probe.state.damaged - damaged) % 65536
    probe.demand(
        grown <= len(errors), "what was cut counts as one damaged segment for each OVERRUN", grown
    )

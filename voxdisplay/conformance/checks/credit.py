"""Checks of section 9.2: the device can buffer what its credit grants."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, refresh_tick
from voxdisplay.conformance.checks.pending_swap import index_of_swap
from voxdisplay.conformance.packets import ASKED, CLEAR, COMMIT, data, encode, status
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_BURST_BYTES = 1 << 16
_IDLE_S = 1.5


def packets_filling(probe: Probe, first: int, frame: int, room: int) -> list[bytes]:
    """Return DATA packets that fill ``room`` bytes on the wire, as far as the window allows."""
    packets: list[bytes] = []
    size = min(probe.device.max_payload, max(room // 24, 32))
    for seq in range(first, first + spec.LIMIT_WINDOW):
        packet = data(seq, frame, bytes(min(size, max(room - 16, 0))))
        cost = len(encode(packet))
        if cost > room:
            break
        packets.append(packet)
        room -= cost
    return packets


@check("9.2", "returned", "processed packets give their credit back: it never runs out")
def returned(probe: Probe) -> None:
    device = probe.device
    least = spec.LIMIT_RESERVE + device.longest_packet_bytes
    size = device.max_payload
    for _ in range(min(4 * device.rx_buffer, _BURST_BYTES) // size + 8):
        probe.draw(bytes(size))
        probe.require(
            probe.state.credit >= least,
            f"credit for 64 bytes and the longest packet, {least}, when all has been processed",
            probe.state,
            "credit counts from the packet named by `last`, it is not what is left of a total",
        )


@check(
    "9.2",
    "not-withdrawn",
    "credit that was granted is not taken back",
)
def not_withdrawn(probe: Probe) -> None:
    device = probe.device
    room = min(device.rx_buffer, _BURST_BYTES) - spec.LIMIT_RESERVE
    burst = packets_filling(probe, 0, 0, room)
    ends, end = [], 0
    for packet in burst:
        end += len(encode(packet))
        ends.append(end)
    promised = device.rx_buffer
    for answer in probe.send_and_poll(*burst):
        if answer.kind != spec.TYPE_ACK or answer.flags & ASKED or answer.last >= len(ends):
            continue
        reach = ends[answer.last] + answer.credit
        probe.require(
            reach >= promised,
            f"credit {promised - ends[answer.last]} at least, granted before",
            answer,
            "credit counts from the end of the packet named by `last`, whatever of it has arrived",
        )
        promised = reach
    probe.require_ack(probe.state, next=len(burst))


@check("9.2", "does-not-lapse", "credit and session stay as they are while nothing is sent")
def does_not_lapse(probe: Probe) -> None:
    probe.poll_status()
    before = probe.state
    probe.stay_silent(_IDLE_S + 2 * probe.device.period_s)
    probe.poll_status()
    likely = "an idle host sends nothing: credit and session must not expire"
    probe.require_ack(probe.state, likely, session=probe.session)
    left = before.credit - len(encode(status(0)))
    probe.require(probe.state.credit >= left, f"credit {left} at least", probe.state, likely)
    burst = packets_filling(probe, 0, 0, min(left, _BURST_BYTES) - spec.LIMIT_RESERVE)
    for answer in probe.send_and_poll(*burst):
        probe.require(answer.kind != spec.TYPE_ERROR, "all packets are taken", answer, likely)
    probe.require_ack(probe.state, likely, next=len(burst), damaged=before.damaged)


@check(
    "9.2",
    "room-is-there",
    "all that credit allows is taken, behind a pending frame too",
    refresh_tick,
)
def room_is_there(probe: Probe) -> None:
    device = probe.device
    for round_ in range(3):
        probe.open_session()
        probe.poll_status()
        damaged = probe.state.damaged
        first = data(0, 0, ops.run(), CLEAR | COMMIT)
        room = min(device.rx_buffer, 1 << 20) - spec.LIMIT_RESERVE - len(encode(first))
        burst = packets_filling(probe, 1, 1, room)
        responses = probe.send_and_poll(first, *burst)
        for answer in responses:
            probe.require(
                answer.kind != spec.TYPE_ERROR,
                f"{len(burst)} packets within the credit of {device.rx_buffer} bytes are taken",
                answer,
                "a packet that waits occupies the buffer: does rx_buffer allow for that?",
            )
        probe.require_ack(probe.state, next=(1 + len(burst)) % 256, damaged=damaged)
        probe.require(
            index_of_swap([*responses, probe.state], 0) <= len(responses),
            "frame 0 is shown",
            round_,
        )


@check("9.2", "zeros-between", "00 between packets needs no credit", refresh_tick)
def zeros_between(probe: Probe) -> None:
    device = probe.device
    probe.poll_status()
    damaged = probe.state.damaged
    first = data(0, 0, b"", CLEAR | COMMIT)
    room = min(device.rx_buffer, 1 << 20) - spec.LIMIT_RESERVE - len(encode(first))
    burst = packets_filling(probe, 1, 1, room)
    probe.send_raw(
        encode(first) + b"".join(encode(packet) + bytes(9) for packet in burst), "packets, and 00"
    )
    responses = probe.poll_status()
    for answer in responses:
        probe.require(answer.kind != spec.TYPE_ERROR, "all packets are taken", answer)
    probe.require_ack(probe.state, next=(1 + len(burst)) % 256, damaged=damaged)


@check(
    "11",
    "overrun",
    "bytes beyond the credit cause OVERRUN, and the session stays open",
    refresh_tick,
)
def overrun(probe: Probe) -> None:
    device = probe.device
    if device.rx_buffer > _BURST_BYTES:
        probe.skip(f"it would take more than {device.rx_buffer} bytes")
    probe.poll_status()
    damaged = probe.state.damaged
    packets = [data(seq, 1, bytes(device.max_payload)) for seq in range(1, spec.LIMIT_WINDOW)]
    budget = device.rx_buffer + 2 * device.longest_packet_bytes
    burst: list[bytes] = []
    while packets and budget > 0:
        burst.append(packets.pop(0))
        budget -= len(encode(burst[-1]))
    probe.send(data(0, 0, b"", CLEAR | COMMIT), *burst)
    responses = []
    for answer in probe.responses():  # a STATUS right behind might be lost, too
        responses.append(answer)
        is_ack = answer.kind == spec.TYPE_ACK
        if is_ack and answer.last == len(burst):
            break
        if index_of_swap(responses, 0) < len(responses) and any(
            a.kind == spec.TYPE_ERROR for a in responses
        ):
            break
    responses += probe.poll_status()
    errors = [answer for answer in responses if answer.kind == spec.TYPE_ERROR]
    if not errors:
        probe.require_ack(probe.state, next=1 + len(burst), damaged=damaged)
        probe.skip("the device processed all in time, or flow control of the port held it back")
    for error in errors:
        fields = (error.code, error.offset, error.seq, error.frame, error.session)
        probe.require(
            fields == (spec.CODE_OVERRUN, 0, 0, 0, probe.session),
            "ERROR OVERRUN with seq, frame and offset 0",
            error,
        )
    probe.require_ack(
        probe.state, "OVERRUN does not end the session", session=probe.session, shown=1
    )
    grown = (probe.state.damaged - damaged) % 65536
    probe.require(
        grown == len(errors),
        f"{len(errors)} more in `damaged`: each loss counts as one damaged segment",
        grown,
    )
    for error in errors:
        behind = [*responses[responses.index(error) + 1 :], probe.state]
        probe.require_ack(behind[0], "the ACK for the damage comes right behind the ERROR")

"""Checks of section 9: occasions and fields of ACK."""

from __future__ import annotations

from voxdisplay.conformance.catalogue import check
from voxdisplay.conformance.checks.packet_types import require_session_open
from voxdisplay.conformance.packets import ASKED, body, data, encode, status
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec


@check("9", "status", "a STATUS is answered with ACK: ASKED, and its tag in `last`")
def status_(probe: Probe) -> None:
    for tag in (0, 1, 77, 128, 254, 255):
        probe.send(status(tag))
        answer = next(probe.responses(), None)
        if answer is None:
            probe.fail("ACK", "nothing")
        probe.require_ack(answer, asked=1, last=tag, session=probe.session)


@check("9", "each-status", "each STATUS is answered, in order")
def each_status(probe: Probe) -> None:
    responses = probe.send_and_poll(status(3), status(2), status(1))
    tags = [answer.last for answer in responses if answer.kind == spec.TYPE_ACK]
    probe.require(tags == [3, 2, 1], "ACK with 3, 2 and 1 in `last`", tags)


@check("9", "status-length", "a STATUS with a payload is refused: LENGTH")
def status_length(probe: Probe) -> None:
    for payload in (b"\0", b"\1\2\3", bytes(20)):
        probe.require_refused(body(spec.TYPE_STATUS, seq=9, payload=payload), spec.CODE_LENGTH, 0)
    require_session_open(probe)


@check("9", "data-answered", "each DATA is answered with ACK: not ASKED, and its number in `last`")
def data_answered(probe: Probe) -> None:
    for seq in (0, 1, 2):
        ack = probe.request(data(seq, 0))
        probe.require_ack(ack, asked=0, last=seq, next=seq + 1, session=probe.session)


@check("9", "received", "`next` and the bitmap `received` name the packets received")
def received(probe: Probe) -> None:
    between = list(range(1, spec.LIMIT_WINDOW - 1))
    probe.rng.shuffle(between)
    order = [spec.LIMIT_WINDOW - 1, *between, 0]
    got: set[int] = set()
    for seq in order:
        ack = probe.request(data(seq, 0))
        got.add(seq)
        lowest = next(n for n in range(64) if n not in got)
        bits = sum(1 << n - lowest - 1 for n in got if n > lowest)
        probe.require_ack(
            ack, "bit i stands for number next + 1 + i", next=lowest, received=bits, last=seq
        )


@check("9", "last-at-first", "before the first DATA of a session `last` is 255")
def last_at_first(probe: Probe) -> None:
    probe.draw(b"")
    probe.open_session()
    responses = probe.send_raw_and_poll(b"\x08\x11\x22\x33\x44\x55\x66\x77\0", "a damaged segment")
    probe.require(len(responses) == 1, "one ACK for a damaged segment", responses)
    probe.require_ack(responses[0], last=255, next=0)


@check("9", "damage-answered", "each damaged segment is answered with ACK if a session is open")
def damage_answered(probe: Probe) -> None:
    probe.request(data(0, 0))
    junk = b"\x08\x11\x22\x33\x44\x55\x66\x77\0"
    responses = probe.send_raw_and_poll(3 * junk, "three damaged segments")
    probe.require(len(responses) == 3, "three ACKs", len(responses))
    counts = [ack.damaged for ack in responses if ack.kind == spec.TYPE_ACK]
    begin = counts[0] if counts else 0
    counted = [(count - begin) % 65536 for count in counts] == [0, 1, 2]
    probe.require(counted, "`damaged` grows by one with each", counts)
    for ack in responses:
        probe.require_ack(ack, asked=0, last=0, next=1)


@check("9", "damage-unanswered", "without a session a damaged segment is counted, not answered")
def damage_unanswered(probe: Probe) -> None:
    probe.poll_status()
    before = probe.state.damaged
    probe.end_session()
    responses = probe.send_raw_and_poll(b"\x08\x11\x22\x33\x44\x55\x66\x77\0", "a damaged segment")
    probe.require(
        not responses, "no response to damage without a session", responses and responses[0]
    )
    probe.open_session()
    probe.poll_status()
    probe.require_ack(probe.state, damaged=(before + 1) % 65536)


@check("9", "damage-stays", "`damaged` counts since the start of the device, over all sessions")
def damage_stays(probe: Probe) -> None:
    probe.send_raw_and_poll(b"\x08\x11\x22\x33\x44\x55\x66\x77\0", "a damaged segment")
    before = probe.state.damaged
    probe.open_session()
    probe.poll_status()
    probe.require_ack(probe.state, damaged=before)


@check("9", "silent-acks", "at most 8 DATA in a row go without an ACK, and never the last")
def silent_acks(probe: Probe) -> None:
    device = probe.device
    room = device.rx_buffer - spec.LIMIT_RESERVE
    count = min(spec.LIMIT_WINDOW, room // len(encode(data(255, 0))))
    probe.send(*(data(seq, 0) for seq in range(count)))
    acked: list[int] = []
    for answer in probe.responses():
        if answer.kind == spec.TYPE_ACK and not answer.flags & ASKED:
            acked.append(answer.last)
        if acked and acked[-1] == count - 1:
            break
    probe.require(bool(acked) and acked[-1] == count - 1, f"an ACK for number {count - 1}", acked)
    gaps = [b - a - 1 for a, b in zip([-1, *acked], acked, strict=False)]
    probe.require(max(gaps) <= spec.LIMIT_MAX_SILENT, "at most 8 in a row without ACK", acked)
    probe.poll_status()
    probe.require_ack(probe.state, next=count, received=0)

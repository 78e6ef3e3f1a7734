"""Checks of section 9.1: sequence numbers, duplicates and the window."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, min_voxels, readable_display
from voxdisplay.conformance.checks.frames import lit_page
from voxdisplay.conformance.packets import CLEAR, COMMIT, data
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec


@check(
    "9.1",
    "window-edges",
    "up to 31 above `next` is new, 32 to 223 is refused, 224 and above is a duplicate",
)
def window_edges(probe: Probe) -> None:
    for base in (0, 3):
        for ahead in (31, 32, 33, 128, 223, 224, 255):
            probe.open_session()
            for _ in range(base):
                probe.draw(b"")
            packet = data(base + ahead, 0)
            if 32 <= ahead < 224:
                probe.require_refused(packet, spec.CODE_SEQUENCE, 1)
            else:
                bits = 1 << 30 if ahead == 31 else 0
                last = (base + ahead) % 256
                probe.require_ack(probe.request(packet), next=base, received=bits, last=last)


@check("9.1", "duplicate-answered", "a duplicate is answered with ACK, and changes nothing")
def duplicate_answered(probe: Probe) -> None:
    for seq in (0, 3):
        probe.request(data(seq, 0))
    for seq in (0, 3, 0):
        probe.require_ack(probe.request(data(seq, 0)), next=1, received=2, last=seq)


@check(
    "9.1",
    "duplicate-unseen",
    "frame and ops of a duplicate are not checked",
    readable_display,
    min_voxels(3),
)
def duplicate_unseen(probe: Probe) -> None:
    probe.send_and_poll(data(0, 0, ops.single_voxel(probe.device, 0)), data(2, 0))
    for packet in (
        data(0, 0, ops.single_voxel(probe.device, 1)),
        data(2, 0, ops.single_voxel(probe.device, 2)),
        data(0, 9, b"\x1f"),
        data(2, 1, b"\x1f", 0),
        data(0, 0, b"", CLEAR | COMMIT),
    ):
        probe.require_ack(probe.request(packet), next=1, received=1)
    responses = probe.send_and_poll(data(1, 0), data(3, 0, b"", CLEAR | COMMIT))
    probe.require_displayed(probe.await_shown(0, [*responses, probe.state]), lit_page(probe, 0))
    probe.require_ack(probe.request(data(3, 0, b"\x1f", CLEAR | COMMIT)), next=4, shown=1)


@check(
    "9.1",
    "applied-once",
    "each packet is applied once, however often it is sent",
    readable_display,
    min_voxels(2),
)
def applied_once(probe: Probe) -> None:
    probe.send_and_poll(data(0, 0, ops.run(2)), data(1, 0, ops.pen(probe.device, 0) + ops.run()))
    probe.send_and_poll(data(0, 0, ops.run(2)))
    responses = probe.send_and_poll(data(2, 0, b"", CLEAR | COMMIT))
    probe.require_displayed(probe.await_shown(0, [*responses, probe.state]), lit_page(probe, 1))


@check(
    "9.1",
    "out-of-order",
    "packets of a frame may arrive in any order",
    readable_display,
    min_voxels(9),
)
def out_of_order(probe: Probe) -> None:
    order = list(range(9))
    probe.rng.shuffle(order)
    responses = []
    for seq in order:
        flags = CLEAR | (COMMIT if seq == 8 else 0)
        responses = probe.send_and_poll(data(seq, 0, ops.single_voxel(probe.device, seq), flags))
    probe.require_displayed(
        probe.await_shown(0, [*responses, probe.state]), lit_page(probe, *range(9))
    )


@check("9.1", "around-256", "the window wraps from 255 to 0")
def around_256(probe: Probe) -> None:
    for _ in range(250):
        probe.draw(b"")
    for seq in (253, 2, 25, 255, 0, 26):
        if (seq - 250) % 256 < spec.LIMIT_WINDOW:
            probe.require_ack(probe.request(data(seq, 0)), next=250, last=seq)
    bits = sum(1 << (seq - 251) % 256 for seq in (253, 2, 25, 255, 0))
    probe.poll_status()
    probe.require_ack(probe.state, next=250, received=bits)
    probe.require_ack(probe.request(data(249, 0)), "a number below `next` is a duplicate", next=250)
    probe.require_ack(probe.request(data(218, 0)), "a number below `next` is a duplicate", next=250)
    for seq in (250, 251, 252, 254, 1):
        probe.request(data(seq, 0))
    probe.poll_status()
    probe.require_ack(probe.state, next=3, received=1 << 21)
    probe.require_refused(data(35, 0), spec.CODE_SEQUENCE, 1)


@check(
    "9.1",
    "nothing-of-the-refused",
    "nothing that a refused packet draws is ever shown",
    readable_display,
)
def nothing_of_the_refused(probe: Probe) -> None:
    probe.show(b"")
    probe.send_and_poll(data(1, 1, ops.run() + b"\x1f"))
    probe.open_session()
    probe.poll_status()
    probe.require_displayed(probe.state, Page())
    probe.show(b"", clear=False)

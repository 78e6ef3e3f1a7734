"""Checks of section 6: frames, front page and back page."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, immediate_swap, min_voxels, readable_display
from voxdisplay.conformance.packets import CLEAR, COMMIT, SHOWN, data
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec


def lit_page(probe: Probe, *indices: int) -> Page:
    """Return a page with full pixels at some indices."""
    return Page(dict.fromkeys(indices, probe.device.full_pixel))


def require_front_page(probe: Probe, page: Page, **fields: int) -> None:
    """Wait for two ticks; then require a front page and fields of the ACK."""
    probe.wait_two_ticks()
    probe.poll_status()
    probe.require_ack(probe.state, **fields)
    probe.require_displayed(probe.state, page)


@check("6", "clear", "with CLEAR a frame starts dark", readable_display, min_voxels(2))
def clear(probe: Probe) -> None:
    for index in (0, 1, 0):
        probe.show(ops.single_voxel(probe.device, index))
    probe.show(b"")


@check(
    "6",
    "keep",
    "without CLEAR a frame starts as a copy of the front page",
    readable_display,
    min_voxels(4),
)
def keep(probe: Probe) -> None:
    probe.show(ops.single_voxel(probe.device, 0))
    for index in (1, 2, 3):
        probe.show(ops.single_voxel(probe.device, index), clear=False)
    probe.show(b"", clear=False)


@check(
    "6",
    "many-packets",
    "a frame of several packets is drawn by all of them",
    readable_display,
    min_voxels(6),
)
def many_packets(probe: Probe) -> None:
    probe.show(*(ops.single_voxel(probe.device, index) for index in range(6)))
    probe.show(*(ops.single_voxel(probe.device, index, 0) for index in range(3)), clear=False)


@check("6", "empty-packets", "a DATA packet may have no ops", readable_display)
def empty_packets(probe: Probe) -> None:
    probe.show(b"", ops.single_voxel(probe.device, 0), b"")


@check("6", "only-by-commit", "nothing is shown before COMMIT", readable_display)
def only_by_commit(probe: Probe) -> None:
    probe.show(b"")
    probe.draw(ops.single_voxel(probe.device, 0))
    require_front_page(probe, Page(), shown=1, frame=0, pending=0)
    probe.draw(b"", commit=True)
    probe.require_displayed(probe.await_shown(1), lit_page(probe, 0))


@check(
    "6",
    "only-whole",
    "a frame is not shown while packets of it are missing, even after COMMIT",
    readable_display,
)
def only_whole(probe: Probe) -> None:
    last = probe.device.voxel_count - 1
    probe.show(b"")
    probe.send_and_poll(data(3, 1, ops.single_voxel(probe.device, last), CLEAR | COMMIT))
    require_front_page(probe, Page(), shown=1, frame=0, pending=0, next=1, received=2)
    probe.send_and_poll(data(1, 1, ops.single_voxel(probe.device, 0)))
    require_front_page(probe, Page(), shown=1, frame=0, pending=0, next=2, received=1)
    responses = probe.send_and_poll(data(2, 1))
    probe.require_displayed(probe.await_shown(1, responses), lit_page(probe, 0, last))


@check(
    "6",
    "begins-by-arrival",
    "the first packet received of a frame begins it, whatever its sequence number",
    readable_display,
)
def begins_by_arrival(probe: Probe) -> None:
    probe.show(ops.single_voxel(probe.device, probe.device.voxel_count - 1))
    last = probe.device.voxel_count - 1
    probe.send_and_poll(data(2, 1, ops.single_voxel(probe.device, 0), 0), data(1, 1, b"", 0))
    responses = probe.send_and_poll(data(3, 1, b"", COMMIT))
    probe.require_displayed(
        probe.await_shown(1, [*responses, probe.state]), lit_page(probe, 0, last)
    )


@check("6", "swap-reported", "a swap is reported by ACK when it happens, without a STATUS")
def swap_reported(probe: Probe) -> None:
    for frame in range(3):
        probe.send(data(frame, frame, b"", CLEAR | COMMIT))
        responses = []
        for answer in probe.responses():
            responses.append(answer)
            if answer.kind == spec.TYPE_ACK and answer.flags & SHOWN and answer.frame == frame:
                break
        else:
            probe.fail(
                f"an ACK with SHOWN and frame {frame}", responses[-1] if responses else "nothing"
            )
        probe.poll_status()


@check("6", "one-ack-at-once", "if refresh is 0, one ACK serves packet and swap", immediate_swap)
def one_ack_at_once(probe: Probe) -> None:
    for frame in range(3):
        ack = probe.request(data(frame, frame, b"", CLEAR | COMMIT))
        probe.require_ack(ack, shown=1, frame=frame, next=frame + 1, pending=0)


@check("6", "first-id", "the first frame of a session has the id 0; others are refused: FRAME at 2")
def first_id(probe: Probe) -> None:
    for frame in (255, 1, 7):
        probe.open_session()
        probe.require_refused(data(0, frame), spec.CODE_FRAME, 2)


@check("6", "next-id", "behind frame f only f and f + 1 are taken; others are refused: FRAME at 2")
def next_id(probe: Probe) -> None:
    for shown in (False, True):
        for frame in (2, 255, 9):
            probe.open_session()
            if shown:
                probe.show(b"")
            else:
                probe.draw(b"")
            probe.require_refused(data(1, frame), spec.CODE_FRAME, 2)


@check("6", "after-display", "a packet of the frame on display is refused: FRAME at 2")
def after_display(probe: Probe) -> None:
    probe.show(b"")
    probe.require_refused(data(1, 0), spec.CODE_FRAME, 2)


@check("6", "behind-commit", "a packet of f with a number above its COMMIT is refused: FRAME at 2")
def behind_commit(probe: Probe) -> None:
    probe.send_and_poll(data(1, 0, b"", CLEAR | COMMIT))
    probe.require_refused(data(2, 0), spec.CODE_FRAME, 2)


@check(
    "6",
    "clear-flag-differs",
    "a packet whose CLEAR flag differs from its frame's is refused: FRAME at 0",
)
def clear_flag_differs(probe: Probe) -> None:
    for flags in (0, CLEAR):
        probe.open_session()
        probe.request(data(0, 0, b"", flags))
        probe.require_refused(data(1, 0, b"", flags ^ CLEAR), spec.CODE_FRAME, 0)


@check(
    "6",
    "next-while-missing",
    "a packet of f + 1 is dropped, and answered, while packets of f may be missing",
)
def next_while_missing(probe: Probe) -> None:
    probe.request(data(1, 0))
    ack = probe.request(data(2, 1, b"\x1f\xff"))
    probe.require_ack(
        ack,
        "the packet must be dropped: its ops not checked, nor itself marked as received",
        next=0,
        received=1,
        last=2,
    )
    probe.request(data(0, 0))
    probe.require_ack(
        probe.request(data(2, 1, ops.single_voxel(probe.device, 0))), next=3, received=0
    )
    responses = probe.send_and_poll(data(3, 1, b"", CLEAR | COMMIT))
    probe.require_displayed(probe.await_shown(1, [*responses, probe.state]), lit_page(probe, 0))


@check(
    "6",
    "other-while-missing",
    "a packet of any other frame is dropped while packets of f may be missing",
)
def other_while_missing(probe: Probe) -> None:
    probe.request(data(1, 0))
    for frame in (2, 7, 255):
        ack = probe.request(data(2, frame, b"\x1f\xff"))
        probe.require_ack(ack, "it is dropped like one of f + 1", next=0, received=1, last=2)


@check("6", "first-while-missing", "a packet of another frame is dropped while number 0 is missing")
def first_while_missing(probe: Probe) -> None:
    ack = probe.request(data(1, 3, b"\x1f\xff"))
    probe.require_ack(ack, "number 0 is missing", next=0, received=0, last=1)


@check(
    "6",
    "given-up",
    "f + 1 replaces f if f is not whole and no packet is missing",
    readable_display,
    min_voxels(3),
)
def given_up(probe: Probe) -> None:
    probe.show(ops.single_voxel(probe.device, 0))
    probe.draw(ops.single_voxel(probe.device, 1))
    probe.frame += 1
    probe.show(ops.single_voxel(probe.device, 2), clear=False)
    probe.draw(ops.single_voxel(probe.device, 1), clear=False)
    probe.frame += 1
    probe.show(b"", clear=False)


@check("6", "out-of-order-next", "behind a frame on display, f + 1 may begin out of order")
def out_of_order_next(probe: Probe) -> None:
    probe.show(b"")
    probe.require_ack(probe.request(data(2, 1)), next=1, received=1)
    probe.require_ack(probe.request(data(1, 1)), next=3, received=0)


@check(
    "6",
    "two-commits",
    "of several COMMIT of a frame the lowest sequence number counts",
    readable_display,
    min_voxels(3),
)
def two_commits(probe: Probe) -> None:
    probe.send_and_poll(data(3, 0, ops.single_voxel(probe.device, 2), CLEAR | COMMIT))
    probe.send_and_poll(data(1, 0, ops.single_voxel(probe.device, 1), CLEAR | COMMIT))
    responses = probe.send_and_poll(data(0, 0, ops.single_voxel(probe.device, 0)))
    ack = probe.await_shown(0, [*responses, probe.state])
    probe.require_displayed(ack, lit_page(probe, 0, 1, 2))


@check("6", "ids-wrap", "frame ids and sequence numbers wrap modulo 256")
def ids_wrap(probe: Probe) -> None:
    for _ in range(255):
        probe.draw(b"")
        probe.frame = (probe.frame + 1) % 256
    for _ in range(3):
        probe.show(ops.single_voxel(probe.device, 0))

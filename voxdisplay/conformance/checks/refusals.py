"""Checks of section 11: error codes, offsets, and the session after a refusal."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import (
    check,
    feature,
    min_voxels,
    pixel_formats,
    readable_display,
)
from voxdisplay.conformance.checks.out_of_bounds import require_refused_anywhere
from voxdisplay.conformance.packets import CLEAR, COMMIT, body, data, hello, read, status
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

_HUGE = 100_000


class _TooManyVoxelsError(Exception):
    """The ops would take the reference decoder too long."""


class _BoundedDecoder(ReferenceDecoder):
    def count_of(self, low: int) -> int:
        count = super().count_of(low)
        if self.cursor + count <= self.device.voxel_count and count > _HUGE:
            raise _TooManyVoxelsError
        return count


@check("11", "session-ends", "a refused DATA ends the session: all but HELLO get NO_SESSION")
def session_ends(probe: Probe) -> None:
    probe.request(data(0, 0, b"\x1f"))
    for packet in (status(9), data(0, 0), data(1, 0, b"\x1f"), read(0, 1), body(0), body(15, 3, 1)):
        answer = probe.request(packet)
        right = answer.kind == spec.TYPE_ERROR
        right = right and (answer.code, answer.offset) == (spec.CODE_NO_SESSION, 0)
        probe.require(
            right, "ERROR NO_SESSION at offset 0", answer, "a refused DATA ends the session"
        )
    probe.open_session()
    probe.poll_status()
    probe.require_ack(probe.state, session=probe.session, next=0)


@check(
    "11",
    "frame-dropped",
    "a refused DATA drops the frame that is not on display",
    readable_display,
    min_voxels(2),
)
def frame_dropped(probe: Probe) -> None:
    probe.show(ops.single_voxel(probe.device, 0))
    must = probe.front or Page()
    probe.draw(ops.single_voxel(probe.device, 1), clear=False)
    probe.request(data(2, 1, b"\x1f", 0))
    probe.open_session()
    probe.wait_two_ticks()
    probe.poll_status()
    probe.require_ack(probe.state, shown=0, pending=0)
    probe.require_displayed(probe.state, must)
    probe.show(b"", clear=False)


@check("11", "error-names-packet", "seq and frame of an ERROR are those of the refused packet")
def error_names_packet(probe: Probe) -> None:
    for packet in (body(0, 0, 77, 9), body(spec.TYPE_STATUS, 1, 78, 0), data(99, 98)):
        error = probe.request(packet)
        probe.require(error.kind == spec.TYPE_ERROR, "ERROR", error)
        same = (error.seq, error.frame) == (packet[1], packet[2])
        probe.require(same, f"seq {packet[1]} and frame {packet[2]} in ERROR", error)


@check(
    "11", "error-session", "an ERROR has the session in which it was refused, or 0 if none is open"
)
def error_session(probe: Probe) -> None:
    for packet in (body(0), data(0, 0, b"\x1f")):
        error = probe.request(packet)
        must = (spec.TYPE_ERROR, probe.session)
        probe.require((error.kind, error.session) == must, f"session {probe.session:04X}h", error)
    error = probe.request(status(9))
    probe.require((error.kind, error.session) == (spec.TYPE_ERROR, 0), "session 0", error)


@check("11", "refused-hello", "an invalid HELLO is refused alike with and without a session")
def refused_hello(probe: Probe) -> None:
    probe.end_session()
    probe.require_refused(hello(0), spec.CODE_FIELD, 4)
    probe.require_refused(body(spec.TYPE_HELLO, payload=b"\1\1"), spec.CODE_LENGTH, 0)


@check("11", "reserved-ops", "an op that is reserved or not announced is refused: OP")
def reserved_ops(probe: Probe) -> None:
    device = probe.device
    shapes = {
        spec.OP_LINE: "LINE",
        spec.OP_BOX: "BOX",
        spec.OP_DOTS: "DOTS",
        spec.OP_COLORS: "PALETTE",
        spec.OP_HOLD: "HOLD",
        spec.OP_FADE: "FADE",
        spec.OP_RAMP: "RAMP",
        spec.OP_ARC: "ARC",
        spec.OP_SLABS: "SLABS",
        spec.OP_VALUES: "VALUES",
        spec.OP_ARC2: "ARC2",
    }
    for op in range(256):
        kind, low = op & 0xE0, op & 0x1F
        if op in shapes:
            reserved = not device.has(shapes[op])
        elif kind in {spec.OP_STEP, spec.OP_FROM}:
            reserved = low > spec.LIMIT_MAX_OCTANT
        elif kind == spec.OP_OCT:
            reserved = low > spec.LIMIT_MAX_LEVEL or (not device.has("OCT") and low < 2)
        elif kind == spec.OP_DIFF:
            reserved = not device.has("DIFF") and low in {0, 31}
        else:
            reserved = spec.OP_COLORS < op < spec.OP_STEP
        if reserved:
            probe.require_ops_refused(ops.run() + bytes((op, 1, 0, 0, 0, 0, 0)), spec.CODE_OP, 1)


@check(
    "11", "count-form", "a LEB128 not in its shortest form, too long or too large is refused: COUNT"
)
def count_form(probe: Probe) -> None:
    too_long = b"\xff" * 5
    for tail in (b"\x80\0", b"\x9f\x80\0", too_long + b"\1", too_long, b"\xe0\xff\xff\xff\x0f"):
        for op in (spec.OP_SKIP, spec.OP_RUN, spec.OP_LIT):
            require_refused_anywhere(probe, bytes((op | 31,)) + tail, spec.CODE_COUNT)


@check("11", "truncated", "an op that the payload cuts off is refused: TRUNCATED, at its op byte")
def truncated(probe: Probe) -> None:
    device = probe.device
    place = ops.xyz(device, (0, 0, 0))
    whole = [
        ops.pen(device, 1),
        ops.move(device, (0, 0, 0)),
        bytes((spec.OP_STEP, 4, 0, 0)),
        bytes((spec.OP_FROM,)) + place + b"\4\0\0",
        ops.literal(device, [1] * 9),
        bytes((spec.OP_RUN | 31, 0x9F, 0x80))[:2] + b"\1",
        bytes((spec.OP_SKIP | 31, 0xFF, 0xFF, 0xFF, 0x7F)),
    ]
    more = {
        "LINE": bytes((spec.OP_LINE,)) + place,
        "BOX": bytes((spec.OP_BOX,)) + place,
        "DOTS": bytes((spec.OP_DOTS, 1)) + place + place,
        "OCT": bytes((spec.OP_OCT | 2,)) + place + b"\3\1\1",
        "DIFF": bytes((spec.OP_DIFF | 4, 0, 0, 0)),
        "PALETTE": ops.colors(3, [(1, 2, 3), (4, 5, 6)]),
        "HOLD": ops.hold(1),
    }
    whole += [op for name, op in more.items() if device.has(name)]
    for op in whole:
        for size in range(1, len(op)):
            probe.require_ops_refused(op[:size], spec.CODE_TRUNCATED)
        probe.require_ops_refused(ops.run() + op[:-1], spec.CODE_TRUNCATED, 1)


@check(
    "11",
    "padding",
    "unused bits of crumbs, and bytes behind END, that are not 0 are refused: PADDING",
)
def padding(probe: Probe) -> None:
    device = probe.device
    place = ops.xyz(device, (0, 0, 0))
    require_refused_anywhere(probe, b"\0\0\0\1", spec.CODE_PADDING)
    require_refused_anywhere(probe, b"\0\x80", spec.CODE_PADDING)
    for steps in (1, 2, 3, 5):
        raw = bytearray(-(-steps // 4))
        raw[-1] = 1 << 2 * (steps % 4)
        require_refused_anywhere(probe, bytes((spec.OP_STEP, steps - 1)) + raw, spec.CODE_PADDING)
        require_refused_anywhere(
            probe, bytes((spec.OP_FROM,)) + place + bytes((steps - 1,)) + raw, spec.CODE_PADDING
        )
    raw = bytearray((spec.OP_STEP, 0, 0x80))
    require_refused_anywhere(probe, bytes(raw), spec.CODE_PADDING)


@check(
    "11",
    "pixel-padding",
    "unused bits of a MONO1 pixel run that are not 0 are refused: PADDING",
    pixel_formats(spec.FORMAT_MONO1),
)
def pixel_padding(probe: Probe) -> None:
    for n, last in ((1, 2), (7, 0x80), (9, 2), (12, 0x10)):
        raw = bytes(-(-n // 8) - 1) + bytes((last,))
        require_refused_anywhere(probe, bytes((spec.OP_LIT | n - 1,)) + raw, spec.CODE_PADDING)


@check(
    "11",
    "difference-padding",
    "an unused nibble of a DIFF that is not 0 is refused: PADDING",
    feature("DIFF"),
)
def difference_padding(probe: Probe) -> None:
    for raw in (b"\x10", b"\x01\xf0"):
        require_refused_anywhere(
            probe, bytes((spec.OP_DIFF | 2 * len(raw) - 2,)) + raw, spec.CODE_PADDING
        )


@check(
    "11",
    "pixel",
    "a MONO1 pixel other than 0 and 1 is refused: PIXEL",
    pixel_formats(spec.FORMAT_MONO1),
)
def pixel(probe: Probe) -> None:
    for value in (2, 3, 128, 255):
        require_refused_anywhere(probe, bytes((spec.OP_PEN, value)), spec.CODE_PIXEL)


@check("11", "order-of-packet", "a packet is checked in the order of the table of section 11")
def order_of_packet(probe: Probe) -> None:
    bad = b"\x1f"
    for packet, code, offset in (
        (data(99, 9, bad, 2), spec.CODE_FIELD, 0),
        (data(99, 9, bad), spec.CODE_SEQUENCE, 1),
        (data(0, 9, bad, COMMIT), spec.CODE_FRAME, 2),
        (body(spec.TYPE_STATUS, 1, 9, 1, b"\1"), spec.CODE_LENGTH, 0),
        (hello(0, more=b"\0"), spec.CODE_LENGTH, 0),
    ):
        probe.open_session()
        probe.require_refused(packet, code, offset)
    probe.open_session()
    probe.draw(b"")
    probe.require_refused(data(1, 5, bad, 0), spec.CODE_FRAME, 2)
    probe.open_session()
    probe.draw(b"", commit=True)
    probe.await_shown(0, [probe.state])
    probe.poll_status()
    probe.require_refused(data(1, 0, bad, 0), spec.CODE_FRAME, 2)
    probe.open_session()
    probe.draw(b"")
    probe.require_refused(data(1, 0, bad, 0), spec.CODE_FRAME, 0)


@check(
    "11",
    "order-of-read",
    "a READ is checked in the order of the table of section 11",
    feature("READ"),
)
def order_of_read(probe: Probe) -> None:
    v = probe.device.voxel_count
    framed = bytearray(read(v, 0, 9, 2, reserved=1))
    framed[2] = 1
    probe.require_refused(bytes(framed) + b"\0", spec.CODE_LENGTH, 0)
    probe.require_refused(bytes(framed), spec.CODE_FIELD, 0)
    framed[0] &= 0xF0
    probe.require_refused(bytes(framed), spec.CODE_FIELD, 2)
    framed[2] = 0
    probe.require_refused(bytes(framed), spec.CODE_FIELD, 3)
    probe.require_refused(read(v, 0), spec.CODE_FIELD, 8)
    probe.require_refused(read(v, 1), spec.CODE_OUTSIDE, 4)


@check(
    "11", "first-op-first", "ops are checked from first to last, and the first fault is reported"
)
def first_op_first(probe: Probe) -> None:
    device = probe.device
    outside = ops.run(device.voxel_count + 1)
    probe.require_ops_refused(outside + b"\x1f", spec.CODE_OUTSIDE)
    probe.require_ops_refused(b"\x1f" + outside, spec.CODE_OP)
    probe.require_ops_refused(ops.run() + outside + b"\0\1", spec.CODE_OUTSIDE, 1)
    probe.require_ops_refused(
        ops.run() + bytes((spec.OP_RUN | 31, 0x80, 0)) + b"\x1f", spec.CODE_COUNT, 1
    )


@check("11", "order-of-op", "an op is checked in the order of the table of section 11")
def order_of_op(probe: Probe) -> None:
    device = probe.device
    end = ops.skip(device.voxel_count)
    at = len(end)
    probe.require_ops_refused(end + bytes((spec.OP_STEP, 0, 0x04)), spec.CODE_PADDING, at)
    probe.require_ops_refused(end + bytes((spec.OP_STEP, 8, 0x04)), spec.CODE_TRUNCATED, at)
    probe.require_ops_refused(end + bytes((spec.OP_LIT | 31, 0x80, 0)), spec.CODE_COUNT, at)
    probe.require_ops_refused(end + bytes((spec.OP_LIT | 31, 5)), spec.CODE_TRUNCATED, at)
    if device.format == spec.FORMAT_MONO1:
        probe.require_ops_refused(end + bytes((spec.OP_LIT, 2)), spec.CODE_PADDING, at)
    if device.has("DIFF"):
        probe.require_ops_refused(end + bytes((spec.OP_DIFF, 0x10)), spec.CODE_PADDING, at)
    if device.has("OCT"):
        far = (1 << 8 * device.coordinate_bytes) - 1
        head = bytes((spec.OP_OCT | 2,)) + ops.xyz(device, (far, far, far))
        probe.require_ops_refused(head, spec.CODE_TRUNCATED)
        probe.require_ops_refused(head + b"\3\0", spec.CODE_TRUNCATED)
        probe.require_ops_refused(head + b"\3\0\0", spec.CODE_OUTSIDE)
    if device.has("PALETTE"):
        probe.require_ops_refused(ops.colors(255, [(1, 2, 3)] * 2)[:-1], spec.CODE_TRUNCATED)


@check(
    "11",
    "random-ops",
    "random ops, valid or not, are drawn or refused as sections 7 and 11 say",
    readable_display,
)
def random_ops(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    done = 0
    while done < 60:
        payload = bytearray(ops.random_ops(device, rng, min(device.max_payload, 60)))
        for _ in range(rng.randint(1, 3)):
            payload[rng.randrange(len(payload))] = rng.randrange(256)
        cut = (
            bytes(payload[: rng.randint(1, len(payload))]) if rng.random() < 0.3 else bytes(payload)
        )
        try:
            _BoundedDecoder(device, Page()).draw(cut)
        except _TooManyVoxelsError:
            continue
        except Refused as refused:
            probe.require_ops_refused(cut, refused.code, refused.at)
            done += 1
        else:
            probe.open_session()
            probe.show(cut)
            done += 1


@check("11", "refused-commit", "a refused COMMIT shows nothing", readable_display)
def refused_commit(probe: Probe) -> None:
    probe.show(b"")
    probe.request(data(1, 1, ops.run() + b"\x1f", CLEAR | COMMIT))
    probe.wait_two_ticks()  # a HELLO would drop a frame that waits
    probe.open_session()
    probe.poll_status()
    probe.require_ack(probe.state, shown=0, pending=0)
    probe.require_displayed(probe.state, Page())

"""Checks of section 10: READ and PAGE."""

from __future__ import annotations

from voxdisplay.conformance import ops, packets
from voxdisplay.conformance.catalogue import (
    check,
    feature,
    min_voxels,
    refresh_tick,
    without_feature,
)
from voxdisplay.conformance.checks.packet_types import require_session_open
from voxdisplay.conformance.checks.pending_swap import index_of_swap
from voxdisplay.conformance.packets import BACK, CLEAR, COMMIT, body, data, read
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

READ = feature("READ")
_ATTEMPTS = 8


def show_test_picture(probe: Probe) -> None:
    """Show random pixels at the beginning and the end of the grid."""
    device, rng = probe.device, probe.rng
    most = min(device.voxel_count, 60, (device.max_payload - 16) // device.pixel_bytes)
    begin = [ops.random_pixel(device, rng) * rng.randrange(2) for _ in range(most)]
    end = [ops.random_pixel(device, rng) * (rng.randrange(3) > 0) for _ in range(most)]
    probe.show(
        ops.literal(device, begin), ops.skip(device.voxel_count - most) + ops.literal(device, end)
    )


def show_incompressible(probe: Probe) -> int:
    """Show random pixels, more than a PAGE holds if the grid is large enough; return how many."""
    device, rng = probe.device, probe.rng
    most = min(device.voxel_count, 2 * device.max_payload, 4096)
    per_packet = (device.max_payload - 16) // device.pixel_bytes
    payloads = []
    for at in range(0, most, per_packet):
        values = [ops.random_pixel(device, rng) for _ in range(min(per_packet, most - at))]
        payloads.append(ops.skip(at) + ops.literal(device, values))
    probe.show(*payloads)
    return most


def require_range(probe: Probe, start: int, count: int, flags: int = 0) -> None:
    """Read a range to its end; require the pixels of the front page."""
    must = probe.front.pixels if probe.front else {}
    end = start + count
    while start < end:
        got, covered = probe.read_range(start, end - start, flags)
        part = range(start, start + covered)
        for index in (
            part if covered < ops.MAX_VOXELS else sorted(i for i in {*got, *must} if i in part)
        ):
            if got.get(index, 0) != must.get(index, 0):
                probe.fail(
                    f"pixel {must.get(index, 0):X}h at index {index}",
                    f"{got.get(index, 0):X}h",
                    _likely(must, got, part),
                )
        start += covered


def _likely(must: dict[int, int], got: dict[int, int], part: range) -> str:
    for shift in (-1, 1):
        if all(must.get(i + shift, 0) == got.get(i, 0) for i in part[: ops.MAX_VOXELS]):
            return f"all pixels are off by {abs(shift)}: `start` is the index of the first voxel"
    return "check the byte order of a pixel, and the order of pixels in a LIT"


@check("10", "whole-page", "the whole front page can be read", READ)
def whole_page(probe: Probe) -> None:
    show_test_picture(probe)
    require_range(probe, 0, probe.device.voxel_count)


@check("10", "ranges", "any range of indices can be read", READ)
def ranges(probe: Probe) -> None:
    show_test_picture(probe)
    v = probe.device.voxel_count
    for start, count in (
        (0, 1),
        (v - 1, 1),
        (v // 2, v - v // 2),
        (0, min(v, 31)),
        (0, min(v, 33)),
    ):
        require_range(probe, start, count)
    for _ in range(8):
        start = probe.rng.randrange(min(v, 60))
        require_range(probe, start, probe.rng.randint(1, min(v - start, 70)))


@check(
    "10",
    "page-fields",
    "PAGE carries the READ's tag, start and flag, and the frame on display",
    READ,
)
def page_fields(probe: Probe) -> None:
    probe.show(ops.run())
    probe.show(ops.run())
    v = probe.device.voxel_count
    for tag, start, count, flags in ((0, 0, v, 0), (255, v - 1, 1, 0), (7, v // 2, 1, BACK)):
        page = probe.request_page(read(start, count, tag, flags))
        for name, must, came in (
            ("its tag", tag, page.seq),
            ("its start", start, page.start),
            ("its flags", flags, page.flags),
            ("frame 1, which is on display", 1, page.frame),
        ):
            probe.require(must == came, f"{name}: {must}", page)
        probe.require(1 <= page.count <= count, f"count 1 to {count}", page)


@check("10", "page-frame", "before the first swap of a session the frame of a PAGE is 0", READ)
def page_frame(probe: Probe) -> None:
    probe.show(b"")
    probe.show(b"")
    probe.open_session()
    page = probe.request_page(read(0, 1))
    probe.require(page.frame == 0, "frame 0, as of an ACK without SHOWN", page)


@check(
    "10",
    "back-page",
    "BACK reads the back page: what is drawn, but not on display yet",
    READ,
    min_voxels(2),
)
def back_page(probe: Probe) -> None:
    device = probe.device
    probe.show(ops.single_voxel(device, 0))
    probe.draw(ops.single_voxel(device, 1))
    got, _ = probe.read_range(0, 2, BACK)
    probe.require(got == {1: device.full_pixel}, "the back page with voxel 1 lit", got)
    got, _ = probe.read_range(0, 2)
    probe.require(got == {0: device.full_pixel}, "the front page with voxel 0 lit", got)


@check(
    "10",
    "back-page-pending",
    "while a frame is pending, BACK reads that frame",
    READ,
    refresh_tick,
    min_voxels(2),
)
def back_page_pending(probe: Probe) -> None:
    device = probe.device
    probe.show(ops.single_voxel(device, 0))
    for frame in range(1, 1 + _ATTEMPTS):
        packet = data(frame, frame, ops.single_voxel(device, 1), CLEAR | COMMIT)
        responses = probe.send_and_poll(packet, read(0, 2, 7, BACK))
        pages = [at for at, answer in enumerate(responses) if answer.kind == spec.TYPE_PAGE]
        probe.require(bool(pages), "PAGE", responses[-1] if responses else "nothing")
        is_pending = pages[0] < index_of_swap(responses, frame)
        probe.await_shown(frame, [*responses, probe.state])
        if is_pending:  # otherwise the tick was faster
            got = probe.decode_page(responses[pages[0]], 0, 2)
            must = {1: device.full_pixel} if responses[pages[0]].count == 2 else {}
            probe.require(got == must, "the pending frame, with voxel 1 lit", got)
            return


@check("10", "dense-page", "a range that does not fit one PAGE is covered in part", READ)
def dense_page(probe: Probe) -> None:
    require_range(probe, 0, show_incompressible(probe))


@check("10", "read-fields", "a READ of no voxel is refused: FIELD at 8", READ)
def read_fields(probe: Probe) -> None:
    probe.require_refused(read(0, 0), spec.CODE_FIELD, 8)
    probe.require_refused(read(probe.device.voxel_count, 0), spec.CODE_FIELD, 8)
    require_session_open(probe)


@check("10", "read-outside", "a READ beyond the last voxel is refused: OUTSIDE at 4", READ)
def read_outside(probe: Probe) -> None:
    v = probe.device.voxel_count
    for start, count in (
        (v, 1),
        (0, v + 1),
        (v - 1, 2),
        (0xFFFFFFFF, 1),
        (1, 0xFFFFFFFF),
        (0xFFFFFFFF, 0xFFFFFFFF),
    ):
        probe.require_refused(read(start, count), spec.CODE_OUTSIDE, 4)
    require_session_open(probe)


@check("10", "read-length", "a READ that is too short or too long is refused: LENGTH", READ)
def read_length(probe: Probe) -> None:
    good = read(0, 1)
    for packet in (good[:-1], good[:-4], good[:4], good[:3], good + b"\0", good + b"\1\2\3"):
        probe.require_refused(packet, spec.CODE_LENGTH, 0)
    require_session_open(probe)


@check(
    "10",
    "read-refused",
    "without the feature READ, a READ is refused: TYPE",
    without_feature("READ"),
)
def read_refused(probe: Probe) -> None:
    for packet in (read(0, 1), read(0, 0), body(spec.TYPE_READ), packets.read(0, 1, 9, 15)):
        probe.require_refused(packet, spec.CODE_TYPE, 0)
    require_session_open(probe)

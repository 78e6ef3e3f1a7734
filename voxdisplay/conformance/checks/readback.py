"""Section 10: READ and PAGE."""

from __future__ import annotations

from voxdisplay.conformance import ops, packets
from voxdisplay.conformance.catalogue import check, feature, voxels, without
from voxdisplay.conformance.checks.packet_types import demand_still_open
from voxdisplay.conformance.packets import BACK, body, read
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

READ = feature("READ")


def picture(probe: Probe) -> None:
    """Show something uneven near the begin and the end of the grid."""
    said, rng = probe.said, probe.rng
    most = min(said.voxels, 60, (said.max_payload - 16) // said.pixel_bytes)
    begin = [ops.some_value(said, rng) * rng.randrange(2) for _ in range(most)]
    end = [ops.some_value(said, rng) * (rng.randrange(3) > 0) for _ in range(most)]
    probe.show(ops.literal(said, begin), ops.skip(said.voxels - most) + ops.literal(said, end))


def dense(probe: Probe) -> int:
    """Show something that no PAGE holds whole, as far as the grid has room; give its voxels."""
    said, rng = probe.said, probe.rng
    most = min(said.voxels, 2 * said.max_payload, 4096)
    per_packet = (said.max_payload - 16) // said.pixel_bytes
    payloads = []
    for at in range(0, most, per_packet):
        values = [ops.some_value(said, rng) for _ in range(min(per_packet, most - at))]
        payloads.append(ops.skip(at) + ops.literal(said, values))
    probe.show(*payloads)
    return most


def demand_range(probe: Probe, start: int, count: int, flags: int = 0) -> None:
    """Read a range to its end; demand the pixels that are in the front page."""
    must = probe.front.pixels if probe.front else {}
    end = start + count
    while start < end:
        got, covered = probe.read_range(start, end - start, flags)
        part = range(start, start + covered)
        for index in part if covered < ops.MANY else sorted(i for i in {*got, *must} if i in part):
            if got.get(index, 0) != must.get(index, 0):
                probe.fail(
                    f"pixel {must.get(index, 0):X}h at index {index}",
                    f"{got.get(index, 0):X}h",
                    _likely(must, got, part),
                )
        start += covered


def _likely(must: dict[int, int], got: dict[int, int], part: range) -> str:
    for shift in (-1, 1):
        if all(must.get(i + shift, 0) == got.get(i, 0) for i in part[: ops.MANY]):
            return f"all is off by {abs(shift)}: `start` is the index of the first voxel"
    return "are the bytes of a pixel, and the order of pixels in a LIT, right?"


@check("10", "whole-page", "the front page can be read whole", READ)
def whole_page(probe: Probe) -> None:
    picture(probe)
    demand_range(probe, 0, probe.said.voxels)


@check("10", "ranges", "any range of indices can be read", READ)
def ranges(probe: Probe) -> None:
    picture(probe)
    v = probe.said.voxels
    for start, count in (
        (0, 1),
        (v - 1, 1),
        (v // 2, v - v // 2),
        (0, min(v, 31)),
        (0, min(v, 33)),
    ):
        demand_range(probe, start, count)
    for _ in range(8):
        start = probe.rng.randrange(min(v, 60))
        demand_range(probe, start, probe.rng.randint(1, min(v - start, 70)))


@check(
    "10", "page-fields", "PAGE has the READ's tag, start and flag, and the frame on display", READ
)
def page_fields(probe: Probe) -> None:
    probe.show(ops.run())
    probe.show(ops.run())
    v = probe.said.voxels
    for tag, start, count, flags in ((0, 0, v, 0), (255, v - 1, 1, 0), (7, v // 2, 1, BACK)):
        page = probe.ask_page(read(start, count, tag, flags))
        for name, must, came in (
            ("its tag", tag, page.seq),
            ("its start", start, page.start),
            ("its flags", flags, page.flags),
            ("frame 1, which is on display", 1, page.frame),
        ):
            probe.demand(must == came, f"{name}: {must}", page)
        probe.demand(1 <= page.count <= count, f"count 1 to {count}", page)


@check("10", "page-frame", "before the first swap of a session the frame of a PAGE is 0", READ)
def page_frame(probe: Probe) -> None:
    probe.show(b"")
    probe.show(b"")
    probe.open()
    page = probe.ask_page(read(0, 1))
    probe.demand(page.frame == 0, "frame 0, as of an ACK without SHOWN", page)


@check(
    "10", "back-page", "BACK reads what has been drawn and is not on display yet", READ, voxels(2)
)
def back_page(probe: Probe) -> None:
    said = probe.said
    probe.show(ops.dot(said, 0))
    probe.draw(ops.dot(said, 1))
    got, _ = probe.read_range(0, 2, BACK)
    probe.demand(got == {1: said.full}, "the back page with voxel 1 lit", got)
    got, _ = probe.read_range(0, 2)
    probe.demand(got == {0: said.full}, "the front page with voxel 0 lit", got)


@check("10", "dense-page", "what does not fit one PAGE is covered in part", READ)
def dense_page(probe: Probe) -> None:
    demand_range(probe, 0, dense(probe))


@check("10", "read-fields", "a READ of no voxel is refused: FIELD at 8", READ)
def read_fields(probe: Probe) -> None:
    probe.refuse(read(0, 0), spec.CODE_FIELD, 8)
    probe.refuse(read(probe.said.voxels, 0), spec.CODE_FIELD, 8)
    demand_still_open(probe)


@check("10", "read-outside", "a READ beyond the last voxel is refused: OUTSIDE at 4", READ)
def read_outside(probe: Probe) -> None:
    v = probe.said.voxels
    for start, count in (
        (v, 1),
        (0, v + 1),
        (v - 1, 2),
        (0xFFFFFFFF, 1),
        (1, 0xFFFFFFFF),
        (0xFFFFFFFF, 0xFFFFFFFF),
    ):
        probe.refuse(read(start, count), spec.CODE_OUTSIDE, 4)
    demand_still_open(probe)


@check("10", "read-length", "a READ that is too short or too long is refused: LENGTH", READ)
def read_length(probe: Probe) -> None:
    good = read(0, 1)
    for packet in (good[:-1], good[:-4], good[:4], good[:3], good + b"\0", good + b"\1\2\3"):
        probe.refuse(packet, spec.CODE_LENGTH, 0)
    demand_still_open(probe)


@check("10", "read-refused", "without the feature READ it is refused: TYPE", without("READ"))
def read_refused(probe: Probe) -> None:
    for packet in (read(0, 1), read(0, 0), body(spec.TYPE_READ), packets.read(0, 1, 9, 15)):
        probe.refuse(packet, spec.CODE_TYPE, 0)
    demand_still_open(probe)

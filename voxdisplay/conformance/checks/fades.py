"""Checks of section 7.9: fades (ops FADE and RAMP)."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.catalogue import check, feature, readable_display
from voxdisplay.conformance.checks.drawing import axis_of_two
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_RED_TO_BLUE = ((255, 2, 9), (0, 250, 3), (7, 0, 255))


def longest_axis(device: AnnouncedDevice) -> int:
    """Return the axis with the most voxels."""
    return device.grid.index(max(device.grid))


def straight(device: AnnouncedDevice, steps: int) -> bytes:
    """Return a STEP straight on along the longest axis."""
    return ops.chain(device, 8 * longest_axis(device), [0] * steps)


@check(
    "7.9",
    "fade-chains",
    "each voxel of a chain has the pen of its place in a FADE",
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def fade_chains(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for _ in range(12):
        octant = 8 * longest_axis(device) + rng.randrange(8)
        start, crumbs = ops.random_chain(device, rng, octant) or ((0, 0, 0), [0])
        count = len(crumbs) + rng.choice([1, 3, 500])
        payload = ops.fade(device, ops.random_stops(rng), count, rng.randrange(count))
        probe.show(payload + ops.chain(device, octant, crumbs, start))


@check(
    "7.9",
    "fade-rounding",
    "the blend of a FADE is rounded to the nearest, ties upwards, rising and falling",
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def fade_rounding(probe: Probe) -> None:
    device = probe.device
    for stops in (((0, 9, 2), (7, 0, 0)), ((7, 0, 5), (0, 9, 1)), _RED_TO_BLUE):
        for count in (2, 3, 5, 8):
            for begin in range(count - 1):
                payload = ops.fade(device, stops, count, begin)
                probe.show(payload + ops.chain(device, 8 * longest_axis(device), [0], (0, 0, 0)))


@check(
    "7.9",
    "fade-goes-on",
    "the voxel at the end of a chain is not counted again by the STEP that goes on there",
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def fade_goes_on(probe: Probe) -> None:
    device = probe.device
    back = 8 * longest_axis(device) + (1 << longest_axis(device))
    payload = ops.fade(device, _RED_TO_BLUE, 9, 2)
    payload += straight(device, 1) + ops.chain(device, back, [0]) + straight(device, 1)
    probe.show(payload)


@check(
    "7.9",
    "fade-cursor-set",
    "a STEP counts its first voxel if another op has set the cursor",
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def fade_cursor_set(probe: Probe) -> None:
    device = probe.device
    end = [0, 0, 0]
    end[longest_axis(device)] = 1
    back = ops.chain(device, 8 * longest_axis(device) + (1 << longest_axis(device)), [0])
    begin = ops.fade(device, _RED_TO_BLUE, 9, 1) + straight(device, 1)
    probe.show(begin + ops.move(device, end) + back)
    probe.show(begin + ops.fade(device, _RED_TO_BLUE, 9, 4) + back)


@check(
    "7.9",
    "fade-runs",
    "RUN has the pen of a FADE's place and counts nothing; DOTS counts each voxel",
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def fade_runs(probe: Probe) -> None:
    device = probe.device
    begin = ops.fade(device, _RED_TO_BLUE, 9, 3)
    probe.show(begin + ops.run(2))
    probe.show(begin + ops.run(1) + ops.move(device, (0, 0, 0)) + straight(device, 1))
    if device.has("DOTS"):
        last = ops.random_voxel(device, probe.rng)
        probe.show(begin + ops.dots(device, [(0, 0, 0), last, (0, 0, 0)]))


@check(
    "7.9",
    "fade-past-its-end",
    "behind the last voxel of a FADE its last pen stays",
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def fade_past_its_end(probe: Probe) -> None:
    device = probe.device
    back = ops.chain(device, 8 * longest_axis(device) + (1 << longest_axis(device)), [0])
    for count, at in ((1, 0), (2, 1), (3, 1)):
        begin = ops.fade(device, _RED_TO_BLUE, count, at)
        probe.show(begin + straight(device, 1) + back + straight(device, 1))


@check(
    "7.9",
    "fade-ended",
    "PEN and LIT end a FADE",
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def fade_ended(probe: Probe) -> None:
    device = probe.device
    begin = ops.fade(device, _RED_TO_BLUE, 9, 1)
    probe.show(begin + ops.pen(device, 5) + straight(device, 1))
    probe.show(begin + ops.literal(device, [3]) + ops.move(device, (0, 0, 0)) + straight(device, 1))


@check("7.9", "ramps", "RAMP sets entries to a blend", feature("RAMP"), feature("DIGEST"))
def ramps(probe: Probe) -> None:
    for first, count in ((0, 256), (250, 6), (9, 1), (3, 20)):
        stops = ops.random_stops(probe.rng)
        probe.show(ops.ramp(first, count, stops) + ops.run(), exactly=True)


@check(
    "7.9",
    "fade-refused",
    "a FADE of too many voxels, or that begins behind its end, is refused: COUNT",
    feature("FADE"),
)
def fade_refused(probe: Probe) -> None:
    device = probe.device
    too_many = ops.fade(device, _RED_TO_BLUE, spec.LIMIT_MAX_FADE + 1, 3)
    probe.require_ops_refused(ops.run() + too_many, spec.CODE_COUNT, 1)
    behind = ops.fade(device, _RED_TO_BLUE, 5, 5)
    probe.require_ops_refused(ops.run() + behind, spec.CODE_COUNT, 1)
    cut = ops.fade(device, _RED_TO_BLUE, 5, 4)[:-1]
    probe.require_ops_refused(ops.run() + cut, spec.CODE_TRUNCATED, 1)


@check("7.9", "ramp-refused", "a RAMP behind the palette is refused: OUTSIDE", feature("RAMP"))
def ramp_refused(probe: Probe) -> None:
    probe.require_ops_refused(ops.ramp(250, 7, _RED_TO_BLUE), spec.CODE_OUTSIDE)
    probe.require_ops_refused(ops.ramp(250, 6, _RED_TO_BLUE)[:-1], spec.CODE_TRUNCATED)

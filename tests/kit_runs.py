"""Runs of the conformance kit on emulated devices, in virtual time."""

from virtual_time_device import VirtualTimeDevice

from voxdisplay.conformance import packets
from voxdisplay.conformance.run import Verdict, run_checks

SMALL = {"grid": (3, 5, 7), "pixel_format": "index8", "refresh": 200_000, "max_payload": 256}
DEVICES = {
    "at-once": {"refresh": 0},
    "mono": {"grid": (17, 64, 40), "pixel_format": "mono1", "max_silent_acks": 8},
    "wide": {
        "grid": (300, 4, 3),
        "pixel_format": "rgb888",
        "max_payload": 64,
        "rx_buffer": 137,
        "name": "a",
    },
    "one-voxel": {"grid": (1, 1, 1), "pixel_format": "rgb565"},
    "bare": {"features": frozenset(), "pixel_format": "rgb888"},
    "digest-only": {"features": frozenset(("digest", "line"))},
    "read-only": {"features": frozenset(("read", "diff"))},
}


def emulated_port(**config):
    return VirtualTimeDevice(**{**SMALL, "rx_buffer": 2048, "boot": 7} | config)


def examined(port, only=(), **how):
    return run_checks(port, only, clock=port.clock, **how)


def by_verdict(report, verdict):
    return {result.check.id for result in report.results if result.verdict is verdict}


def explain(report):
    return "\n".join(
        f"{result.check.id}: must be {result.expected}, was {result.actual}, "
        f"likely {result.likely_cause}"
        for result in report.results
        if result.verdict is Verdict.BROKEN
    )


def info_of(port):
    port.write(b"\0" + packets.encode(packets.hello(9)), 1)
    (segment, rest) = port.read(1).split(b"\0")
    assert not rest
    return packets.Response(packets.decode_segment(segment))

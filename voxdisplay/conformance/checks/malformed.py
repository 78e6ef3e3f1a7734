"""Section 12: a device gets through any bytes whatever."""

from __future__ import annotations

from voxdisplay.conformance import ops, packets
from voxdisplay.conformance.catalogue import check
from voxdisplay.conformance.packets import data, encode
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_NOISE = 60  # bytes at a time, of which the credit of any device has room


def require_damage_count(probe: Probe, stream: bytes, text: str) -> None:
    """Send bytes that hold no packet; demand the right count of damage, and that all goes on."""
    probe.poll_status()
    before = probe.state.damaged
    must = packets.count_damaged(stream, probe.device.max_payload)
    come = probe.send_raw_and_poll(stream, text)
    grown = (probe.state.damaged - before) % 65536
    probe.require(grown == must, f"{must} damaged segments in {stream.hex(' ').upper()}", grown)
    probe.require(len(come) == must, f"{must} ACKs for them", len(come))


@check("12", "noise", "noise of any kind costs its segments, and nothing else")
def noise(probe: Probe) -> None:
    rng = probe.rng
    for number in range(40):
        bytes_ = bytes(
            rng.choice((0, 1, 2, 5, 8, 255, rng.randrange(256)))
            for _ in range(rng.randint(1, _NOISE))
        )
        require_damage_count(probe, bytes_ + b"\0", f"noise {number}")
    probe.draw(ops.run())


@check("12", "mutated", "so does a packet that was changed anywhere")
def mutated(probe: Probe) -> None:
    rng = probe.rng
    for number in range(40):
        stream = bytearray(encode(data(0, 0, ops.run() * rng.randint(1, 20))))
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(stream))
            if rng.random() < 0.5:
                stream[at] = rng.randrange(256)
            elif rng.random() < 0.5:
                del stream[at]
            else:
                stream.insert(at, rng.randrange(256))
        segments = bytes(stream).split(b"\0")
        if not any(
            len(s) >= spec.LIMIT_MIN_SEGMENT and packets.decode_segment(s) for s in segments
        ):
            require_damage_count(probe, bytes(stream) + b"\0", f"a changed packet {number}")
    probe.draw(ops.run())

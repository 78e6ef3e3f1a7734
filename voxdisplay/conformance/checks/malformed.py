"""Checks of section 12: a device survives any input."""

from __future__ import annotations

from voxdisplay.conformance import ops, packets
from voxdisplay.conformance.catalogue import check
from voxdisplay.conformance.packets import data, encode
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_MAX_NOISE_BYTES = 60  # at a time: within the reserve of 64 bytes of any device's credit


def require_damage_count(probe: Probe, stream: bytes, text: str) -> None:
    """Send bytes that hold no packet; require the right damage count, and an ACK for each."""
    probe.poll_status()
    before = probe.state.damaged
    must = packets.count_damaged(stream, probe.device.max_payload)
    responses = probe.send_raw_and_poll(stream, text)
    grown = (probe.state.damaged - before) % 65536
    probe.require(grown == must, f"{must} damaged segments in {stream.hex(' ').upper()}", grown)
    probe.require(len(responses) == must, f"{must} ACKs for them", len(responses))


@check("12", "noise", "random noise counts as damaged segments and changes nothing else")
def noise(probe: Probe) -> None:
    rng = probe.rng
    for number in range(40):
        bytes_ = bytes(
            rng.choice((0, 1, 2, 5, 8, 255, rng.randrange(256)))
            for _ in range(rng.randint(1, _MAX_NOISE_BYTES))
        )
        require_damage_count(probe, bytes_ + b"\0", f"noise {number}")
    probe.draw(ops.run())


@check("12", "mutated", "a randomly corrupted packet counts as damaged and changes nothing else")
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

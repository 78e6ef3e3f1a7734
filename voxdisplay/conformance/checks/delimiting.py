"""Checks of section 3: segments, COBS and damage."""

from __future__ import annotations

from voxdisplay.conformance import ops, packets
from voxdisplay.conformance.catalogue import check
from voxdisplay.conformance.packets import data, encode
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec


def require_damaged(probe: Probe, stream: bytes, what: str, likely: str = "") -> None:
    """Send bytes that hold no packet; require that only the damage count changes."""
    probe.poll_status()
    before = probe.state
    count = packets.count_damaged(stream, probe.device.max_payload)
    probe.send_raw_and_poll(stream, what)
    after = probe.state
    if after.kind != spec.TYPE_ACK:
        probe.fail(f"{what} leaves the session open", after, likely)
    grown = (after.damaged - before.damaged) % 65536
    probe.require(grown == count, f"{what} adds {count} to `damaged`", f"it added {grown}", likely)
    same = (after.next, after.received) == (before.next, before.received)
    probe.require(same, f"{what} changes nothing else", f"{before}, then {after}", likely)


@check("3", "empty-segments", "00 between packets is ignored")
def empty_segments(probe: Probe) -> None:
    responses = probe.send_raw_and_poll(bytes(40), "40 times 00")
    probe.require(not responses, "no response to empty segments", responses and responses[0])
    require_damaged(probe, bytes(40), "40 times 00", "an empty segment is no damaged one")


@check("3", "short-segments", "a segment of fewer than 8 bytes is dropped without answer or count")
def short_segments(probe: Probe) -> None:
    for size in range(1, spec.LIMIT_MIN_SEGMENT):
        for segment in (bytes(range(1, size + 1)), b"\xff" * size):
            stream = segment + b"\0"
            responses = probe.send_raw_and_poll(stream, f"a segment of {size} bytes")
            probe.require(
                not responses,
                f"no response to a segment of {size} bytes",
                responses and responses[0],
            )
            require_damaged(
                probe, stream, f"a segment of {size} bytes", "only from 8 bytes on it is damage"
            )


@check("3", "shortest-damage", "a segment of 8 bytes that is not a packet counts as damaged")
def shortest_damage(probe: Probe) -> None:
    require_damaged(probe, b"\x08\x11\x22\x33\x44\x55\x66\x77\0", "a segment of 8 bytes")


@check("3", "cobs-overrun", "a code byte beyond the segment's end makes the segment damaged")
def cobs_overrun(probe: Probe) -> None:
    for size in (1, 6, 20):
        segment = bytearray(encode(data(0, 0, ops.run() * size))[:-1])
        last = 0  # its last group: all bytes are there, and the check value would hold
        while last + segment[last] < len(segment):
            last += segment[last]
        for code in (segment[last] + 1, 100, 255):
            longer = segment[:last] + bytes((code,)) + segment[last + 1 :]
            require_damaged(
                probe,
                bytes(longer) + b"\0",
                f"a last code byte of {code} instead of {segment[last]}",
                "a group with fewer bytes than its code byte says is not detected",
            )


@check("3", "bit-errors", "a packet with any single bit flipped is damaged")
def bit_errors(probe: Probe) -> None:
    good = encode(data(0, 0, ops.single_voxel(probe.device, 0)))
    bits = range(8 * (len(good) - 1))
    for bit in sorted(probe.rng.sample(bits, min(40, len(bits)))):
        bad = bytearray(good)
        bad[bit >> 3] ^= 1 << (bit & 7)
        require_damaged(
            probe, bytes(bad), f"a packet with bit {bit} flipped", "is the CRC looked at?"
        )
    probe.draw(ops.single_voxel(probe.device, 0))


@check("3", "cut-packets", "a packet truncated by 00 is damaged, or dropped as too short")
def cut_packets(probe: Probe) -> None:
    good = encode(data(0, 0, ops.single_voxel(probe.device, 0)))
    for size in range(1, len(good) - 1):
        require_damaged(probe, good[:size] + b"\0", f"the first {size} bytes of a packet, and 00")


@check("3", "merged-packets", "two packets without the 00 between them are one damaged segment")
def merged_packets(probe: Probe) -> None:
    first, second = encode(data(0, 0)), encode(data(1, 0))
    require_damaged(probe, first[:-1] + second, "two packets without 00 between")
    probe.draw(b"")


@check("3", "resync", "after noise, reception resumes behind the next 00")
def resync(probe: Probe) -> None:
    for noise in (b"boot v1.2\r\n" * 3, b"\xff" * 60, bytes(range(1, 60)), b"\x01" * 60):
        require_damaged(probe, noise + b"\0", f"noise of {len(noise)} bytes, and 00")
    probe.draw(b"")


@check("3", "any-pieces", "a packet may arrive in pieces of any size")
def any_pieces(probe: Probe) -> None:
    stream = encode(data(0, 0, ops.single_voxel(probe.device, 0))) + encode(data(1, 0))
    for byte in stream:
        probe.send_raw(bytes((byte,)), "one byte")
    probe.poll_status()
    probe.require_ack(probe.state, next=2)


@check("3", "longest-packet", "a packet with a payload of max_payload bytes is taken")
def longest_packet(probe: Probe) -> None:
    size = probe.device.max_payload
    probe.draw(bytes(size))
    one = ops.pen(probe.device, probe.device.full_pixel)
    probe.draw((one * (size // len(one))).ljust(size, b"\0"))


@check("3", "too-long", "a packet of more than max_payload + 7 bytes is damaged")
def too_long(probe: Probe) -> None:
    size = probe.device.max_payload
    require_damaged(probe, encode(data(0, 0, bytes(size + 1))), f"a payload of {size + 1} bytes")
    require_damaged(
        probe, b"\xa0" * (probe.device.longest_packet_bytes + 20) + b"\0", "a segment without end"
    )
    probe.draw(b"")


@check(
    "3",
    "cobs-groups",
    "COBS groups of 254 bytes, and packets that end with such a group or with 00",
)
def cobs_groups(probe: Probe) -> None:
    device = probe.device
    one = ops.pen(device, device.full_pixel)
    size = min(device.max_payload, 600)
    for length in {*range(1, 6), *range(243, 257), *range(498, 512), size}:
        if length <= size:
            probe.draw((one * length)[: length // len(one) * len(one)].ljust(length, b"\0"))

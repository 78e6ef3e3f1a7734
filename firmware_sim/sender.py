"""Packet encoding: check value, COBS, and the 00 delimiter (3, 4).

Knows nothing of what packets mean.
"""

from firmware_sim import spec
from firmware_sim.crc import crc32

_GROUP = 254  # section 3: most bytes of a COBS group


def max_wire_bytes(packet: int) -> int:
    """Return the most bytes that a packet can have on the wire.

    Parameters
    ----------
    packet
        Size of the packet in bytes, check value included, at least 1.

    Returns
    -------
    int
        Size with the most code bytes that COBS can need, and the 00.
    """
    return packet + -(-packet // _GROUP) + 1


def encode_segment(packet: bytes) -> bytes:
    """COBS-encode a packet and append the 00 delimiter.

    Parameters
    ----------
    packet
        Any bytes, at least one.

    Returns
    -------
    bytes
        The encoded bytes; the only 00 is the last byte.
    """
    wire = bytearray()
    *parts, last = packet.split(b"\0")
    for part in parts:
        _append_full_groups(wire, part)
        rest = len(part) % _GROUP
        wire.append(rest + 1)
        wire += part[len(part) - rest :]
    _append_full_groups(wire, last)
    rest = len(last) % _GROUP
    if rest or not last:  # nothing follows a last group of 254 bytes
        wire.append(rest + 1)
        wire += last[len(last) - rest :]
    wire.append(0)
    return bytes(wire)


def _append_full_groups(wire: bytearray, part: bytes) -> None:
    """Append the groups of 254 bytes of a part without 00."""
    for start in range(0, len(part) - _GROUP + 1, _GROUP):
        wire.append(_GROUP + 1)
        wire += part[start : start + _GROUP]


def encode_packet(kind: int, flags: int, seq: int, frame: int, payload: bytes) -> bytes:
    """Build a packet and encode it for the wire.

    Parameters
    ----------
    kind, flags
        Type and flags, 0 to 15 each.
    seq, frame
        Bytes 1 and 2 of the header.
    payload
        Bytes between header and check value.

    Returns
    -------
    bytes
        The packet on the wire.
    """
    packet = bytes((kind << 4 | flags, seq, frame)) + payload
    return encode_segment(packet + crc32(packet).to_bytes(spec.CRC_WIDTH // 8, "little"))

"""Where no INFO comes: what may be the reason.

A device that computes its check value otherwise hears nothing but damage. So HELLO is sent in some
ways in which it could have been meant, and if one of them is answered, that is the mistake.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from voxdisplay.conformance import packets
from voxdisplay.conformance.catalogue import Check

if TYPE_CHECKING:
    from voxdisplay.conformance.probe import Probe

_VARIANT_TIMEOUT_S = 0.3
_MASK = 0xFFFFFFFF


def _crc32(data: bytes, poly: int, *, init: int = _MASK, last: int = _MASK) -> int:
    """Compute a reflected CRC-32, a bit at a time."""
    crc = init
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (poly if crc & 1 else 0)
    return crc ^ last


def _unreflected_crc32(data: bytes) -> int:
    """Compute a CRC-32 that is not reflected."""
    crc = _MASK
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc >> 31 else 0)) & _MASK
    return crc ^ _MASK


_ETHERNET, _CASTAGNOLI = 0xEDB88320, 0x82F63B78
_CHECK_VALUES: dict[str, Callable[[bytes], bytes]] = {
    "its bytes come highest first": lambda data: zlib.crc32(data).to_bytes(4, "big"),
    "XOROUT is left out": lambda data: (zlib.crc32(data) ^ _MASK).to_bytes(4, "little"),
    "INIT is 0": lambda data: _crc32(data, _ETHERNET, init=0).to_bytes(4, "little"),
    "it is CRC-32C": lambda data: _crc32(data, _CASTAGNOLI).to_bytes(4, "little"),
    "it is not reflected": lambda data: _unreflected_crc32(data).to_bytes(4, "little"),
    "it is left out": lambda data: b"",  # noqa: ARG005
}


def diagnose_silence(probe: Probe) -> str:
    """Try what a device could take for a HELLO; say what it took, or what to look at."""
    hello = packets.hello(probe.session)
    for why, check_value in _CHECK_VALUES.items():
        if _gets_response(probe, packets.cobs_encode(hello + check_value(hello)) + b"\0"):
            return f"the device answers a HELLO whose check value is wrong: {why}"
    if _gets_response(probe, packets.encode(hello)[:-1]):
        return "the device answers before the 00 that ends a packet"
    if _gets_response(probe, hello + zlib.crc32(hello).to_bytes(4, "little")):
        return "the device answers a HELLO that is not encoded by COBS"
    if probe.reader.byte_count:
        return f"{probe.reader.byte_count} bytes came, and no packet: is that its baud rate?"
    return "not a byte came: is it the right port and baud rate, and is the device on?"


def _gets_response(probe: Probe, stream: bytes) -> bool:
    """Send something; tell whether anything comes that could be a packet."""
    before = probe.reader.segment_count
    probe.send_raw(b"\0" + stream, "a HELLO that is not as it must be")
    until_s = probe.clock() + _VARIANT_TIMEOUT_S
    while probe.clock() < until_s and probe.reader.segment_count == before:
        probe.receive(until_s)
    return probe.reader.segment_count > before


def _never(probe: Probe) -> None:
    del probe


CHECK = Check("5", "answers", "a HELLO is answered with INFO", (), _never)

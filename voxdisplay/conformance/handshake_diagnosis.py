"""Diagnosis of a failed handshake: likely causes of a HELLO without INFO.

A device with another check value drops every packet as damaged. So HELLO is sent in the forms that
typical bugs would accept; the form that gets a response names the bug.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from voxdisplay.conformance import packets

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
    "it is missing": lambda data: b"",  # noqa: ARG005
}


def diagnose_silence(probe: Probe) -> str:
    """Send malformed HELLOs; return which one got a response, or what else to look at."""
    hello = packets.hello(probe.session)
    for why, check_value in _CHECK_VALUES.items():
        if _gets_response(probe, packets.cobs_encode(hello + check_value(hello)) + b"\0"):
            return f"the device responds to a HELLO with a wrong check value: {why}"
    if _gets_response(probe, packets.encode(hello)[:-1]):
        return "the device responds before the 00 that ends a packet"
    if _gets_response(probe, hello + zlib.crc32(hello).to_bytes(4, "little")):
        return "the device responds to a HELLO that is not COBS-encoded"
    if probe.reader.byte_count:
        return f"{probe.reader.byte_count} bytes came, but no packet: check the baud rate"
    return "no byte came: check port and baud rate, and that the device is on"


def _gets_response(probe: Probe, stream: bytes) -> bool:
    """Send bytes; return whether a segment comes back that could be a packet."""
    before = probe.reader.segment_count
    probe.send_raw(b"\0" + stream, "a malformed HELLO")
    until_s = probe.clock() + _VARIANT_TIMEOUT_S
    while probe.clock() < until_s and probe.reader.segment_count == before:
        probe.receive(until_s)
    return probe.reader.segment_count > before

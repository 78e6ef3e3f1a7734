"""CRC-32, the check value of packets (4), by a table computed from the polynomial.

Knows nothing of packets.
"""

from collections.abc import Iterable

from firmware_sim import spec


def _table() -> tuple[int, ...]:
    # Input and output are reflected: so is the polynomial, and the register shifts right.
    reflected = int(f"{spec.CRC_POLY:032b}"[::-1], 2)
    table = []
    for byte in range(256):
        register = byte
        for _ in range(8):
            register = (register >> 1) ^ (reflected if register & 1 else 0)
        table.append(register)
    return tuple(table)


_TABLE = _table()


def crc32(data: Iterable[int]) -> int:
    """Return the CRC-32 of some bytes.

    Parameters
    ----------
    data
        Bytes, or integers from 0 to 255.

    Returns
    -------
    int
        The check value, to be sent as a u32.
    """
    table = _TABLE
    register = spec.CRC_INIT
    for byte in data:
        register = table[(register ^ byte) & 0xFF] ^ (register >> 8)
    return register ^ spec.CRC_XOROUT

"""Listing of a payload's ops: name and size of each (protocol.md, section 7).

For statistics of packets. Ops are identified and measured, neither validated nor drawn; a truncated
or unknown op is listed as the rest of the payload.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import SHORT_COUNT, EncoderConfig

UNKNOWN: Final = "?"
_HOLD_BYTES: Final = 2
_CRUMBS_PER_BYTE: Final = 4


def list_ops(payload: bytes, config: EncoderConfig) -> Iterator[tuple[str, int]]:
    """Yield name and size of each op of a payload.

    Parameters
    ----------
    payload : bytes
        Of a DATA packet.
    config : EncoderConfig

    Yields
    ------
    name : str
        As in protocol.md's table, or ``"?"`` for an op that is unknown or truncated.
    size : int
        Bytes; the sizes add up to the payload's.

    """
    at = 0
    while at < len(payload):
        name, size = _op_at(payload, at, config)
        left = len(payload) - at
        yield (name, size) if size <= left else (UNKNOWN, left)
        at += size


def _op_at(payload: bytes, at: int, config: EncoderConfig) -> tuple[str, int]:
    op = payload[at]
    for name, (value, mask, measure) in _OPS.items():
        if op & mask == value:
            try:
                return name, measure(payload, at, config)
            except IndexError:
                break
    return UNKNOWN, len(payload) - at


def _rest(payload: bytes, at: int, _config: EncoderConfig) -> int:
    return len(payload) - at


def _chain(payload: bytes, at: int, config: EncoderConfig) -> int:
    place = config.position_bytes if payload[at] & 0xE0 == spec.OP_FROM else 0
    steps = payload[at + 1 + place] + 1
    return 2 + place + -(-steps // _CRUMBS_PER_BYTE)


def _count(payload: bytes, at: int) -> tuple[int, int]:
    """Return the count of an op, and the bytes of op and count."""
    low = payload[at] & SHORT_COUNT
    if low < SHORT_COUNT:
        return low + 1, 1
    end = at + 1
    while payload[end] & 0x80:
        end += 1
    rest = sum((byte & 0x7F) << 7 * place for place, byte in enumerate(payload[at + 1 : end + 1]))
    return SHORT_COUNT + 1 + rest, end + 1 - at


def _brick(payload: bytes, at: int, config: EncoderConfig) -> int:
    """Return the size of an OCT from its masks, level by level."""
    size = 1 + config.position_bytes
    nodes = 1
    for _ in range(payload[at] & 0x1F):
        masks = payload[at + size : at + size + nodes]
        size += nodes
        nodes = sum(mask.bit_count() for mask in masks)
    return size


def _differences(payload: bytes, at: int, _config: EncoderConfig) -> int:
    count, size = _count(payload, at)
    return size + (count + 1) // 2


def _fade(payload: bytes, at: int, config: EncoderConfig) -> int:
    end = at + 2
    for _ in range(2):  # two LEB128
        while payload[end] & 0x80:
            end += 1
        end += 1
    color = 1 if config.format is PixelFormat.INDEX8 else 3
    return end - at + color * (payload[at + 1] + 1)


def _counted(payload: bytes, at: int, _config: EncoderConfig) -> int:
    return _count(payload, at)[1]


def _literal(payload: bytes, at: int, config: EncoderConfig) -> int:
    count, size = _count(payload, at)
    if config.format is PixelFormat.MONO1:
        return size + (count + 7) // 8
    return size + count * config.format.bytes


# Value, mask of the bits that identify it, and size: by name, in the order of section 7.
_OPS: Final[dict[str, tuple[int, int, Callable[[bytes, int, EncoderConfig], int]]]] = {
    "END": (spec.OP_END, 0xFF, _rest),
    "PEN": (spec.OP_PEN, 0xFF, lambda _payload, _at, config: config.pen_bytes),
    "MOVE": (spec.OP_MOVE, 0xFF, lambda _payload, _at, config: 1 + config.position_bytes),
    "LINE": (spec.OP_LINE, 0xFF, lambda _payload, _at, config: 1 + config.position_bytes),
    "BOX": (spec.OP_BOX, 0xFF, lambda _payload, _at, config: 1 + config.position_bytes),
    "DOTS": (
        spec.OP_DOTS,
        0xFF,
        lambda payload, at, config: 2 + (payload[at + 1] + 1) * config.position_bytes,
    ),
    "COLORS": (spec.OP_COLORS, 0xFF, lambda payload, at, _config: 3 + 3 * (payload[at + 2] + 1)),
    "HOLD": (spec.OP_HOLD, 0xFF, lambda _payload, _at, _config: _HOLD_BYTES),
    "FADE": (spec.OP_FADE, 0xFF, _fade),
    "RAMP": (spec.OP_RAMP, 0xFF, lambda payload, at, _config: 4 + 3 * (payload[at + 3] + 1)),
    "STEP": (spec.OP_STEP, 0xE0, _chain),
    "ARC": (spec.OP_ARC, 0xFF, _rest),
    "SLABS": (spec.OP_SLABS, 0xFF, _rest),
    "ARC2": (spec.OP_ARC2, 0xFF, _rest),
    "VALUES": (spec.OP_VALUES, 0xFF, _rest),
    "FROM": (spec.OP_FROM, 0xE0, _chain),
    "OCT": (spec.OP_OCT, 0xE0, _brick),
    "SKIP": (spec.OP_SKIP, 0xE0, _counted),
    "RUN": (spec.OP_RUN, 0xE0, _counted),
    "LIT": (spec.OP_LIT, 0xE0, _literal),
    "DIFF": (spec.OP_DIFF, 0xE0, _differences),
}

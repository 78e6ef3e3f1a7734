"""Digest of section 8 in its simplest form, and drawing of ops on an emulator's page."""

import math
from fractions import Fraction

from firmware_sim.config import Config
from firmware_sim.grid import Grid
from firmware_sim.memory import DEFAULT_PALETTE, FORMATS, Page
from firmware_sim.op_decoder import OpDecoder

CLEAR = b"\x11\0\0"  # the header of a DATA packet
GRIDS = [(3, 5, 7), (17, 64, 40), (300, 4, 3), (1, 1, 1), (256, 2, 2)]


def mix(index: int, value: int) -> int:
    """Section 8, word for word."""
    h = (index * 0x9E3779B1 + value * 0x85EBCA77) % 2**32
    h ^= h >> 15
    h = h * 0x2C1B3C6D % 2**32
    h ^= h >> 12
    h = h * 0x297A2D39 % 2**32
    return h ^ h >> 15


def digest(pixels: bytes, size: int, palette: bytes = DEFAULT_PALETTE) -> int:
    values = [int.from_bytes(pixels[i : i + size], "little") for i in range(0, len(pixels), size)]
    total = sum(mix(index, value) for index, value in enumerate(values) if value)
    for i in range(256):
        red, green, blue = palette[3 * i : 3 * i + 3]
        if bytes((red, green, blue)) != default_color(i):
            total += mix(len(values) + i, 0x1000000 + red + 256 * green + 65536 * blue)
    return total % 2**32


def default_color(i: int) -> bytes:
    """Sections 2.1 and 8, word for word."""
    values = (Fraction(i >> 5, 7), Fraction((i >> 2) & 7, 7), Fraction(i & 3, 3))
    return bytes(math.floor(255 * value + Fraction(1, 2)) for value in values)


def draw_ops(ops: bytes, grid: Grid, name: str, page: Page, features: int | None = None) -> None:
    """Draw ops as a device with all features does, if not told otherwise."""
    bits = Config(grid.sides, name).feature_bits if features is None else features
    OpDecoder(grid, FORMATS[name], bits).draw(CLEAR + ops, page)

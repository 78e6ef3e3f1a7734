"""Division of LEDs among universes of 512 slots. No LED is in two universes.

Must not know packets.
"""

from __future__ import annotations

from typing import Final

from voxdisplay.sinks.packet_rows import Chunk
from voxdisplay.sinks.settings import SinkSettings

SLOTS: Final = 512


def plan_universes(settings: SinkSettings, least: int, most: int) -> tuple[list[int], list[Chunk]]:
    """Return the universes of a cube, and which of its bytes each one carries.

    Parameters
    ----------
    settings : SinkSettings
    least, most : int
        Lowest and highest universe of the protocol.

    Returns
    -------
    universes : list of int
    chunks : list of Chunk
        Of slots: there is nothing behind the last LED.

    Raises
    ------
    ValueError
        If there are not so many universes, or too few slots behind the address.

    """
    width = settings.bytes_per_led
    room = SLOTS // width
    pixels = room if settings.pixels is None else settings.pixels
    if pixels > room:
        raise ValueError(f"pixels: a universe has room for {room} LEDs of {width} bytes")
    lead = settings.address - 1
    first = min(pixels, (SLOTS - lead) // width, settings.leds)
    if first < 1:
        raise ValueError(f"address: behind {settings.address} there is no room for an LED")
    chunks = [Chunk(lead, first * width, lead + first * width)]
    for begin in range(first, settings.leds, pixels):
        size = min(pixels, settings.leds - begin) * width
        chunks.append(Chunk(0, size, size))
    return _number_universes(settings.universe or (least,), len(chunks), least, most), chunks


def _number_universes(named: tuple[int, ...], count: int, least: int, most: int) -> list[int]:
    universes = list(named[:count])
    universes += range(universes[-1] + 1, universes[-1] + 1 + count - len(universes))
    for number in universes:
        if not least <= number <= most:
            raise ValueError(
                f"universe: {count} are needed, and {number} is not from {least} to {most}"
            )
    if len(set(universes)) != count:
        raise ValueError(f"universe: {count} are needed, and those behind the last are in use")
    return universes

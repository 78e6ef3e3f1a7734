"""Fades: pens that change from voxel to voxel, FADE and RAMP (protocol.md, section 7.9).

Must not know curves, nor what a chain is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.color import blend
from voxdisplay.raster.display_list import DrawnVoxels, Spread
from voxdisplay.raster.pixel_format import PixelFormat, Values
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig, Ints

# Pens from here on stand for a place of a spread: (number of the spread + 1) << 32 | place.
FADED = 1 << 32
_SPREAD_BITS = 32
# Bytes by which a run of one pen costs more than a step: its op, and a partly filled byte.
_RUN_BYTES = 2


def leb128(number: int) -> bytes:
    """Return a number in its shortest form: section 7.2."""
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes((*out, number))


def spread_values(spread: Spread, places: NDArray[np.integer], format_: PixelFormat) -> Values:
    """Return the pixel values, (n,), that a spread has at places, (n,)."""
    blended = blend(spread.stops, spread.count, places)
    if format_ is PixelFormat.INDEX8:
        return blended[:, 0].astype(np.uint32)
    return format_.nearest(blended)


def fade_op(spread: Spread, place: int) -> bytes:
    """Return the op FADE that begins at a place of a spread."""
    stops = spread.stops
    head = bytes((spec.OP_FADE, len(stops) - 1))
    return head + leb128(spread.count - 1) + leb128(place) + stops.tobytes()


def faded_op(pen: int, spreads: Sequence[Spread]) -> bytes:
    """Return the op FADE that sets a pen of `FADED` or above."""
    return fade_op(*spread_at(pen, spreads))


def spread_at(pen: int, spreads: Sequence[Spread]) -> tuple[Spread, int]:
    """Return the spread and the place of a pen of `FADED` or above."""
    return spreads[(pen >> _SPREAD_BITS) - 1], pen & FADED - 1


def fade_op_bytes(pens: Ints, spreads: Sequence[Spread]) -> Ints:
    """Return the bytes of the ops of `faded_op`, (n,); of pens below `FADED`, anything."""
    heads = np.array([len(fade_op(spread, 0)) for spread in spreads], dtype=np.int64)
    place = pens & FADED - 1
    longer = (place >= 1 << 7).astype(np.int64) + (place >= 1 << 14)
    return np.asarray(heads[np.maximum((pens >> _SPREAD_BITS) - 1, 0)] + longer)


def _can_fade(
    spread: Spread | None, config: EncoderConfig, most_stops: int, most_voxels: int
) -> bool:
    """Return whether FADE takes a spread, and leaves room for a chain in a payload."""
    if spread is None or spread.count > most_voxels or len(spread.stops) > most_stops:
        return False
    return len(fade_op(spread, spread.count - 1)) <= config.max_payload // 2


@dataclass(frozen=True)
class FadedRows:
    """Voxels that are drawn under a fade.

    Attributes
    ----------
    pens : (n,) int64 array
        As of `OpBlocks`: pixel values, or places of spreads.
    spreads : tuple of Spread
    op_bytes : int
        Bytes of the longest FADE.

    """

    pens: Ints
    spreads: tuple[Spread, ...]
    op_bytes: int

    @classmethod
    def of(
        cls,
        drawn: DrawnVoxels,
        config: EncoderConfig,
        *,
        feature: int = spec.FEATURE_FADE,
        most_stops: int = spec.LIMIT_MAX_COLORS,
        most_voxels: int = spec.LIMIT_MAX_FADE,
    ) -> FadedRows | None:
        """Return which voxels take fewer bytes under a fade; None if none does.

        Parameters
        ----------
        drawn : DrawnVoxels
        config : EncoderConfig
        feature : int
            The feature without which there are no fades.
        most_stops, most_voxels : int
            Limits of a fade.

        """
        places = drawn.places
        if places is None or not config.has(feature):
            return None
        number = np.full(len(drawn.kinds), -1, dtype=np.int64)
        spreads: list[Spread] = []
        for item, spread in enumerate(drawn.spreads):
            if spread is not None and _can_fade(spread, config, most_stops, most_voxels):
                number[item] = len(spreads)
                spreads.append(spread)
        number = number[drawn.item]
        fits = number >= 0
        for each, spread in enumerate(spreads):
            rows = np.flatnonzero(number == each)
            values = spread_values(spread, places[rows], config.format)
            fits[rows] = values == drawn.values[rows]
        pens = np.where(fits, (number + 1) << _SPREAD_BITS | places, drawn.values)
        begins = np.append(True, pens[1:] != pens[:-1] + 1) | ~fits
        run = np.cumsum(begins) - 1
        changes = np.append(False, drawn.values[1:] != drawn.values[:-1]) & ~begins
        saved = np.bincount(run, changes) * (config.pen_bytes + _RUN_BYTES)
        pays = fits[begins] & (saved > fade_op_bytes(pens[begins], spreads)) if spreads else fits
        if not pays.any():
            return None
        pens = np.where(pays[run], pens, drawn.values)
        return cls(pens, tuple(spreads), int(fade_op_bytes(pens, spreads).max()))


def runs_of_pens(pens: Ints) -> Ints:
    """Return numbers that are equal where voxels, (n,), in a row need no op for the pen."""
    return np.where(pens >= FADED, pens - np.arange(len(pens)), pens)


_NONE = Spread(np.zeros((1, 3), dtype=np.uint8), 1)


class FadedPens:
    """Pens of the fade of a packet, for a decoder that notes ops and draws them later.

    What an op writes in a row is noted as a code below 0, of which `values_of` makes pens.
    """

    def __init__(self, format_: PixelFormat) -> None:
        self._format = format_
        self._spread = _NONE
        self._place = 0
        self._row_end = False  # whether the fade has written the voxel at the cursor
        self._pens: list[Values] = []
        self._noted = 0

    @property
    def active(self) -> bool:
        """True if there is a fade."""
        return self._spread is not _NONE

    @property
    def pen(self) -> int:
        """Pixel value of the place; there is a fade."""
        return int(self._values(self._place, 1)[0])

    def begin(self, spread: Spread, place: int) -> None:
        """Begin a fade."""
        self._spread, self._place, self._row_end = spread, place, False

    def end(self) -> None:
        """End the fade, if there is one."""
        self._spread = _NONE

    def leave(self) -> None:
        """Note that an op which the fade does not count sets the cursor."""
        self._row_end = False

    def row(self, count: int, *, again: bool) -> int:
        """Count voxels of an op, n >= 1, and return the code of their pens.

        ``again`` is true if the op begins at the cursor.
        """
        begin = self._place - (again and self._row_end)
        code = -1 - self._noted
        self._pens.append(self._values(begin, count))
        self._noted += count
        self._place = min(begin + count, self._spread.count)
        self._row_end = True
        return code

    def _values(self, begin: int, count: int) -> Values:
        places = np.minimum(np.arange(begin, begin + count), self._spread.count - 1)
        return spread_values(self._spread, places, self._format)

    def values_of(self, op: Ints, pens: Ints) -> Ints:
        """Return pixel values, (n,), of voxels, with codes replaced.

        Parameters
        ----------
        op, pens : (n,) int64 arrays
            Number of the op of each voxel, those of one op one after another; and its pixel value
            or code.

        """
        coded = pens < 0
        if not coded.any():
            return pens
        row = np.arange(len(op))
        begins = np.append(True, op[1:] != op[:-1])
        nth = row - np.maximum.accumulate(np.where(begins, row, 0))
        pens = pens.copy()
        noted = np.concatenate(self._pens).astype(np.int64)
        pens[coded] = noted[-1 - pens[coded] + nth[coded]]
        return pens

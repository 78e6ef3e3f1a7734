"""What a display shows against what was meant: words for both outcomes. Knows no display."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WRONG_TWICE_HINT = "the device does not draw what protocol.md says, or its memory is faulty"


@dataclass(frozen=True, slots=True)
class Receipt:
    """What it took to show a frame.

    Attributes
    ----------
    frame : int
        Number of the frame on this display handle, from 1.
    voxels : int
        Lit voxels.
    packets, retransmitted : int
        DATA packets, and how many had to be sent again.
    wire_bytes : int
        All bytes sent.
    elapsed_s : float
        From handing the frame over to the device's word that it is on display.
    digest : int or None
        What the device says it shows; it has been compared. None if the device gives none.
    repaired : str or None
        What the display showed at first, if that was something else and the frame was sent again.

    """

    frame: int
    voxels: int
    packets: int
    wire_bytes: int
    retransmitted: int
    elapsed_s: float
    digest: int | None
    repaired: str | None = None


def describe_wrong_digest(digest: int, meant: int) -> str:
    """Say that two digests differ, in one line."""
    return f"the display's digest is {digest:08x}, the frame's {meant:08x}"


def describe_difference(meant: NDArray[np.generic], got: NDArray[np.generic]) -> str:
    """Say where two arrays [z, y, x] differ, in one line; nothing if they do not."""
    differs = meant != got
    if differs.ndim == 4:
        differs = differs.any(axis=-1)
    places = np.argwhere(differs)
    if len(places) == 0:
        return ""
    z, y, x = places[0].tolist()
    return (
        f"{len(places)} voxels differ, the first at ({x}, {y}, {z}): "
        f"{got[z, y, x]} instead of {meant[z, y, x]}"
    )

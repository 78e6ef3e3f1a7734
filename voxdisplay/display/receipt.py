"""Receipt of a displayed frame, and the description of one that is displayed wrongly.

Must not know the display.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WRONG_TWICE_HINT = "the device does not draw as protocol.md requires, or its memory is faulty"


@dataclass(frozen=True, slots=True, repr=False)
class Receipt:
    """Figures of one frame that is displayed: time, bytes, packets, and the proof.

    Attributes
    ----------
    frame : int
        Number of the frame on this display handle, from 1.
    voxels : int
        Lit voxels.
    packets, retransmitted : int
        DATA packets, and retransmissions of them.
    wire_bytes : int
        All bytes sent.
    elapsed_s : float
        From the call of `Display.present` to the device's report that the frame is displayed.
    digest : int or None
        The device's digest of what it displays, which has been compared. None if it has none.
    repaired : str or None
        What the display showed at first, if that was wrong and the frame was sent again.

    """

    frame: int
    voxels: int
    packets: int
    wire_bytes: int
    retransmitted: int
    elapsed_s: float
    digest: int | None
    repaired: str | None = None

    def __repr__(self) -> str:
        """Return it in one line: ``<Receipt of frame 3: 168 voxels, 412 bytes, 12.3 ms, ...>``."""
        parts = [count_noun(self.voxels, "voxel")]
        parts += [f"{count_noun(self.wire_bytes, 'byte')} in {count_noun(self.packets, 'packet')}"]
        parts += [f"{1000 * self.elapsed_s:.1f} ms"]
        parts += [f"{self.retransmitted} retransmitted"] if self.retransmitted else []
        parts += ["no digest" if self.digest is None else f"digest {self.digest:08x}"]
        parts += ["repaired"] if self.repaired else []
        return f"<Receipt of frame {self.frame}: {', '.join(parts)}>"


def count_noun(count: int, noun: str) -> str:
    """Return a count with its noun: "1 voxel", "2 voxels"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def describe_wrong_digest(digest: int, expected: int) -> str:
    """Return a line that names two digests which differ."""
    return f"the display's digest is {digest:08x}, the frame's {expected:08x}"


def describe_difference(expected: NDArray[np.generic], found: NDArray[np.generic]) -> str:
    """Return a line on where two arrays [z, y, x] differ; an empty one if they do not."""
    differs = expected != found
    if differs.ndim == 4:
        differs = differs.any(axis=-1)
    places = np.argwhere(differs)
    if len(places) == 0:
        return ""
    z, y, x = places[0].tolist()
    return (
        f"{len(places)} voxels differ, the first at ({x}, {y}, {z}): "
        f"{found[z, y, x]} instead of {expected[z, y, x]}"
    )

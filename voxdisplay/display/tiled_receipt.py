"""Receipt of a frame on a display that is made of several, and the state of its parts.

Must not know threads or sessions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from voxdisplay.display.part_profile import PartProfile
from voxdisplay.display.receipt import Receipt


@dataclass(frozen=True, slots=True, repr=False)
class PartReceipt:
    """What became of a frame on one part.

    Attributes
    ----------
    name, port : str
        Of the part.
    receipt : Receipt or None
        None if the part is lost.
    lost : str or None
        Why.

    """

    name: str
    port: str
    receipt: Receipt | None
    lost: str | None = None

    def __repr__(self) -> str:
        """Return it in one line."""
        return f"<{self.name}: {self.receipt or f'lost: {self.lost}'}>"


@dataclass(frozen=True, slots=True, repr=False)
class TiledReceipt(Receipt):
    """Receipt of a frame that several displays show together: sums over them.

    Attributes
    ----------
    digest : int or None
        Digest of the whole frame, if every part has proved its share of it; else None.
    parts : tuple of PartReceipt
    skew_s : float
        Time between the first and the last report that a part displays it.

    """

    parts: tuple[PartReceipt, ...] = ()
    skew_s: float = 0.0

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the parts that do not show the frame."""
        return tuple(part.name for part in self.parts if part.receipt is None)


@dataclass(frozen=True, slots=True)
class PartState:
    """One part of an open display.

    Attributes
    ----------
    profile : PartProfile
    port : str
        Where it is now.
    serial : str
        Serial number of its device; empty without one.
    state : {"open", "away", "lost"}
        Away: gone, and waited for.
    reason : str or None
        Why it is lost.
    reconnects : int
        How often it was gone and has come back.

    """

    profile: PartProfile
    port: str
    serial: str
    state: str
    reason: str | None
    reconnects: int

    def as_json(self) -> dict[str, Any]:
        """Return it as a JSON object."""
        return {
            "name": self.profile.name,
            "port": self.port,
            "serial": self.serial,
            "at": list(self.profile.at),
            "size": list(self.profile.size),
            "axes": self.profile.axes.names,
            "state": self.state,
            "reason": self.reason,
            "reconnects": self.reconnects,
        }


def sum_receipts(
    parts: Sequence[PartReceipt], *, frame: int, elapsed_s: float, digest: int, skew_s: float
) -> TiledReceipt:
    """Return one receipt for all parts.

    Parameters
    ----------
    parts : sequence of PartReceipt
    frame : int
        Number of the frame.
    elapsed_s : float
    digest : int
        That of the whole frame, which counts if all parts have proved their shares.
    skew_s : float

    """
    shown = [part.receipt for part in parts if part.receipt is not None]
    proved = len(shown) == len(parts) and all(each.digest is not None for each in shown)
    repaired = [
        f"{part.name}: {part.receipt.repaired}"
        for part in parts
        if part.receipt is not None and part.receipt.repaired
    ]
    return TiledReceipt(
        frame=frame,
        voxels=sum(each.voxels for each in shown),
        packets=sum(each.packets for each in shown),
        wire_bytes=sum(each.wire_bytes for each in shown),
        retransmitted=sum(each.retransmitted for each in shown),
        elapsed_s=elapsed_s,
        digest=digest if proved else None,
        repaired="; ".join(repaired) or None,
        parts=tuple(parts),
        skew_s=skew_s,
    )

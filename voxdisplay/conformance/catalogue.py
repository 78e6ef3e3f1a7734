"""The list of checks: what a check is, and what it needs of a device.

A check is a function of a `Probe` under the decorator `check`, which says the section of
protocol.md, the check's name and, in few words, what the document demands there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from voxdisplay.conformance.announced import Said

if TYPE_CHECKING:
    from voxdisplay.conformance.probe import Probe

Body = Callable[["Probe"], None]
Need = Callable[[Said], str]


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that the document demands of a device.

    Attributes
    ----------
    section, name : str
        Together they are its ``id``, as ``7.3/line-ties``.
    demands : str
        What the document says, in short.
    needs : tuple of callable
        Each takes a `Said` and gives why the check does not concern such a device, or ``""``.
    run : callable
        Takes a `Probe`; raises `Broken` if the device does otherwise.
    """

    section: str
    name: str
    demands: str
    needs: tuple[Need, ...]
    run: Body

    @property
    def id(self) -> str:
        """Section and name."""
        return f"{self.section}/{self.name}"

    @property
    def order(self) -> tuple[int, ...]:
        """Its section as numbers, by which checks are listed."""
        return tuple(map(int, self.section.split(".")))

    def matches(self, pattern: str) -> bool:
        """Tell whether a pattern names it: ``7``, ``7.3``, ``7.3/line-ties``, ``line-*``."""
        inner = f"{self.section}/".startswith((f"{pattern}/", f"{pattern}."))
        return inner or fnmatchcase(self.id, pattern) or fnmatchcase(self.name, pattern)

    def obstacle(self, said: Said) -> str:
        """Say why it does not concern a device; ``""`` if it does."""
        return next((reason for need in self.needs if (reason := need(said))), "")


CHECKS: list[Check] = []
SECTIONS = {
    "2": "scan order",
    "2.1": "pixel formats",
    "3": "delimiting",
    "4": "packets",
    "5": "HELLO and INFO",
    "6": "frames and pages",
    "7": "ops",
    "7.1": "chains",
    "7.2": "counts",
    "7.3": "shapes",
    "7.4": "bricks",
    "7.5": "differences",
    "7.6": "the palette",
    "7.7": "range-coded chains",
    "7.8": "the grid's edges",
    "8": "the digest",
    "9": "ACK",
    "9.1": "the window",
    "9.2": "credit",
    "10": "READ and PAGE",
    "11": "ERROR",
    "12": "malformed input",
}


def check(section: str, name: str, demands: str, *needs: Need) -> Callable[[Body], Body]:
    """Put a function on the list."""

    def enlist(run: Body) -> Body:
        CHECKS.append(Check(section, name, demands, needs, run))
        return run

    return enlist


# -- what a check may need


def feature(name: str) -> Need:
    """Need a feature that is announced."""
    return lambda said: "" if said.has(name) else f"{name} is not announced"


def without(name: str) -> Need:
    """Need a feature that is not announced."""
    return lambda said: f"{name} is announced" if said.has(name) else ""


def formats(*values: int) -> Need:
    """Need one of some pixel formats."""
    return lambda said: "" if said.format in values else "of another pixel format"


def voxels(count: int) -> Need:
    """Need a grid of so many voxels."""
    return lambda said: "" if said.voxels >= count else f"the grid has fewer than {count} voxels"


def seen(said: Said) -> str:
    """Need to find out what is on display."""
    return "" if said.is_seen else "neither READ nor DIGEST is announced: pictures cannot be seen"


def ticking(said: Said) -> str:
    """Need a refresh tick."""
    return "" if said.refresh else "swaps happen at once"


def at_once(said: Said) -> str:
    """Need swaps that happen at once."""
    return "swaps wait for a tick" if said.refresh else ""

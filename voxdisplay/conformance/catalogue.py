"""The list of checks: what a check is, and what it needs of a device.

A check is a function of a `Probe` under the decorator `check`, which says the section of
protocol.md, the check's name and, in few words, what the document demands there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from voxdisplay.conformance.announced_device import AnnouncedDevice

if TYPE_CHECKING:
    from voxdisplay.conformance.probe import Probe

Body = Callable[["Probe"], None]
Precondition = Callable[[AnnouncedDevice], str]


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that the document demands of a device.

    Attributes
    ----------
    section, name : str
        Together they are its ``id``, as ``7.3/line-ties``.
    requirement : str
        What the document says, in short.
    preconditions : tuple of callable
        Each takes an `AnnouncedDevice` and returns why the check does not apply to it, or ``""``.
    run : callable
        Takes a `Probe`; raises `Violation` if the device does otherwise.
    """

    section: str
    name: str
    requirement: str
    preconditions: tuple[Precondition, ...]
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

    def not_applicable_reason(self, device: AnnouncedDevice) -> str:
        """Say why it does not concern a device; ``""`` if it does."""
        return next((reason for need in self.preconditions if (reason := need(device))), "")


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


def check(section: str, name: str, demands: str, *needs: Precondition) -> Callable[[Body], Body]:
    """Put a function on the list."""

    def enlist(run: Body) -> Body:
        CHECKS.append(Check(section, name, demands, needs, run))
        return run

    return enlist


# -- what a check may need


def feature(name: str) -> Precondition:
    """Need a feature that is announced."""
    return lambda device: "" if device.has(name) else f"{name} is not announced"


def without_feature(name: str) -> Precondition:
    """Need a feature that is not announced."""
    return lambda device: f"{name} is announced" if device.has(name) else ""


def pixel_formats(*values: int) -> Precondition:
    """Need one of some pixel formats."""
    return lambda device: "" if device.format in values else "of another pixel format"


def min_voxels(count: int) -> Precondition:
    """Need a grid of so many voxels."""
    return lambda device: (
        "" if device.voxel_count >= count else f"the grid has fewer than {count} voxels"
    )


def readable_display(device: AnnouncedDevice) -> str:
    """Need to find out what is on display."""
    return (
        ""
        if device.is_readable
        else "neither READ nor DIGEST is announced: pictures cannot be seen"
    )


def refresh_tick(device: AnnouncedDevice) -> str:
    """Need a refresh tick."""
    return "" if device.refresh else "swaps happen at once"


def immediate_swap(device: AnnouncedDevice) -> str:
    """Need swaps that happen at once."""
    return "swaps wait for a tick" if device.refresh else ""

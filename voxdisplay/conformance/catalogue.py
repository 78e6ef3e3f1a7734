"""Registry of checks, and the preconditions that a device must meet for a check to apply.

A check is a function of a `Probe` under the decorator `check`, which takes the section of
protocol.md, the check's name and the requirement in one phrase.
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
    """One requirement of the document, and the function that checks it.

    Attributes
    ----------
    section, name : str
        Together they are the ``id``, such as ``7.3/line-ties``.
    requirement : str
        The requirement in one phrase.
    preconditions : tuple of callable
        Each takes an `AnnouncedDevice` and returns why the check does not apply to it, or ``""``.
    run : callable
        Takes a `Probe`; raises `Violation` if the device does not meet the requirement.
    """

    section: str
    name: str
    requirement: str
    preconditions: tuple[Precondition, ...]
    run: Body

    @property
    def id(self) -> str:
        """Identifier: section and name."""
        return f"{self.section}/{self.name}"

    @property
    def order(self) -> tuple[int, ...]:
        """Section as a tuple of numbers: the sort key of listings."""
        return tuple(map(int, self.section.split(".")))

    def matches(self, pattern: str) -> bool:
        """Return whether a pattern selects it: ``7``, ``7.3``, ``7.3/line-ties``, ``line-*``."""
        inner = f"{self.section}/".startswith((f"{pattern}/", f"{pattern}."))
        return inner or fnmatchcase(self.id, pattern) or fnmatchcase(self.name, pattern)

    def __reduce__(self) -> tuple[Callable[[str], Check], tuple[str]]:
        """Pickle by id: the functions of a check need not, and cannot all, be pickled."""
        return find_check, (self.id,)

    def not_applicable_reason(self, device: AnnouncedDevice) -> str:
        """Return why the check does not apply to a device; ``""`` if it does."""
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
    "7.9": "fades",
    "7.10": "more range-coded chains",
    "7.11": "range-coded slabs",
    "7.12": "holds",
    "7.13": "range-coded pixels",
    "8": "the digest",
    "9": "ACK",
    "9.1": "the window",
    "9.2": "credit",
    "10": "READ and PAGE",
    "11": "ERROR",
    "12": "malformed input",
}


def check(
    section: str, name: str, requirement: str, *preconditions: Precondition
) -> Callable[[Body], Body]:
    """Return a decorator that registers a function as a check."""

    def register(run: Body) -> Body:
        CHECKS.append(Check(section, name, requirement, preconditions, run))
        return run

    return register


def _run_by_handshake(probe: Probe) -> None:
    del probe


# Run as the handshake before all others, not by itself.
HANDSHAKE = Check("5", "answers", "the response to HELLO is INFO", (), _run_by_handshake)


def find_check(name: str) -> Check:
    """Return the check with an id.

    Raises
    ------
    KeyError
        If there is none.
    """
    for each in (HANDSHAKE, *CHECKS):
        if each.id == name:
            return each
    raise KeyError(name)


# -- preconditions: functions of a device that return why a check does not apply to it, or ""


def feature(name: str) -> Precondition:
    """Return the precondition that a feature is announced."""
    return lambda device: "" if device.has(name) else f"{name} is not announced"


def without_feature(name: str) -> Precondition:
    """Return the precondition that a feature is not announced."""
    return lambda device: f"{name} is announced" if device.has(name) else ""


def pixel_formats(*values: int) -> Precondition:
    """Return the precondition that the pixel format is one of these."""
    return lambda device: "" if device.format in values else "the pixel format is another one"


def min_voxels(count: int) -> Precondition:
    """Return the precondition that the grid has at least ``count`` voxels."""
    return lambda device: (
        "" if device.voxel_count >= count else f"the grid has fewer than {count} voxels"
    )


def readable_display(device: AnnouncedDevice) -> str:
    """Require that what is on display can be verified."""
    if device.is_readable:
        return ""
    return "neither READ nor DIGEST is announced: what is on display cannot be verified"


def refresh_tick(device: AnnouncedDevice) -> str:
    """Require that swaps wait for a refresh tick."""
    return "" if device.refresh else "swaps happen at once"


def immediate_swap(device: AnnouncedDevice) -> str:
    """Require that swaps happen at once."""
    return "swaps wait for a tick" if device.refresh else ""

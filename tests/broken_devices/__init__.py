"""Devices that break protocol.md in one place each, derived from the emulator, by section.

Each has the name of its fault, a function that makes it, and the checks that must fail: all of
them, and no others.
"""

from broken_devices import (  # noqa: F401 - each registers its own
    acks,
    digests,
    fades,
    frames,
    handshake,
    holds,
    noise,
    ops,
    packets,
    planted,
    range_coded_chains,
    range_coded_slabs,
    range_coded_values,
    reads,
    refusals,
    second_chains,
    shapes,
)
from broken_devices.mutant import MUTANTS as MUTANTS

# Random checks find what others find, too: no fault is found by them alone.
UNPROVEN = {"7/random-ops", "11/random-ops"}

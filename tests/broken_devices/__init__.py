"""Devices that break protocol.md in one place each, made of the emulator, chapter by chapter.

Each has the name of its fault, how to make it, and the checks that must notice: all of them, and
no other, may fail.
"""

from broken_devices import (  # noqa: F401 - each enlists its own
    acks,
    digests,
    frames,
    handshake,
    noise,
    ops,
    packets,
    range_coded_chains,
    reads,
    refusals,
    shapes,
)
from broken_devices.mutant import MUTANTS as MUTANTS

# What is drawn at random finds what the others find: no fault is its own.
UNPROVEN = {"7/random-ops", "11/random-ops"}

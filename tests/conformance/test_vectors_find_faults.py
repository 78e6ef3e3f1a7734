"""The vectors of protocol.md find every fault of the broken devices: no other test is needed.

Faults that no vector can show stand here, with the reason.
"""

from __future__ import annotations

import broken_devices
import document
import pytest
from vector_device import hold_dialogue, hold_ops, hold_refused

HOLD = {"dialogue": hold_dialogue, "ops": hold_ops, "refused": hold_refused}
VECTORS = [vector for kind in HOLD for vector in document.vectors(kind)]

HIDDEN = {
    "window-ends-at-255": "takes 256 packets",
    "ids-wrap-at-255": "takes 256 frames",
    "credit-lapses": "takes time",
    "session-lapses": "takes time",
    "holds-without-ticks": "is another configuration of the emulator",
    "credit-of-twice-the-ring": "is another configuration of the emulator",
    "page-too-long": "how much of a READ a PAGE covers is the device's choice",
    "page-count-of-the-read": "how much of a READ a PAGE covers is the device's choice",
    "arc-runs-without-end": "takes a straight piece of more than 255 steps",
}


def first_found_by() -> document.Vector | None:
    """Return the first vector that the device does not hold; None if it holds all."""
    for vector in VECTORS:
        try:
            HOLD[vector.kind](vector)
        except Exception:  # noqa: BLE001 - a broken device may fail in any way
            return vector
    return None


def test_the_whole_device_holds_all_vectors():
    assert first_found_by() is None


@pytest.mark.parametrize("fault", broken_devices.MUTANTS, ids=str)
def test_a_fault_is_found(fault, monkeypatch):
    fault.make(monkeypatch)
    assert (first_found_by() is None) == (str(fault) in HIDDEN)

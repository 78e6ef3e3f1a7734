"""Faults planted in the reference device in C: a vector and a check of the kit find each.

Behind a terminal and with a clock of its own, the device shows what the emulated ones cannot: that
checks which depend on the tick's phase find their fault on a real line, too.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import c_device
import document
import pytest
from c_device import HELLO, TerminalDevice, all_features, build, device_of

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

SESSION, RING, DECLARATIONS = "session.c", "ring.c", "internal.h"
USED, OVERRUN = "uint32_t ring_used(void)", "bool ring_overrun(void)"
CLEAR = "vxd_clear();\n    vxd_show();\n   "
COUNT = "me.damaged++;\n   "
LOSS = "send_error(OVERRUN);"


@dataclass(frozen=True)
class Fault:
    """A fault: the vector and the check that find it, and (file, text, text instead)."""

    name: str
    vector: str
    check: str
    edits: tuple[tuple[str, str, str], ...]


FAULTS = (
    Fault(
        "credit-is-what-is-free-now",
        "waits-for-the-tick",
        "9.2/answers-credit",
        (
            (SESSION, "put_u32(12, VXD_RING)", "put_u32(12, VXD_RING - ring_used())"),
            (DECLARATIONS, "void ring_reset(void);", f"{USED};\nvoid ring_reset(void);"),
            (RING, OVERRUN, f"{USED}\n{{ return ring.head - ring.tail; }}\n\n{OVERRUN}"),
        ),
    ),
    Fault(
        "swaps-at-once-in-spite-of-the-refresh",
        "draw-and-prove",
        "6/swaps-at-a-tick",
        (
            (
                SESSION,
                "if (me.self->refresh == 0) {\n                swap",
                "if (true) {\n                swap",
            ),
        ),
    ),
    Fault(
        "hello-clears-the-page-and-keeps-the-digest",
        "shown-after-a-second-hello",
        "5/front-page-stays",
        ((SESSION, "    send_info(asked);", f"{CLEAR} send_info(asked);"),),
    ),
    Fault(
        "a-duplicate-waits",
        "pending-and-not-waiting",
        "9.1/duplicate-while-pending",
        ((SESSION, " && !is_duplicate();", ";"),),
    ),
    Fault(
        "a-flag-is-checked-while-pending",
        "waits-with-a-reserved-flag",
        "6/waits-unchecked",
        ((SESSION, " && !is_duplicate();", " && !(packet[0] & 10U) && !is_duplicate();"),),
    ),
    Fault(
        "a-number-is-checked-while-pending",
        "waits-outside-the-window",
        "6/waits-unchecked",
        ((SESSION, " && !is_duplicate();", " && numbers_ahead() < 32U && !is_duplicate();"),),
    ),
    Fault(
        "clear-is-not-compared",
        "clear-differs",
        "6/clear-flag-differs",
        ((SESSION, "if ((flags & CLEAR) != me.frame_clear) {", "if (false) {"),),
    ),
    Fault(
        "damage-is-answered-without-a-session",
        "damage-without-a-session",
        "9/damage-unanswered",
        ((SESSION, f"{COUNT} if (me.session != 0) {{", f"{COUNT} if (true) {{"),),
    ),
    Fault(
        "lost-bytes-are-no-damage",
        "more-than-credit",
        "11/overrun",
        ((SESSION, f"{LOSS}\n        note_damage();", LOSS),),
    ),
)


FADES, CHAINS, SLABS = "fades.c", "range_coded_chains.c", "range_coded_slabs.c"
NEXT = "write_next"
FAULTS_OF_OPS = (
    Fault(
        "the-first-voxel-of-a-chain-counts-again",
        "fade-along-a-chain",
        "7.9/fade-goes-on",
        ((FADES, "if (d->fading && d->joined) {", "if (false) {"),),
    ),
    Fault(
        "slabs-learn-as-chains-do",
        "slabs-shell",
        "7.11/slabs-surfaces",
        ((SLABS, "{1, 1, 1, 2, 2, 2, 3}", "{1, 1, 2, 2, 3, 3, 4}"),),
    ),
    Fault(
        "slabs-see-nothing-under-their-cells",
        "slabs-shell",
        "7.11/slabs-surfaces",
        ((SLABS, "    look_under(box.slices[1], w, h);", "    (void)look_under;"),),
    ),
    Fault(
        "a-near-start-is-near-the-origin",
        "arc2-near-starts",
        "7.10/arc2-starts",
        ((CHAINS, "*morton += number(", "*morton = number("),),
    ),
    Fault(
        "chains-stay-at-one-place-of-a-fade",
        "arc2-fade-that-goes-on",
        "7.10/arc2-fades",
        ((CHAINS, f"if (second) {{\n        {NEXT}", f"if (second && false) {{\n        {NEXT}"),),
    ),
)
MORE_FAULTS_OF_OPS = (
    Fault(
        "fades-round-down",
        "fade-along-a-chain",
        "7.9/fade-rounding",
        ((FADES, " + b->span) / (2U", ") / (2U"),),
    ),
    Fault(
        "slabs-of-any-number-of-cells",
        "slabs-of-too-many-cells",
        "7.11/slabs-too-many-cells",
        ((SLABS, "if (w * h > cells_left) {", "if (false) {"),),
    ),
    Fault(
        "a-box-goes-on-from-the-box-before",
        "slabs-two-boxes",
        "7.11/slabs-boxes",
        ((SLABS, "        memset(&box, 0, sizeof box);\n", ""),),
    ),
    Fault(
        "indices-of-more-than-30-bits",
        "arc2-beyond-all-grids",
        "7.10/arc2-outside",
        ((CHAINS, "if (*morton >> 30) {", "if (false) {"),),
    ),
)


def plant(fault: Fault, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `build` compile a copy of the firmware that has the fault."""
    shutil.copytree(c_device.FIRMWARE, folder / "firmware")
    for name, text, instead in fault.edits:
        source = folder / "firmware" / "core" / name
        before = source.read_text()
        assert before.count(text) == 1
        source.write_text(before.replace(text, instead))
    monkeypatch.setattr(c_device, "FIRMWARE", folder / "firmware")
    monkeypatch.setattr(c_device, "_built", {})
    monkeypatch.setattr(c_device, "_directory", SimpleNamespace(name=str(folder)))


def vector_of(fault: Fault, *kinds: str) -> document.Vector:
    every = (vector for kind in kinds for vector in document.vectors(kind))
    (vector,) = (each for each in every if each.name == fault.vector)
    return vector


def assert_the_kit_finds(fault: Fault, program: Path, refresh: float) -> None:
    with TerminalDevice(program, refresh=refresh) as port:
        words = ("conformance", "--port", port, "--no-reset", "--json", "--only", fault.check)
        done = subprocess.run(
            [sys.executable, "-m", "voxdisplay", *words],
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.returncode == 1, done.stderr
    (result,) = json.loads(done.stdout)["checks"]
    assert result["verdict"] == "broken"


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_found(fault: Fault, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plant(fault, tmp_path, monkeypatch)
    vector = vector_of(fault, "dialogue")
    with device_of(vector) as device, pytest.raises(AssertionError):
        document.hold_dialogue(vector.lines, device)
    assert_the_kit_finds(fault, build((3, 5, 7), "index8", all_features("index8")), 50)


@pytest.mark.parametrize(
    "fault",
    [
        *FAULTS_OF_OPS,
        *(pytest.param(fault, marks=pytest.mark.slow) for fault in MORE_FAULTS_OF_OPS),
    ],
    ids=lambda fault: fault.name,
)
def test_a_fault_of_an_op_is_found(
    fault: Fault, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(fault, tmp_path, monkeypatch)
    vector = vector_of(fault, "ops", "refused")
    with device_of(vector) as device:
        device.send(HELLO)
        (answer,) = device.send(bytes((0x15, 0, 0)) + vector.hex("ops"))
    if vector.kind == "ops":
        assert (answer[0], answer[16:20]) != (0x81, vector.integer("digest").to_bytes(4, "little"))
    else:
        code = document.literals()[f"CODE_{vector['code']}"]
        assert (answer[0], answer[3]) != (0xB0, code)
    assert_the_kit_finds(fault, build((19, 13, 11), "rgb888", all_features("rgb888")), 0)

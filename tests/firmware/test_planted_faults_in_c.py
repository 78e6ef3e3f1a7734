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
from c_device import TerminalDevice, all_features, build, device_of

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

SESSION, RING, DECLARATIONS = "session.c", "ring.c", "internal.h"
USED, OVERRUN = "uint32_t ring_used(void)", "bool ring_overrun(void)"
CLEAR = "vxd_clear();\n    vxd_show();\n   "
COUNT = "me.damaged++;\n   "
LOSS = "send_error(OVERRUN, 0, 0, 0);"


@dataclass(frozen=True)
class Fault:
    """A fault: the dialogue and the check that find it, and (file, text, text instead)."""

    name: str
    dialogue: str
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
        ((SESSION, "if (me.self->refresh == 0) {", "if (true) {"),),
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


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_found(fault: Fault, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(c_device.FIRMWARE, tmp_path / "firmware")
    for name, text, instead in fault.edits:
        source = tmp_path / "firmware" / "core" / name
        before = source.read_text()
        assert before.count(text) == 1
        source.write_text(before.replace(text, instead))
    monkeypatch.setattr(c_device, "FIRMWARE", tmp_path / "firmware")
    monkeypatch.setattr(c_device, "_built", {})
    monkeypatch.setattr(c_device, "_directory", SimpleNamespace(name=str(tmp_path)))

    (vector,) = (each for each in document.vectors("dialogue") if each.name == fault.dialogue)
    with device_of(vector) as device, pytest.raises(AssertionError):
        document.hold_dialogue(vector.lines, device)

    program = build((3, 5, 7), "index8", all_features("index8"))
    with TerminalDevice(program, refresh=50) as port:
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

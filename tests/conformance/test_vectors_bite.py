"""Mutation test of the literals: changing any of them must fail some vector of protocol.md.

`spec_mutations` changes each by one, in a process of its own, and names those that no vector holds.
They must stand here, with the reason.
"""

import subprocess
import sys
from pathlib import Path

import pytest

SPEC_MUTATIONS = Path(__file__).parents[1] / "spec_mutations.py"

# No byte on the wire depends on these: the referee compares them with the document.
RESERVED = {"FEATURE_SLABS", "FEATURE_VALUES", "FEATURE_ARC", "FEATURE_ARC2"}
MADE_OF_OTHERS = {"LAYOUT_HEADER", "CRC_WIDTH", "CRC_REFIN", "CRC_REFOUT", "CRC_CHECK"}
# The driver takes these for more voxels than a vector has: unit tests hold them.
CHOSEN = {
    "ARC2_MAX_SIDE",
    "OP_ARC2",
    "OP_LINE",
    "OP_BOX",
    "OP_DOTS",
    "OP_FADE",
    "OP_RAMP",
    "OP_HOLD",
    "FEATURE_FADE",
    "FEATURE_HOLD",
    "LIMIT_MAX_FADE",
}
OF_THE_OTHER_SIDE = {
    "driver": {"LIMIT_MAX_SILENT", "LIMIT_MAX_OCTANT", "LIMIT_MAX_SIDE"} | CHOSEN,
    "device": {"LIMIT_MAX_STATUS", "VERSION_MINOR"},  # a vector's device has features of 1.0
}
LIBRARY = {"CRC_POLY", "CRC_INIT", "CRC_XOROUT"}  # zlib has its own, and the vectors hold zlib
STRUCTS = {f"LAYOUT_{name}" for name in ("HELLO", "INFO", "ACK", "READ", "PAGE", "ERROR")}
# What a side does not do, or does not put up with: unit tests hold these.
BEHAVIOUR = {
    "LIMIT_WINDOW", "LIMIT_RESERVE", "LIMIT_MIN_PAYLOAD", "LIMIT_MAX_PAYLOAD", "LIMIT_MAX_VOXELS",
    "LIMIT_MAX_STEPS", "LIMIT_MAX_STATUS", "LIMIT_MAX_SIDE", "LIMIT_MAX_SILENT", "LIMIT_MAX_DOTS",
    "LIMIT_MAX_COLORS", "LIMIT_MAX_LEVEL", "LIMIT_MAX_HOLD", "LIMIT_MAX_HELD",
}  # fmt: skip
# Said to USB and not on the wire: the tests of USB hold these.
CARRIER = {f"USB_{n}" for n in ("CLASS", "SUBCLASS", "PROTOCOL", "TEST_VENDOR", "TEST_PRODUCT")}
# The models of ARC are told apart by these numbers; moved by one, they are still apart.
TOLD_APART = {
    f"ARC_{name}" for name in ("COUNT", "LONE", "TURN", "MAIN", "HISTORY", "RUNS", "MODELS")
}
TOLD_APART |= {f"ARC2_{name}" for name in ("NEAR", "FADE", "DELTA", "MODELS")}
TOLD_APART |= {f"SLABS_{name}" for name in ("FLAG", "FULL", "GROUP", "MODELS")}
TOLD_APART |= {
    f"VALUES_{name}" for name in ("COPY", "CHANNEL", "MODELS", "ZERO", "SIGN", "MAGNITUDE", "LONG")
}
# Seen 6 times or 7, a model learns as fast; curves are longer than a vector in tests of units only.
LONGER = {"SLABS_ENOUGH", "ARC_ENOUGH", "ARC_MAX_K", "ARC_MAX_RUN", "ARC2_MAX_DELTA"}
# The document has no vector for these yet.
AWAITED = {
    "driver": {"ARC_BEHIND"},  # of who reads
    "device": set(),
}


@pytest.mark.parametrize(
    ("side", "spec", "excused"),
    [
        ("driver", "voxdisplay.wire.spec", LIBRARY),
        ("device", "firmware_sim.spec", STRUCTS),
    ],
)
def test_a_literal_that_is_wrong_by_one_fails_some_vector(side, spec, excused):
    excused = excused | RESERVED | MADE_OF_OTHERS | BEHAVIOUR | CARRIER | TOLD_APART | LONGER
    excused |= OF_THE_OTHER_SIDE[side]
    done = subprocess.run(
        [sys.executable, SPEC_MUTATIONS, spec, *sorted(excused)],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) <= AWAITED[side]

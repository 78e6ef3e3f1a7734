"""Well-formedness of all responses received in the checks before."""

from __future__ import annotations

from voxdisplay.conformance import packets
from voxdisplay.conformance.catalogue import check
from voxdisplay.conformance.checks.readback import show_incompressible
from voxdisplay.conformance.packets import CLEAR, COMMIT, data, status
from voxdisplay.conformance.probe import Probe


def require_no_violation(probe: Probe, rule: str, must: str, likely: str = "") -> None:
    """Require that no response has broken a rule, after one exchange at least."""
    probe.poll_status()
    faults = probe.reader.violations.get(rule, [])
    probe.require(not faults, must, "; ".join(faults), likely)


@check("3", "answers-delimited", "everything the device sends is COBS-encoded as section 3 says")
def answers_delimited(probe: Probe) -> None:
    require_no_violation(
        probe, "delimited", "segments of COBS", "debug output may go to the same port"
    )


@check("4", "answers-checked", "everything the device sends has a valid check value")
def answers_checked(probe: Probe) -> None:
    require_no_violation(probe, "checked", "the CRC-32 of header and payload, lowest byte first")


@check(
    "4", "answers-whole", "everything the device sends is ACK, INFO, PAGE or ERROR, with all fields"
)
def answers_whole(probe: Probe) -> None:
    require_no_violation(probe, "whole", "a packet of a device's type, with all its fields")


@check("4", "answers-length", "no packet of the device is longer than max_payload allows")
def answers_length(probe: Probe) -> None:
    if probe.device.has("READ"):  # a longest answer at least
        probe.request_page(packets.read(0, show_incompressible(probe)))
    require_no_violation(probe, "length", f"at most {probe.device.max_payload} bytes of payload")


@check("4", "answers-reserved", "reserved flags and fields of responses are 0")
def answers_reserved(probe: Probe) -> None:
    require_no_violation(probe, "reserved", "0 in reserved flags and fields")


@check("9", "answers-boot", "the boot id in each ACK is that of INFO")
def answers_boot(probe: Probe) -> None:
    require_no_violation(probe, "boot", "the boot id of INFO until the device restarts")


@check("9", "answers-frame", "without SHOWN the frame of an ACK is 0")
def answers_frame(probe: Probe) -> None:
    require_no_violation(probe, "frame", "frame 0 without SHOWN")


@check("9", "answers-received", "`received` has no bit for a packet outside the window")
def answers_received(probe: Probe) -> None:
    require_no_violation(
        probe, "received", "bits 0 to 30 alone", "bit i stands for number next + 1 + i"
    )


@check("9", "answers-pending", "if refresh is 0, no frame is ever pending")
def answers_pending(probe: Probe) -> None:
    require_no_violation(probe, "pending", "no PENDING if refresh is 0")


@check("9.2", "answers-credit", "no ACK takes back what was granted, in whatever check")
def answers_credit(probe: Probe) -> None:
    probe.send_and_poll(data(0, 0, b"", CLEAR | COMMIT), data(1, 1), data(2, 1), status(1))
    require_no_violation(
        probe,
        "credit",
        "a limit, the end of the packet named by `last` plus `credit`, that never moves backwards",
        "credit counts from the end of that packet, whatever of it has arrived or waits for a tick",
    )


@check("8", "answers-digest", "without the feature DIGEST the digest of an ACK is 0")
def answers_digest(probe: Probe) -> None:
    require_no_violation(probe, "digest", "digest 0 without the feature")


@check("11", "answers-text", "the text of an ERROR is UTF-8")
def answers_text(probe: Probe) -> None:
    require_no_violation(probe, "text", "UTF-8")

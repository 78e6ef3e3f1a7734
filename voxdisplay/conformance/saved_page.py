"""The picture before the checks, read back so that it can be restored after them.

The ops of a PAGE are also ops of a DATA packet: behind a SKIP to their start they draw the same
pixels (sections 7 and 10). The palette cannot be read, so it is not restored.
"""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.conformance import ops, packets
from voxdisplay.conformance.dialogue import Violation
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_TIMEOUT_S = 20.0


@dataclass(frozen=True, slots=True)
class SavedPage:
    """A picture that was on display: payloads that draw it, and its digest."""

    payloads: tuple[bytes, ...]
    digest: int


def save_page(probe: Probe) -> SavedPage | None:
    """Read the front page; return None if it cannot be read, or not in time."""
    device = probe.device
    until_s = probe.clock() + _TIMEOUT_S
    payloads, at = [], 0
    try:
        probe.poll_status()
        if not device.has("READ") or probe.state.kind != spec.TYPE_ACK:
            return None
        digest = probe.state.digest
        while at < device.voxel_count:
            page = probe.request_page(packets.read(at, device.voxel_count - at))
            probe.decode_page(page, at, device.voxel_count - at)  # raises if it is malformed
            if probe.clock() > until_s:
                return None
            payloads.append(ops.skip(at) + page.tail)
            at += page.count
    except Violation:
        return None
    return SavedPage(tuple(payloads), digest)


def restore_page(probe: Probe, saved: SavedPage | None) -> str:
    """Present the saved page, or a dark one; return in words what is on display now."""
    try:
        probe.open_session()
        if saved:
            try:
                for number, payload in enumerate(saved.payloads, 1):
                    probe.draw(payload, commit=number == len(saved.payloads))
                ack = probe.await_shown(0, [probe.state])
            except Violation:
                probe.open_session()
            else:
                same = ack.digest == saved.digest
                return "as it was" if same else "as it was, but for the palette or the digest"
        probe.draw(b"", commit=True)
        probe.await_shown(0, [probe.state])
    except Violation:
        return "unknown: the device did not respond any more"
    return "dark"

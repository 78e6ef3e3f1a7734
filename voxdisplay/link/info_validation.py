"""Validation of INFO against protocol.md, sections 5, 9.2 and 14. Must not know sessions."""

from __future__ import annotations

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec


def check_info(info: packets.Info) -> None:
    """Raise `RemoteProtocolError`, naming the field, if an INFO has a value that is not allowed."""
    voxels = info.nx * info.ny * info.nz
    longest_bytes = packets.max_wire_bytes(info.max_payload + spec.LIMIT_OVERHEAD)
    invalid = {
        "nx, ny, nz": not 0 < voxels <= spec.LIMIT_MAX_VOXELS,
        "pages": info.pages < 2,
        "max_payload": info.max_payload < spec.LIMIT_MIN_PAYLOAD,
        "rx_buffer": info.rx_buffer < longest_bytes + spec.LIMIT_RESERVE,
    }
    for name, is_invalid in invalid.items():
        if is_invalid:
            raise RemoteProtocolError(
                f"INFO announces a value of {name} that is not allowed", section="5"
            )

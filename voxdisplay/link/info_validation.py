"""What an INFO may not say (protocol.md, sections 5, 9.2 and 14). Knows no session."""

from __future__ import annotations

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec


def check_info(info: packets.Info) -> None:
    """Refuse an INFO that contradicts protocol.md.

    Raises
    ------
    RemoteProtocolError
        Naming the field.

    """
    voxels = info.nx * info.ny * info.nz
    longest = packets.max_wire_bytes(info.max_payload + spec.LIMIT_OVERHEAD)
    wrong = {
        "nx, ny, nz": not 0 < voxels <= spec.LIMIT_MAX_VOXELS,
        "pages": info.pages < 2,
        "max_payload": info.max_payload < spec.LIMIT_MIN_PAYLOAD,
        "rx_buffer": info.rx_buffer < longest + spec.LIMIT_RESERVE,
    }
    for name, is_wrong in wrong.items():
        if is_wrong:
            raise RemoteProtocolError(
                f"INFO announces a value of {name} that is not allowed", section="5"
            )

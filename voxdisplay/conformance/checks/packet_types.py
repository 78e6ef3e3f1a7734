"""Checks of section 4: reserved types, flags and fields."""

from __future__ import annotations

from voxdisplay.conformance import packets
from voxdisplay.conformance.catalogue import check, feature
from voxdisplay.conformance.packets import BACK, CLEAR, COMMIT, body, data
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

HOST_TYPES = (spec.TYPE_DATA, spec.TYPE_HELLO, spec.TYPE_STATUS, spec.TYPE_READ)


def require_session_open(probe: Probe) -> None:
    """Require that the session is still open after a refused packet."""
    probe.poll_status()
    probe.require_ack(
        probe.state, "a refused packet other than DATA changes nothing", session=probe.session
    )


@check("4", "reserved-types", "a reserved type, or one of a device, is refused: TYPE")
def reserved_types(probe: Probe) -> None:
    for kind in range(16):
        if kind not in HOST_TYPES:
            probe.require_refused(body(kind, seq=kind, frame=9, payload=b"\1"), spec.CODE_TYPE, 0)
            probe.require_refused(body(kind, flags=3), spec.CODE_TYPE, 0)
    require_session_open(probe)


@check("4", "data-flags", "a reserved flag of DATA is refused: FIELD at 0")
def data_flags(probe: Probe) -> None:
    for flags in (2, 8, 10, 2 | CLEAR | COMMIT):
        probe.open_session()
        probe.require_refused(data(0, 0, b"", flags), spec.CODE_FIELD, 0)


@check("4", "status-fields", "reserved flags and frame of a STATUS are refused: FIELD")
def status_fields(probe: Probe) -> None:
    for flags in (1, 2, 4, 8, 15):
        probe.require_refused(body(spec.TYPE_STATUS, flags, 9), spec.CODE_FIELD, 0)
    probe.require_refused(body(spec.TYPE_STATUS, 0, 9, 1), spec.CODE_FIELD, 2)
    probe.require_refused(body(spec.TYPE_STATUS, 1, 9, 1), spec.CODE_FIELD, 0)
    require_session_open(probe)


@check("4", "read-fields", "reserved flags, frame and byte of a READ are refused", feature("READ"))
def read_fields(probe: Probe) -> None:
    for flags in (2, 4, 8, 2 | BACK):
        probe.require_refused(packets.read(0, 1, 9, flags), spec.CODE_FIELD, 0)
    framed = bytearray(packets.read(0, 1, 9))
    framed[2] = 1
    probe.require_refused(bytes(framed), spec.CODE_FIELD, 2)
    probe.require_refused(packets.read(0, 1, 9, reserved=1), spec.CODE_FIELD, 3)
    require_session_open(probe)

"""Checks of section 5: HELLO, INFO and the session before."""

from __future__ import annotations

import struct

from voxdisplay.conformance import ops, packets
from voxdisplay.conformance.announced_device import FEATURES, FORMATS
from voxdisplay.conformance.catalogue import check, min_voxels, readable_display, refresh_tick
from voxdisplay.conformance.packets import COMMIT, SHOWN, Response, body, data, hello
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

_ATTEMPTS = 6


def request_info(probe: Probe, packet: bytes) -> Response:
    """Send a HELLO and require one INFO."""
    info = probe.request(packet)
    probe.require(info.kind == spec.TYPE_INFO, "INFO", info)
    return info


@check("5", "info-fields", "every field of INFO has an allowed value")
def info_fields(probe: Probe) -> None:
    info, device = probe.info, probe.device
    known = sum(1 << bit for bit in FEATURES.values())
    longest = packets.max_encoded_bytes(info.max_payload)
    needed = spec.LIMIT_RESERVE + longest
    count = info.nx * info.ny * info.nz
    for holds, must, came in (
        (info.major == spec.VERSION_MAJOR, "major 1", info.major),
        (info.format in FORMATS, "format 1 to 4", info.format),
        (min(device.grid) > 0, "a voxel at least on each axis", device.grid),
        (count <= spec.LIMIT_MAX_VOXELS, "at most 2^31 - 1 voxels", count),
        (info.pages >= 2, "two pages at least", info.pages),
        (info.max_payload >= spec.LIMIT_MIN_PAYLOAD, "max_payload 64 at least", info.max_payload),
        (
            info.rx_buffer >= needed,
            f"rx_buffer {needed} at least: 64 bytes, and the longest packet on the wire",
            info.rx_buffer,
        ),
        (not info.features & ~known, "no bit of features without a name", hex(info.features)),
        (
            info.minor or not info.features >> spec.FEATURE_SLABS,
            "minor 1 with features from bit 9 on",
            info.minor,
        ),
    ):
        probe.require(bool(holds), must, came)
    for name in ("DIFF", "PALETTE"):
        fits = not device.has(name) or info.format == spec.FORMAT_INDEX8
        probe.require(fits, f"{name} only with the format INDEX8", info)
    valued = info.features >> spec.FEATURE_VALUES & 1
    fits = not valued or info.format != spec.FORMAT_MONO1
    probe.require(fits, "VALUES not with the format MONO1", info)
    ticks = not device.has("HOLD") or device.refresh > 0
    probe.require(ticks, "HOLD only with refresh ticks", info)


@check("5", "info-strings", "INFO ends with three strings in UTF-8")
def info_strings(probe: Probe) -> None:
    at, tail = 0, probe.info.tail
    for name in ("name", "firmware", "serial"):
        probe.require(at < len(tail), f"a size of the string {name}", "the end of INFO")
        end = at + 1 + tail[at]
        probe.require(end <= len(tail), f"{tail[at]} bytes of {name}", f"{len(tail) - at - 1}")
        try:
            tail[at + 1 : end].decode()
        except UnicodeDecodeError:
            probe.fail(f"{name} in UTF-8", tail[at + 1 : end].hex(" ").upper())
        at = end


@check("5", "info-same", "INFO is the same each time, except for the session")
def info_same(probe: Probe) -> None:
    for session in (1, 0x1234, 0xFFFF):
        info = request_info(probe, hello(session))
        probe.require(info.session == session, f"session {session:04X}h in INFO", info)
        same = info.body[:4] + info.body[6:] == probe.info.body[:4] + probe.info.body[6:]
        probe.require(same, f"as before: {probe.info}", info)


@check("5", "hello-repeated", "each HELLO is answered with INFO, a repeated one too")
def hello_repeated(probe: Probe) -> None:
    packet = hello(0x5A17)
    responses = probe.send_and_poll(packet, packet, packet)
    kinds = [answer.kind for answer in responses]
    probe.require(kinds == 3 * [spec.TYPE_INFO], "3 times INFO", " and ".join(map(str, responses)))
    probe.require_ack(probe.state, session=0x5A17, next=0)


@check("5", "new-session", "HELLO opens a session: next 0, nothing received, nothing shown")
def new_session(probe: Probe) -> None:
    probe.show(b"")
    for seq in (1, 2, 5):
        probe.request(data(seq, 1))
    probe.open_session()
    probe.poll_status()
    probe.require_ack(probe.state, session=probe.session, next=0, received=0, shown=0, pending=0)
    probe.draw(b"")


@check(
    "5",
    "front-page-stays",
    "the front page stays as it is, but its frame id is forgotten",
    readable_display,
)
def front_page_stays(probe: Probe) -> None:
    probe.show(ops.single_voxel(probe.device, probe.device.voxel_count - 1))
    probe.open_session()
    probe.poll_status()
    probe.require_ack(
        probe.state, "SHOWN is clear until the session's first swap", shown=0, frame=0
    )
    must = probe.front or Page()
    probe.require_displayed(probe.state, must)
    probe.require_readback(must)


@check("5", "filling-dropped", "HELLO drops a frame that is not on display", readable_display)
def filling_dropped(probe: Probe) -> None:
    probe.show(b"")
    probe.draw(ops.single_voxel(probe.device, 0))
    probe.open_session()
    probe.wait_two_ticks()
    probe.poll_status()
    probe.require_ack(probe.state, shown=0, pending=0)
    probe.require_displayed(probe.state, Page())
    probe.show(b"", clear=False)


@check("5", "pending-dropped", "HELLO drops a pending frame", refresh_tick, readable_display)
def pending_dropped(probe: Probe) -> None:
    for _ in range(_ATTEMPTS):
        probe.show(b"")
        session = probe.session % 65535 + 1
        responses = probe.send_and_poll(
            data(1, 1, ops.single_voxel(probe.device, 0), 1 | COMMIT), hello(session)
        )
        probe.session = session
        kinds = [answer.kind for answer in responses]
        probe.require(spec.TYPE_INFO in kinds, "INFO", responses[-1] if responses else "nothing")
        at = kinds.index(spec.TYPE_INFO)
        if any(answer.flags & SHOWN and answer.frame == 1 for answer in responses[:at]):
            probe.open_session()
            continue  # the tick was faster
        probe.wait_two_ticks()
        probe.poll_status()
        probe.require_ack(probe.state, shown=0, pending=0)
        probe.require_displayed(probe.state, Page())
        return


@check("5", "other-major", "a HELLO of another major gets INFO, and opens no session")
def other_major(probe: Probe) -> None:
    probe.request(data(0, 0))
    for major in (0, 2, 255):
        info = request_info(probe, hello(0x4321, major))
        probe.require(info.session == 0x4321, "the session of that HELLO in INFO", info)
        probe.require(info.major == spec.VERSION_MAJOR, "the device's own major in INFO", info)
        probe.require_ack(probe.state, "what was open stays open", session=probe.session, next=1)


@check("5", "other-major-first", "a HELLO of another major gets INFO without an open session, too")
def other_major_first(probe: Probe) -> None:
    probe.end_session()
    request_info(probe, hello(0x4321, 2))
    probe.require(
        probe.state.kind == spec.TYPE_ERROR, "NO_SESSION in response to STATUS", probe.state
    )


@check(
    "5",
    "hello-ignored",
    "flags, seq, frame, minor, reserved and further bytes of a HELLO are ignored",
)
def hello_ignored(probe: Probe) -> None:
    session = struct.pack("<H", probe.session)
    for packet in (
        body(spec.TYPE_HELLO, 15, 7, 9, b"\1" + session + b"\0\0"),
        body(spec.TYPE_HELLO, 0, 0, 0, b"\1" + session + b"\xc8\xaa"),
        body(spec.TYPE_HELLO, 0, 0, 0, b"\1" + session + b"\0\0" + bytes(range(40))),
        body(spec.TYPE_HELLO, 1, 255, 255, b"\1" + session + b"\1\1\0\0\0"),
    ):
        info = request_info(probe, packet)
        probe.require(info.session == probe.session, "the session of the HELLO", info)
        probe.require_ack(probe.state, session=probe.session)


@check(
    "5", "hello-short", "a HELLO that ends before offset 8 is refused: LENGTH, whatever its major"
)
def hello_short(probe: Probe) -> None:
    for payload in (b"\1\1\1\0", b"\1\1\1", b"\1", b"", b"\1\0\0\0", b"\2\0\0", b"\7\1\1\0"):
        probe.require_refused(body(spec.TYPE_HELLO, payload=payload), spec.CODE_LENGTH, 0)
        probe.require_ack(probe.state, "what was open stays open", session=probe.session)


@check("5", "session-zero", "a HELLO with session 0 is refused: FIELD at 4, whatever its major")
def session_zero(probe: Probe) -> None:
    for major in (1, 0, 2):
        probe.require_refused(hello(0, major), spec.CODE_FIELD, 4)
        probe.require_ack(probe.state, "what was open stays open", session=probe.session)


@check(
    "5",
    "keep-in-new-session",
    "a session's first frame without CLEAR starts as a copy of the front page",
    readable_display,
    min_voxels(2),
)
def keep_in_new_session(probe: Probe) -> None:
    probe.show(ops.single_voxel(probe.device, 0))
    probe.open_session()
    probe.show(ops.single_voxel(probe.device, 1), clear=False)

"""`DeviceInfo` from INFO, and `DeviceError` from ERROR. Must not know the link."""

from __future__ import annotations

from dataclasses import dataclass

from voxdisplay.errors import DeviceError, IncompatibleDevice
from voxdisplay.printable_text import printable
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.packet import Error, Info

_CODES = {
    value: name.removeprefix("CODE_")
    for name, value in vars(spec).items()
    if name.startswith("CODE_")
}


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Properties that a display has announced.

    Attributes
    ----------
    grid : Grid
        Shape of its volume.
    format : PixelFormat
    protocol : str
        Version, such as ``"1.0"``.
    name, firmware, serial : str
        Printable texts; empty where it has none.
    refresh_hz : float
        Refresh ticks per second; 0: it shows a frame at once.
    max_payload_bytes : int
        Longest payload of a packet.
    rx_buffer_bytes : int
        Size of its receive buffer.
    features : tuple of str
        Announced features (protocol.md, section 5), in lower case.
    boot : int
        Boot id: another after each start of the device.

    """

    grid: Grid
    format: PixelFormat
    protocol: str
    name: str
    firmware: str
    serial: str
    refresh_hz: float
    max_payload_bytes: int
    rx_buffer_bytes: int
    features: tuple[str, ...]
    boot: int


def device_info(info: Info) -> DeviceInfo:
    """Return the properties in an INFO.

    Raises
    ------
    IncompatibleDevice
        If it is of another protocol major, or has an unknown pixel format.

    """
    if info.major != spec.VERSION_MAJOR:
        raise IncompatibleDevice(
            f"the device speaks protocol {info.major}, this driver {spec.VERSION_MAJOR}",
            hint="update the older of the two",
        )
    format_ = PixelFormat.from_wire(info.format)
    if format_ is None:
        raise IncompatibleDevice(f"the device has the unknown pixel format {info.format}")
    return DeviceInfo(
        grid=Grid(info.nx, info.ny, info.nz),
        format=format_,
        protocol=f"{info.major}.{info.minor}",
        name=printable(info.name),
        firmware=printable(info.firmware),
        serial=printable(info.serial),
        refresh_hz=info.refresh / 1000,
        max_payload_bytes=info.max_payload,
        rx_buffer_bytes=info.rx_buffer,
        features=tuple(
            name.removeprefix("FEATURE_").lower()
            for name, bit in vars(spec).items()
            if name.startswith("FEATURE_") and info.has(bit)
        ),
        boot=info.boot,
    )


def check_compatible(before: DeviceInfo, now: DeviceInfo) -> None:
    """Raise if frames that were made for a device do not suit the one that is there now.

    Raises
    ------
    IncompatibleDevice
        If its grid or format differs, or it lacks a feature or room that the other had.

    """
    if (now.grid, now.format) != (before.grid, before.format):
        raise IncompatibleDevice(
            f"the device came back as another: {now.grid} {now.format.value}, "
            f"it was {before.grid} {before.format.value}"
        )
    if missing := set(before.features) - set(now.features):
        raise IncompatibleDevice(f"the device came back without {', '.join(sorted(missing))}")
    if now.max_payload_bytes < before.max_payload_bytes:
        raise IncompatibleDevice("the device came back with less room for a packet")


def check_serial(info: DeviceInfo, wanted: str | None) -> None:
    """Raise `IncompatibleDevice` if a device has not the serial number that is wanted, if any."""
    if wanted is None or wanted == info.serial:
        return
    has = f"has the serial number {info.serial!r}" if info.serial else "has no serial number"
    raise IncompatibleDevice(
        f"this device {has}, the display's profile wants {wanted!r}",
        hint="plug in the other one, name another port, or take serial out of the profile",
    )


def device_error(error: Error) -> DeviceError:
    """Return the error for an ERROR packet."""
    name = _CODES.get(error.code, "an unknown code")
    text = f": {printable(error.text)}" if error.text else ""
    return DeviceError(
        f"the device refused a packet: {name} ({error.code}) at byte {error.offset}{text}",
        code=error.code,
        hint="driver or device has a fault; protocol.md, section 11, explains the code",
    )

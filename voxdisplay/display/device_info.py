"""What a device says of itself, and what it refuses, in a user's words. Knows no link."""

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
    """What a display says of itself.

    Attributes
    ----------
    grid : Grid
        Its shape.
    format : PixelFormat
    protocol : str
        Version, such as ``"1.0"``.
    name, firmware, serial : str
    refresh_hz : float
        Refresh ticks per second; 0: it shows a frame at once.
    max_payload_bytes, rx_buffer_bytes : int
        Longest payload of a packet; room for what is on its way.
    features : tuple of str
        What it announced, in lower case.
    boot : int
        Another number after each start of the device.

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
    """Read an INFO.

    Raises
    ------
    IncompatibleDevice
        If it is of another protocol major, or has a pixel format we do not know.

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
    """Check that what was made for a device suits what is there now.

    Raises
    ------
    IncompatibleDevice
        If it has another grid or format, or does not take all that the other took.

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


def device_error(error: Error) -> DeviceError:
    """Give what is raised for an ERROR."""
    name = _CODES.get(error.code, "an unknown code")
    text = f": {printable(error.text)}" if error.text else ""
    return DeviceError(
        f"the device refused a packet: {name} ({error.code}) at byte {error.offset}{text}",
        code=error.code,
        hint="protocol.md, section 11, says what it means; driver or device has a fault",
    )

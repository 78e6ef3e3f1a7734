"""USB descriptors of a device, as bytes, and their parsing by a host.

Names and layouts are those of the USB 2.0 specification, chapter 9. Knows no transfers.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Final, TypeAlias

DEVICE: Final = 1
CONFIGURATION: Final = 2
STRING: Final = 3
INTERFACE: Final = 4
ENDPOINT: Final = 5
CS_INTERFACE: Final = 0x24  # of a class, here of CDC

BULK: Final = 2
INTERRUPT: Final = 3
IN: Final = 0x80  # the bit of an endpoint's address

_DEVICE: Final = struct.Struct("<BBHBBBBHHHBBBB")
_CONFIGURATION: Final = struct.Struct("<BBHBBBBB")
_INTERFACE: Final = struct.Struct("<BBBBBBBBB")
_ENDPOINT: Final = struct.Struct("<BBBBHB")
_SELF_POWERED: Final = 0xC0
_ENGLISH: Final = 0x0409


@dataclass(frozen=True)
class Endpoint:
    """An endpoint: address with the direction bit, transfer type, longest packet in bytes."""

    address: int
    attributes: int
    packet: int
    interval: int = 0


@dataclass(frozen=True)
class Interface:
    """An interface: its number, its class, subclass and protocol, and its endpoints.

    ``functional`` holds the descriptors of its class, which come before those of the endpoints.
    """

    number: int
    triple: tuple[int, int, int]
    endpoints: tuple[Endpoint, ...]
    functional: bytes = b""


@dataclass(frozen=True)
class Descriptors:
    """All descriptors of a device.

    Parameters
    ----------
    vid, pid
        Vendor and product.
    manufacturer, product, serial
        Strings; an empty one is not announced.
    interfaces
        Those of its only configuration, whose value is 1.
    device_class
        Class of the whole device; 0 leaves it to the interfaces.
    """

    vid: int
    pid: int
    manufacturer: str
    product: str
    serial: str
    interfaces: tuple[Interface, ...]
    device_class: int = 0
    strings: tuple[str, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        texts = (self.manufacturer, self.product, self.serial)
        object.__setattr__(self, "strings", tuple(text for text in texts if text))

    @property
    def endpoints(self) -> dict[int, Endpoint]:
        """All endpoints except that for control, by address."""
        return {e.address: e for i in self.interfaces for e in i.endpoints}

    def get(self, kind: int, index: int) -> bytes | None:
        """Return a descriptor by type and index; None if there is none."""
        if kind == DEVICE and not index:
            return self._device()
        if kind == CONFIGURATION and not index:
            return self._configuration()
        if kind == STRING and index <= len(self.strings):
            if not index:
                return struct.pack("<BBH", 4, STRING, _ENGLISH)
            text = self.strings[index - 1].encode("utf-16-le")[:252]
            return bytes((2 + len(text), STRING)) + text
        return None

    def _device(self) -> bytes:
        indexes = (
            1 + self.strings.index(text) if text else 0
            for text in (self.manufacturer, self.product, self.serial)
        )
        ids = (self.vid, self.pid, 0x0100)
        return _DEVICE.pack(18, DEVICE, 0x0200, self.device_class, 0, 0, 64, *ids, *indexes, 1)

    def _configuration(self) -> bytes:
        body = b""
        for interface in self.interfaces:
            body += _INTERFACE.pack(
                *(9, INTERFACE, interface.number, 0, len(interface.endpoints)),
                *(*interface.triple, 0),
            )
            body += interface.functional
            for e in interface.endpoints:
                body += _ENDPOINT.pack(7, ENDPOINT, e.address, e.attributes, e.packet, e.interval)
        total = _CONFIGURATION.size + len(body)
        count = len(self.interfaces)
        head = _CONFIGURATION.pack(9, CONFIGURATION, total, count, 1, 0, _SELF_POWERED, 0)
        return head + body


Record: TypeAlias = SimpleNamespace


def _record(names: str, values: tuple[int, ...]) -> Record:
    """Return a descriptor as a host's software shows it, with fields under the standard's names."""
    fields = dict(zip(names.split(), values, strict=True))
    return SimpleNamespace(**fields, extra_descriptors=[])


_DEVICE_NAMES: Final = (
    "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0"
    " idVendor idProduct bcdDevice iManufacturer iProduct iSerialNumber bNumConfigurations"
)
_CONFIGURATION_NAMES: Final = (
    "bLength bDescriptorType wTotalLength bNumInterfaces bConfigurationValue iConfiguration"
    " bmAttributes bMaxPower"
)
_INTERFACE_NAMES: Final = (
    "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass"
    " bInterfaceSubClass bInterfaceProtocol iInterface"
)
_ENDPOINT_NAMES: Final = (
    "bLength bDescriptorType bEndpointAddress bmAttributes wMaxPacketSize bInterval"
    " bRefresh bSynchAddress"  # these two in descriptors of audio alone
)


def read_device(data: bytes) -> Record:
    """Parse a device descriptor."""
    return _record(_DEVICE_NAMES, _DEVICE.unpack(data))


def read_configuration(data: bytes) -> tuple[Record, list[tuple[Record, list[Record]]]]:
    """Parse a configuration descriptor and the descriptors behind it.

    Returns
    -------
    configuration : Record
    interfaces : list of (Record, list of Record)
        Interfaces with their endpoints. Descriptors of a class are in the ``extra_descriptors``
        of the descriptor before them.
    """
    records = _records(data)
    configuration = last = _record(_CONFIGURATION_NAMES, _CONFIGURATION.unpack(next(records)))
    interfaces: list[tuple[Record, list[Record]]] = []
    for raw in records:
        if raw[1] == INTERFACE:
            last = _record(_INTERFACE_NAMES, _INTERFACE.unpack(raw))
            interfaces.append((last, []))
        elif raw[1] == ENDPOINT and interfaces:
            last = _record(_ENDPOINT_NAMES, (*_ENDPOINT.unpack(raw), 0, 0))
            interfaces[-1][1].append(last)
        else:
            last.extra_descriptors += raw
    return configuration, interfaces


def _records(data: bytes) -> Iterator[bytes]:
    while data:
        length = data[0]
        if not 2 <= length <= len(data):
            raise ValueError(f"a descriptor of {length} bytes where {len(data)} are left")
        yield data[:length]
        data = data[length:]

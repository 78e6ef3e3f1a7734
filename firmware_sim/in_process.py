"""Device in the host's own process, behind a port of the kind ``sim:``.

Moves bytes and advances the device's time; knows nothing of packets.
"""

import difflib
import threading
import time
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final
from urllib.parse import parse_qsl

from firmware_sim.baud_pacing import PacedDevice, with_baud
from firmware_sim.bench import Bench
from firmware_sim.config import (
    Config,
    parse_baud,
    parse_names,
    parse_number,
    parse_refresh,
    parse_size,
)
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.faults import parse_faults
from firmware_sim.quoting import excerpt

# Key of the URL: what it sets (a field of Config, or a property of the line), and its parser.
_KEYS: Final[dict[str, tuple[str, Callable[[str], Any]]]] = {
    "size": ("grid", parse_size),
    "format": ("pixel_format", str.lower),
    "refresh": ("refresh", parse_refresh),
    "rx_buffer": ("rx_buffer", parse_number),
    "max_payload": ("max_payload", parse_number),
    "boot": ("boot", parse_number),
    "name": ("name", str),
    "firmware": ("firmware", str),
    "serial": ("serial", str),
    "features": ("features", parse_names),
    "silent": ("max_silent_acks", parse_number),
    "lie": ("lies", parse_names),
    "fault": ("faults", parse_faults),
    "seed": ("seed", parse_number),
    "baud": ("baud", parse_baud),
}


class InProcessPort:
    """Port of a device whose time advances while the host reads and writes.

    One thread may read while another one writes.

    Parameters
    ----------
    wire
        The device on its line.

    Attributes
    ----------
    bench : Bench
        Test controls of the device.
    """

    def __init__(self, wire: DeviceOnLine | PacedDevice) -> None:
        self.bench = Bench(wire.device)
        self._wire = wire
        self._changed = threading.Condition()
        self._closed = False

    def read(self, timeout_s: float) -> bytes:
        """Return what the device has sent, waiting for the first byte.

        Parameters
        ----------
        timeout_s
            Longest wait in seconds.

        Returns
        -------
        bytes
            What has arrived; empty after the timeout.

        Raises
        ------
        ConnectionError
            If the port is closed, or the device unplugged.
        """
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while True:
                self._check_open()
                data = self._wire.transmit()
                if data:
                    return data
                if not self._wait(deadline):
                    return b""

    def write(self, data: bytes, timeout_s: float) -> None:
        """Send bytes to the device.

        Parameters
        ----------
        data
            Any bytes. Those that the device cannot buffer are lost, which it reports (OVERRUN).
        timeout_s
            Longest wait in seconds for a line that is full. Any other takes the bytes at once.

        Raises
        ------
        ConnectionError
            If the port is closed, or the device unplugged.
        TimeoutError
            If the line stayed full; it has taken nothing.
        """
        deadline = time.monotonic() + timeout_s
        with self._changed:
            self._check_open()
            while not self._wire.accepts_data():
                if not self._wait(deadline):
                    raise TimeoutError("the line is full: none of these bytes were taken")
                self._check_open()
            self._wire.receive(bytes(data))
            self._changed.notify_all()

    def close(self) -> None:
        """Close the port. Calling it again has no effect."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _wait(self, deadline: float) -> bool:
        """Wait for the next event; return False if the deadline has passed."""
        left = deadline - time.monotonic()
        if left <= 0:
            return False
        happens = self._wire.next_event_s()
        self._changed.wait(left if happens is None else min(left, happens))
        return True

    def _check_open(self) -> None:
        if self._closed:
            raise ConnectionError("the port is closed")


def open_in_process(url: str) -> InProcessPort:
    """Open a ``sim:`` port: a new device in this process.

    Parameters
    ----------
    url
        ``sim:``, or ``sim:?KEY=VALUE&KEY=VALUE...`` with the keys ``size`` (64x64x64 or 64,64,64),
        ``format`` (mono1, index8, rgb565, rgb888), ``refresh`` (hertz; 0: at once), ``rx_buffer``
        and ``max_payload`` (bytes), ``baud`` (bits a second; 0: no limit), ``boot``, ``silent``,
        ``seed`` (numbers), ``features`` (line,read,digest), ``lie`` (credit,boot), ``name``,
        ``firmware``, ``serial`` (text), ``fault`` (flip:1e-6,stall:0.2@0.01; see `parse_faults`).

    Returns
    -------
    InProcessPort
        The port.

    Raises
    ------
    ValueError
        If a key is unknown or a value invalid; the message names it.

    Examples
    --------
    >>> port = open_in_process("sim:?size=64x64x64&format=mono1")
    >>> port.read(0)
    b''
    >>> port.close()
    """
    fields = parse_url(url, "sim:")
    faults = fields.pop("faults", ())
    seed = fields.pop("seed", 0)
    baud = fields.pop("baud", 0)
    return InProcessPort(with_baud(DeviceOnLine(Device(Config(**fields)), faults, seed), baud))


def parse_url(
    url: str, kind: str, more: Mapping[str, tuple[str, Callable[[str], Any]]] = MappingProxyType({})
) -> dict[str, Any]:
    """Parse the name of a port of an emulator in this process.

    Parameters
    ----------
    url
        ``KIND``, or ``KIND?KEY=VALUE&KEY=VALUE...``.
    kind
        Such as ``sim:``.
    more
        Further keys of this kind: what they set, and their parsers.

    Returns
    -------
    dict
        Values by what the keys set.

    Raises
    ------
    ValueError
        If a key is unknown or a value invalid; the message names it.
    """
    keys = {**_KEYS, **more}
    scheme, mark, query = url.partition("?")
    if scheme != kind or (mark and not query):
        raise ValueError(f"port {excerpt(url)}: write {kind} or {kind}?KEY=VALUE&KEY=VALUE...")
    fields: dict[str, Any] = {}
    for key, text in parse_qsl(query, keep_blank_values=True):
        if key not in keys:
            near = difflib.get_close_matches(key[:20], keys, n=1)
            hint = f"did you mean {near[0]}? " if near else ""
            raise ValueError(
                f"unknown key {excerpt(key)} in {excerpt(url)}: {hint}there are {', '.join(keys)}"
            )
        name, parse = keys[key]
        if name in fields:
            raise ValueError(f"key {key!r} occurs twice in {excerpt(url)}: write it once")
        try:
            fields[name] = parse(text)
        except ValueError as error:
            raise ValueError(f"{key} in {excerpt(url)}: {error}") from None
    return fields

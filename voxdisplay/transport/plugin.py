"""Pipes that other packages bring: their errors become ours."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.transport.base import Transport


def open_usb(port: str, opener: Callable[[str], Any]) -> Transport:
    """Open a display on a USB that an entry point of the group ``voxdisplay.usb`` knows."""
    from voxdisplay.transport.usb import UsbTransport  # noqa: PLC0415 - loads pyusb

    return UsbTransport(port, backend=_call_opener(port, opener))


def _call_opener(port: str, opener: Callable[[str], Any]) -> Any:
    try:
        return opener(port)
    except ValueError as error:
        raise OpenError(f"{port}: {error}", port=port) from error
    except OSError as error:
        raise OpenError(f"{port} cannot be opened: {error}", port=port) from error


class PluginTransport:
    """A pipe from an entry point: see the package's first paragraph for what it must do."""

    def __init__(self, port: str, opener: Callable[[str], Any]) -> None:
        self.port = port
        self._pipe = _call_opener(port, opener)

    @property
    def pipe(self) -> Any:
        """What the entry point gave: an emulator's has a ``bench``."""
        return self._pipe

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        try:
            return bytes(self._pipe.read(timeout_s))
        except OSError as error:
            raise TransportClosed(f"{self.port} is gone: {error}") from error

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        try:
            self._pipe.write(data, timeout_s)
        except TimeoutError as error:
            raise TransportTimeout(f"{self.port} takes no bytes: {error}") from error
        except OSError as error:
            raise TransportClosed(f"{self.port} is gone: {error}") from error

    def close(self) -> None:
        """See `Transport.close`."""
        self._pipe.close()

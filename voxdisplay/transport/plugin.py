"""Pipes of other packages' entry points, with their errors turned into ours.

See the first paragraph of `voxdisplay.transport` for what an entry point must do.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from importlib.metadata import EntryPoint
from typing import Any

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.transport.base import Transport
from voxdisplay.transport.library_errors import LIBRARY_ERRORS, message_of


def opener_of(entry: EntryPoint) -> Callable[..., Any]:
    """Return a function that loads an entry point and opens a port by it, with what options."""

    def opener(port: str, **options: Any) -> Any:
        try:
            function = entry.load()
        except Exception as error:  # a damaged package may raise anything while it is imported
            raise OpenError(
                f"{port} cannot be opened: loading {entry.value} failed: {message_of(error)}",
                port=port,
                hint="reinstall the package that this kind of port comes from",
            ) from error
        return function(port, **options)

    return opener


def open_usb(port: str, opener: Callable[[str], Any]) -> Transport:
    """Open a display on a USB that an entry point of the group ``voxdisplay.usb`` knows."""
    from voxdisplay.transport.usb import UsbTransport  # noqa: PLC0415 - loads pyusb

    return UsbTransport(port, backend=call_opener(port, opener))


def call_opener(port: str, opener: Callable[..., Any], **options: Any) -> Any:
    """Open a port by the function of an entry point; raise its errors as `OpenError`."""
    try:
        return opener(port, **options)
    except OpenError:
        raise
    except ValueError as error:
        raise OpenError(f"{port}: {error}", port=port) from error
    except LIBRARY_ERRORS as error:
        raise OpenError(f"{port} cannot be opened: {message_of(error)}", port=port) from error


class PluginTransport:
    """A pipe that an entry point has opened."""

    def __init__(self, port: str, opener: Callable[[str], Any]) -> None:
        self.port = port
        self._pipe = call_opener(port, opener)

    @property
    def pipe(self) -> Any:
        """Object that the entry point returned: an emulator's has a ``bench``."""
        return self._pipe

    def read(self, timeout_s: float) -> bytes:
        """See `Transport.read`."""
        try:
            return bytes(self._pipe.read(timeout_s))
        except LIBRARY_ERRORS as error:
            raise TransportClosed(f"{self.port} is gone: {message_of(error)}") from error

    def write(self, data: bytes, timeout_s: float) -> None:
        """See `Transport.write`."""
        try:
            self._pipe.write(data, timeout_s)
        except TimeoutError as error:
            raise TransportTimeout(f"{self.port} takes no bytes: {message_of(error)}") from error
        except LIBRARY_ERRORS as error:
            raise TransportClosed(f"{self.port} is gone: {message_of(error)}") from error

    def close(self) -> None:
        """See `Transport.close`."""
        with contextlib.suppress(*LIBRARY_ERRORS):
            self._pipe.close()

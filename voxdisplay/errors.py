"""Everything that can go wrong, by whose fault it is.

::

    VoxDisplayError
    |- TransportError           the pipe
    |  |- OpenError               no such port, busy, forbidden, no backend; .port, .hint
    |  |- TransportClosed         unplugged, or the peer closed, in mid-use
    |  `- TransportTimeout        also a TimeoutError
    |- ProtocolError            (abstract) somebody broke protocol.md
    |  |- LocalProtocolError      you asked for something illegal in this state; nothing was sent
    |  `- RemoteProtocolError     the device broke it; .section, .offset, .raw
    |- DeviceError              a well-formed refusal; .code
    |  `- IncompatibleDevice      a version or a grid that cannot be served
    |- SceneError               the scene is wrong: .path and what; also a ValueError
    |- CurveError               a curve cannot be evaluated or drawn; also a ValueError
    |- DesyncError              the device's digest differs from ours after recovery was tried
    `- MissingExtra             an optional library is not installed; also an ImportError

A damaged packet is a counter and a recovery, not an exception. Wrong arguments to a Python
function are ordinary ``ValueError`` and ``TypeError``. This module knows nothing of the rest.
"""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

from voxdisplay.printable_text import printable_lines

if TYPE_CHECKING:
    from collections.abc import Iterable


class VoxDisplayError(Exception):
    """Base of all errors of this package.

    Parameters
    ----------
    message : str
        What happened, and where.
    hint : str, optional
        What to do about it. Shown after the message.

    Both are made printable: ports, devices and libraries are quoted in them.

    """

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(printable_lines(message))
        self.hint = hint and printable_lines(hint)


class TransportError(VoxDisplayError):
    """The byte pipe failed. The hardware or its driver is to blame, not the protocol."""


class OpenError(TransportError):
    """A port could not be opened: missing, busy, forbidden, or its backend is not installed."""

    def __init__(self, message: str, *, port: str, hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.port = port


class TransportClosed(TransportError):  # noqa: N818 - a state, and the name users read
    """The pipe went away in mid-use: unplugged, or closed by the peer."""


class TransportTimeout(TransportError, TimeoutError):  # noqa: N818 - as TimeoutError
    """Nothing came, or nothing could be sent, within the deadline."""


class ProtocolError(VoxDisplayError):
    """Somebody broke protocol.md. Abstract: it is always one side or the other."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        if type(self) is ProtocolError:
            raise TypeError("ProtocolError is abstract: say whose fault it is")
        super().__init__(message, hint=hint)


class LocalProtocolError(ProtocolError):
    """The caller asked for something illegal in this state. Nothing was sent."""


class RemoteProtocolError(ProtocolError):
    """The device sent something that protocol.md does not allow.

    Parameters
    ----------
    message : str
        What was wrong.
    section : str
        The section of protocol.md that was broken.
    offset : int, optional
        Where in the packet, in bytes.
    raw : bytes, optional
        The packet.

    """

    def __init__(self, message: str, *, section: str, offset: int = 0, raw: bytes = b"") -> None:
        super().__init__(f"{message} (protocol.md, section {section})")
        self.section = section
        self.offset = offset
        self.raw = raw


class DeviceError(VoxDisplayError):
    """The device refused, in good form.

    Parameters
    ----------
    message : str
        What it refused.
    code : int
        The code of its ERROR packet; 0 when the refusal came otherwise.

    """

    def __init__(self, message: str, *, code: int = 0, hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.code = code


class IncompatibleDevice(DeviceError):  # noqa: N818 - names the device, not the accident
    """The device speaks another protocol version, or has a grid that cannot be served."""


class SceneError(VoxDisplayError, ValueError):
    """A scene is wrong.

    Parameters
    ----------
    message : str
        What is wrong.
    path : str
        Where, as a JSON path such as ``$.objects[0].x``; ``$`` is the whole scene. Empty for a
        file that could not be read or is not JSON.
    file : str, optional
        The scene file's name.
    line, column : int, optional
        Where in its text, counted from 1.

    """

    def __init__(
        self,
        message: str,
        *,
        path: str = "$",
        hint: str | None = None,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        super().__init__(message, hint=hint)
        self.path = path
        self.file = file
        self.line = line
        self.column = column

    def __str__(self) -> str:
        # Composed here, so that a place may be added later and a copy is made of the message alone.
        position = f"line {self.line}, column {self.column}" if self.line else ""
        place = ", ".join(part for part in (self.file, position) if part)
        return ": ".join(part for part in (place, self.path, str(self.args[0])) if part)


class CurveError(VoxDisplayError, ValueError):
    """A curve cannot be evaluated or drawn.

    Parameters
    ----------
    message : str
        What is wrong: the axis and the parameter value where they are known.
    axis : str, optional
        ``"x"``, ``"y"`` or ``"z"`` when one coordinate is to blame.

    """

    def __init__(self, message: str, *, axis: str | None = None, hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.axis = axis


class DesyncError(VoxDisplayError):
    """What the device shows is not what was sent, after recovery was tried."""


class MissingExtra(VoxDisplayError, ImportError):  # noqa: N818 - a state, and the word of pip
    """An optional library is not installed; the hint says how to get it."""


def did_you_mean(word: str, known: Iterable[str]) -> str | None:
    """Give the hint that names the known word nearest to a mistyped one, if one is near."""
    near = difflib.get_close_matches(word[:64], known, n=1)
    return f"did you mean {near[0]!r}?" if near else None

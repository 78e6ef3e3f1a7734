"""Exception tree, by the party at fault.

::

    VoxDisplayError
    |- TransportError           the pipe
    |  |- OpenError               no such port, busy, forbidden, no backend; .port, .hint
    |  |- TransportClosed         unplugged, or the peer closed, in mid-use
    |  `- TransportTimeout        also a TimeoutError
    |- ProtocolError            (abstract) protocol.md was broken
    |  |- LocalProtocolError      the call is illegal in this state; nothing was sent
    |  `- RemoteProtocolError     the device broke it; .section, .offset, .raw
    |- DeviceError              a well-formed refusal; .code
    |  `- IncompatibleDevice      a version or a grid that cannot be served
    |- SceneError               the scene is wrong: .path and what; also a ValueError
    |- CurveError               a curve cannot be evaluated or drawn; also a ValueError
    |- BodyError                a body cannot be evaluated or drawn; also a ValueError
    |- ProfileError             a display profile is missing, or wrong; also a ValueError
    |- RecordingError           a recording is damaged, or of another kind; also a ValueError
    |- DesyncError              the device's digest still differs from ours after recovery
    `- MissingExtra             an optional library is not installed; also an ImportError

A damaged packet is a counter and a recovery, not an exception. Wrong arguments to a Python
function are ordinary ``ValueError`` and ``TypeError``. All errors survive pickling and copying.
This module must not know what raises them.
"""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from voxdisplay.printable_text import printable_lines

if TYPE_CHECKING:
    from collections.abc import Iterable

_MAX_WORD = 64  # as much of a word is compared
_MAX_SLIPS = 2
_SHORT, _LONG = 3, 10  # letters of a word that may have one slip, and two
_MARKS = str.maketrans("", "", " -_")


class VoxDisplayError(Exception):
    """Base of all errors of this package.

    Parameters
    ----------
    message : str
        What happened, and where.
    hint : str, optional
        What to do about it. Shown after the message.

    Notes
    -----
    Both are made printable: ports, devices and libraries are quoted in them.

    """

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(printable_lines(str(message)))
        self.hint = None if hint is None else printable_lines(str(hint))

    def __reduce__(self) -> tuple[Any, ...]:
        # The default calls the class with the finished message: it lacks what else its __init__
        # requires, such as a port, and what that adds to the message would be added twice.
        return _restore, (type(self), self.args), self.__dict__ or None


def _restore(cls: type[VoxDisplayError], args: tuple[Any, ...]) -> VoxDisplayError:
    """Return an error of a class as its base classes outside of this package make it."""
    error = cls.__new__(cls)
    super(VoxDisplayError, error).__init__(*args)
    return error


class TransportError(VoxDisplayError):
    """The byte pipe failed: hardware, driver or network, not the protocol."""


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
    """protocol.md was broken. Abstract: by this side or by the device."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        if type(self) is ProtocolError:
            raise TypeError("ProtocolError is abstract: take its Local or Remote subclass")
        super().__init__(message, hint=hint)


class LocalProtocolError(ProtocolError):
    """The call is illegal in this state. Nothing was sent."""


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
    """The device refused a packet, by an ERROR of the protocol.

    Parameters
    ----------
    message : str
        What it refused.
    code : int
        The code of its ERROR packet; 0 if there was none.

    """

    def __init__(self, message: str, *, code: int = 0, hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.code = code


class IncompatibleDevice(DeviceError):  # noqa: N818 - names the device, not the accident
    """The device has another protocol version, or a grid or format that cannot be served."""


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
        ``"x"``, ``"y"`` or ``"z"`` if it concerns one coordinate.

    """

    def __init__(self, message: str, *, axis: str | None = None, hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.axis = axis


class BodyError(VoxDisplayError, ValueError):
    """A surface, solid, mesh or volume cannot be evaluated or drawn."""


class ProfileError(VoxDisplayError, ValueError):
    """A display profile is missing, or wrong: which file, and which key."""


class RecordingError(VoxDisplayError, ValueError):
    """A recording cannot be read, written or played."""


class DesyncError(VoxDisplayError):
    """The device still shows something else than was sent, after recovery was tried."""


class MissingExtra(VoxDisplayError, ImportError):  # noqa: N818 - a state, and the word of pip
    """An optional library is not installed; the hint says how to get it."""


def did_you_mean(word: str, known: Iterable[str]) -> str | None:
    """Return a hint that names the known word that was mistyped; None if there is not one.

    Mistyped is a word with one slip, a long one with two: a letter missed, added, replaced, or
    exchanged with the next; or one without its end from a ``_`` on. Words that merely resemble
    each other, such as plane and bspline, are not offered.
    """
    near = _mistyped(word, list(known))
    return f"did you mean {near!r}?" if near else None


def similar_file(name: str, names: Iterable[str]) -> str | None:
    """Return a hint that names the file that was meant: mistyped, or with another suffix.

    Parameters
    ----------
    name : str
        Of a file that is not there.
    names : iterable of str
        Of those that are in its folder.

    """
    path, others = PurePath(name), [PurePath(each) for each in names]
    alike = {each.stem: each for each in others if each.suffix.lower() == path.suffix.lower()}
    near = _mistyped(path.stem, list(alike))
    meant = [alike[near]] if near else [each for each in others if each.stem == path.stem]
    return f"did you mean {str(meant[0])!r}?" if len(meant) == 1 else None


def _mistyped(word: str, known: list[str]) -> str | None:
    plain = _without_marks(word)
    for slips in range(_MAX_SLIPS + 1):
        near = [each for each in known if _is_mistyped(plain, _without_marks(each), slips)]
        near = near or [each for each in known if word and each.startswith(f"{word}_")]
        if near:
            return near[0] if len(near) == 1 else None
    return None


def _without_marks(word: str) -> str:
    return word[:_MAX_WORD].lower().translate(_MARKS)


def _is_mistyped(word: str, other: str, slips: int) -> bool:
    shorter = min(len(word), len(other))
    if slips > (0 if shorter < _SHORT else 1 if shorter < _LONG else _MAX_SLIPS):
        return False
    if len(word) == len(other) <= _SHORT + 1 and sorted(word) != sorted(other):
        return False  # both may be meant: fill, file
    return _is_near(word, other, slips)


def _is_near(word: str, other: str, slips: int) -> bool:
    """Return whether at most so many slips make one word of the other."""
    while word and other and word[0] == other[0]:
        word, other = word[1:], other[1:]
    if abs(len(word) - len(other)) > slips:
        return False
    if not word or not other:
        return True
    if not slips:
        return False
    if word[1::-1] == other[:2] and _is_near(word[2:], other[2:], slips - 1):
        return True
    rests = ((word[1:], other), (word, other[1:]), (word[1:], other[1:]))
    return any(_is_near(*rest, slips - 1) for rest in rests)

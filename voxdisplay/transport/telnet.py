"""Telnet's framing (RFC 854): data with IAC doubled, between commands. Knows no socket, no packet.

Servers of serial lines such as ser2net speak it on ports that are named as plain TCP, too. No
packet of protocol.md begins as telnet does: after a COBS code of FF, its header would be of a type
that does not exist.
"""

from __future__ import annotations

IAC, SB, SE = 0xFF, 0xFA, 0xF0
WITH_OPTION = range(0xFB, 0xFF)  # WILL, WONT, DO, DONT
# Binary, echo, suppress go-ahead, terminal type, window size, line mode, COM port control.
OPTIONS = (0, 1, 3, 24, 31, 34, 44)
_NEGOTIATION_BYTES = 3
_ESCAPE = bytes((IAC,))


class TelnetDecoder:
    """Incremental separation of a telnet stream into data and commands."""

    def __init__(self) -> None:
        self._escaped = False  # the last byte was IAC
        self._option = False  # the next byte is the option of a command
        self._within = False  # between IAC SB and IAC SE

    def feed(self, data: bytes) -> tuple[bytes, bytes]:
        """Return the data, unescaped, and the commands as they came."""
        plain, commands = bytearray(), bytearray()
        at = 0
        while at < len(data):
            byte = data[at]
            if self._option:
                commands.append(byte)
                self._option = False
                at += 1
            elif self._escaped:
                self._escaped = False
                at += 1
                if byte == IAC and not self._within:
                    plain.append(byte)
                elif byte != SE or self._within:  # an end without a beginning ends the reader
                    commands += bytes((IAC, byte))
                    self._option = byte in WITH_OPTION
                    self._within = (self._within or byte == SB) and byte != SE
            else:
                end = data.find(_ESCAPE, at)
                self._escaped = end >= 0
                end = end if end >= 0 else len(data)
                (commands if self._within else plain).extend(data[at:end])
                at = end + 1
        return bytes(plain), bytes(commands)


class TelnetDetector:
    """Telnet's escaping on a TCP connection, in force if its server begins with a negotiation.

    Such a server is not answered: it keeps its defaults, which carry all bytes.
    """

    def __init__(self) -> None:
        self._beginning: bytes | None = b""  # None: it is known what is spoken
        self._decoder: TelnetDecoder | None = None

    @property
    def is_telnet(self) -> bool:
        """True once the server has begun as telnet does."""
        return self._decoder is not None

    def received(self, data: bytes) -> bytes:
        """Return the data among received bytes; the first are held back until they are decided."""
        if self._beginning is not None:
            data = self._beginning + data
            if len(data) < _NEGOTIATION_BYTES and _begins_negotiation(data):
                self._beginning = data
                return b""
            self._beginning = None
            if _begins_negotiation(data):
                self._decoder = TelnetDecoder()
        return data if self._decoder is None else self._decoder.feed(data)[0]

    def escaped(self, data: bytes) -> bytes:
        """Return the bytes to send for data."""
        return data.replace(_ESCAPE, 2 * _ESCAPE) if self.is_telnet else data


def _begins_negotiation(data: bytes) -> bool:
    """Return whether bytes are, or may become, IAC, a command and an option that servers use."""
    return all(
        byte in wanted for byte, wanted in zip(data, ((IAC,), WITH_OPTION, OPTIONS), strict=False)
    )

"""Telnet's framing (RFC 854): data with IAC doubled, between commands. Knows no socket, no packet.

Servers of serial lines such as ser2net speak it on ports that are named as plain TCP, too. A device
of protocol.md never begins with what telnet begins with: its first byte after a COBS code of FF
would be the header of a packet of a type that there is not.
"""

from __future__ import annotations

IAC, SB, SE = 0xFF, 0xFA, 0xF0
WITH_OPTION = range(0xFB, 0xFF)  # WILL, WONT, DO, DONT
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
        self._beginning: bytes | None = b""  # None: known what is spoken
        self._decoder: TelnetDecoder | None = None

    @property
    def is_telnet(self) -> bool:
        """True once the server has begun as telnet does."""
        return self._decoder is not None

    def received(self, data: bytes) -> bytes:
        """Return the data among received bytes. A first byte that may be IAC is held back."""
        if self._beginning is not None:
            data = self._beginning + data
            if data in {b"", _ESCAPE}:
                self._beginning = data
                return b""
            self._beginning = None
            if data[0] == IAC and (data[1] in WITH_OPTION or data[1] == SB):
                self._decoder = TelnetDecoder()
        return data if self._decoder is None else self._decoder.feed(data)[0]

    def escaped(self, data: bytes) -> bytes:
        """Return the bytes to send for data."""
        return data.replace(_ESCAPE, 2 * _ESCAPE) if self.is_telnet else data

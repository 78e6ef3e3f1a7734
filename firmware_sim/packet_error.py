"""Refusal of a packet, from its detection to the ERROR that reports it (11)."""


class PacketError(Exception):
    """The packet is refused.

    Parameters
    ----------
    code
        One of ``spec.CODE_*``.
    offset
        Position in the packet, counted from the first byte of its header.
    text
        A few words for a person, at most 59 bytes, so that every ERROR can hold them.
    """

    def __init__(self, code: int, offset: int, text: str) -> None:
        super().__init__(code, offset, text)
        self.code = code
        self.offset = offset
        self.text = text

    def __str__(self) -> str:
        return self.text

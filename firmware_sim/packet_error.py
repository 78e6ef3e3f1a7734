"""Why a packet is refused, on its way from where that is seen to the ERROR that says so (11)."""


class PacketError(Exception):
    """A packet that the device refuses.

    Parameters
    ----------
    code
        One of ``spec.CODE_*``.
    offset
        Where in the packet, counted from its header's first byte.
    text
        For a person: a few words, 59 bytes at most, so that every ERROR holds them.
    """

    def __init__(self, code: int, offset: int, text: str) -> None:
        super().__init__(text)
        self.code = code
        self.offset = offset
        self.text = text

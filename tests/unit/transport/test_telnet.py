"""Recognition of telnet on a TCP connection, and its escaping."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from voxdisplay.transport.telnet import TelnetDetector

# What ser2net 4.3.11 begins with.
NEGOTIATION = bytes.fromhex("fffb03 fffd03 fffb01 fffe01 fffd00 fffb00 fffd2c")


def feed(stream, cuts=()):
    """Return a detector that was fed a stream in pieces, and the data that came out."""
    detector, data, last = TelnetDetector(), b"", 0
    for cut in [*sorted(cuts), len(stream)]:
        data += detector.received(stream[last:cut])
        last = max(last, cut)
    return detector, data


@given(st.binary(max_size=40), st.lists(st.integers(0, 60), max_size=8))
def test_a_server_that_negotiates(data, cuts):
    stream = NEGOTIATION + data.replace(b"\xff", b"\xff\xff")
    detector, got = feed(stream, [cut for cut in cuts if cut <= len(stream)])
    assert got == data
    assert detector.is_telnet
    assert detector.escaped(b"a\xff\xffb") == b"a\xff\xff\xff\xffb"


@pytest.mark.parametrize(
    "beginning",
    [
        b"", b"\0", b"a\xff\xfb\x03", b"\xff\xff\xfb\x03", b"\xff\xfe\xfe\xff", b"\xff\xfb\x02",
        b"\xff\xf0\x03", b"\xff\xfa\x2c", b"\xff\x10\x00",
    ],
)  # fmt: skip
@given(st.binary(min_size=3, max_size=40), st.lists(st.integers(0, 60), max_size=8))
def test_a_server_that_does_not(beginning, data, cuts):
    """Noise of a line at a wrong rate, which is full of FF, is not telnet either."""
    stream = beginning + b"\0" * (not beginning) + data
    detector, got = feed(stream, [cut for cut in cuts if cut <= len(stream)])
    assert got == stream
    assert not detector.is_telnet
    assert detector.escaped(b"\xff") == b"\xff"

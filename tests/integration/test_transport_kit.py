"""Transport kit: every sentence of `Transport`, over every kind of byte pipe."""

import contextlib
import random
import threading
import time

import pytest
from carriers import CARRIERS, WAIT_S

import voxdisplay as vd

EVERY_BYTE = bytes(range(256)) + b"\r\n\x03\x04\x11\x13\x7f\xff\xff\xfa\xf0\x00"
MEGABYTE = random.Random(1).randbytes(1 << 20)


# pyserial's reader of rfc2217:// is a thread of the old style.
pytestmark = [
    pytest.mark.filterwarnings("ignore:set(Daemon|Name)"),
    pytest.mark.parametrize("kind", CARRIERS),
]


@pytest.fixture
def carrier(kind):
    threads = set(threading.enumerate())
    with CARRIERS[kind]() as ends:
        yield ends
    assert set(threading.enumerate()) <= threads, "a thread was left"


def read_all(transport, count):
    data = bytearray()
    deadline_s = time.monotonic() + WAIT_S
    while len(data) < count:
        data += transport.read(1.0)
        assert time.monotonic() < deadline_s, f"{len(data)} of {count} bytes came"
    return bytes(data)


def write_on(transport):
    """Write until it fails: a network learns from the answer that nobody is there."""
    for _ in range(1000):
        transport.write(b"x", 1.0)
        time.sleep(0.001)


def test_nothing_is_nothing(carrier):
    transport, peer = carrier
    transport.write(b"", 1.0)
    assert transport.read(0.0) == b""
    assert transport.read(0.01) == b""
    transport.write(b"x", 1.0)
    assert peer.read(1) == b"x", "and no more than that"


def test_every_byte_goes_through_both_ways(carrier):
    transport, peer = carrier
    transport.write(EVERY_BYTE, 1.0)
    assert peer.read(len(EVERY_BYTE)) == EVERY_BYTE
    peer.write(EVERY_BYTE)
    assert read_all(transport, len(EVERY_BYTE)) == EVERY_BYTE


def test_large(carrier):
    transport, peer = carrier
    data = MEGABYTE
    got = []
    reader = threading.Thread(target=lambda: got.append(peer.read(len(data))))
    reader.start()
    transport.write(data, WAIT_S)
    reader.join(WAIT_S)
    assert got == [data]
    writer = threading.Thread(target=peer.write, args=(data,))
    writer.start()
    assert read_all(transport, len(data)) == data
    writer.join(WAIT_S)


def test_chunks_keep_their_order(carrier):
    transport, peer = carrier
    chance = random.Random(2)
    pieces = [chance.randbytes(chance.choice([1, 2, 63, 64, 65, 300])) for _ in range(60)]
    for piece in pieces[:30]:
        transport.write(piece, 1.0)
    whole = b"".join(pieces[:30])
    assert peer.read(len(whole)) == whole
    for piece in pieces[30:]:
        peer.write(piece)
    whole = b"".join(pieces[30:])
    assert read_all(transport, len(whole)) == whole


def test_interleaved(carrier):
    transport, peer = carrier
    for number in range(50):
        word = number.to_bytes(2, "little") * 20
        transport.write(word, 1.0)
        assert peer.read(len(word)) == word
        peer.write(word[::-1])
        assert read_all(transport, len(word)) == word[::-1]


def test_a_read_waits_for_the_first_byte_and_no_longer(carrier):
    transport, peer = carrier
    writer = threading.Timer(0.05, peer.write, (b"late",))
    writer.start()
    assert transport.read(WAIT_S) in {b"l", b"la", b"lat", b"late"}
    writer.join()


def test_clogged(carrier):
    """Nobody reads there: an error within the deadline, and what was sent before still counts."""
    transport, peer = carrier
    with pytest.raises(vd.TransportTimeout, match=r"took only|takes no"):
        transport.write(bytes(1 << 25), 0.3)
    assert peer.read(1000) == bytes(1000)
    peer.write(b"still here")
    assert read_all(transport, 10) == b"still here"


def test_closed_twice(carrier):
    transport, peer = carrier
    transport.close()
    transport.close()
    for use in (lambda: transport.read(0.0), lambda: transport.write(b"x", 1.0)):
        with pytest.raises(vd.TransportClosed, match=r"closed|gone"):
            use()
    peer.close()


def test_closed_by_the_peer(carrier):
    transport, peer = carrier
    peer.write(b"bye")
    assert read_all(transport, 3) == b"bye"
    peer.close()
    with pytest.raises(vd.TransportClosed, match=r"gone|closed"):
        read_all(transport, 1)
    with pytest.raises(vd.TransportClosed, match=r"gone|closed"):
        write_on(transport)
    transport.close()


def test_closed_by_the_peer_while_we_wait(carrier):
    transport, peer = carrier
    closer = threading.Timer(0.05, peer.close)
    closer.start()
    with pytest.raises(vd.TransportClosed, match=r"gone|closed"):
        read_all(transport, 1)
    closer.join()


def test_waiting_costs_no_core(carrier):
    """Neither for what does not come nor for room that there is not."""
    transport, _ = carrier
    for wait in (
        lambda: transport.read(0.5),
        lambda: transport.write(bytes(1 << 25), 0.5),
    ):
        began_s, used_s = time.monotonic(), time.thread_time()
        with contextlib.suppress(vd.TransportTimeout):
            wait()
        assert time.thread_time() - used_s < 0.5 * (time.monotonic() - began_s)

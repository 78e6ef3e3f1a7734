"""Separation of a telnet stream into data and commands, and its buffer."""

import itertools
import socket
import threading

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from voxdisplay.transport import rfc2217
from voxdisplay.transport.telnet import TelnetDecoder

IAC = b"\xff"
# A few bytes, of which telnet's are many: each means something else after another.
BYTES = st.lists(st.sampled_from([0, 1, 0xF0, 0xF1, 0xFA, 0xFB, 0xFE, 0xFF]), max_size=8).map(bytes)
COMMANDS = st.one_of(
    st.tuples(st.integers(0xFB, 0xFE), st.integers(0, 255)).map(lambda pair: IAC + bytes(pair)),
    BYTES.map(lambda value: IAC + b"\xfa" + value.replace(IAC, IAC + IAC) + IAC + b"\xf0"),
    st.just(IAC + b"\xf1"),
)


@given(st.lists(st.tuples(BYTES, COMMANDS), max_size=5), st.lists(st.integers(0, 60), max_size=8))
def test_data_and_commands_are_parted_wherever_they_are_cut(pieces, cuts):
    sent = b"".join(data.replace(IAC, IAC + IAC) + command for data, command in pieces)
    places = sorted({0, len(sent), *(cut for cut in cuts if cut < len(sent))})
    decoder = TelnetDecoder()
    parted = [decoder.feed(sent[a:b]) for a, b in itertools.pairwise(places)]
    assert b"".join(data for data, _ in parted) == b"".join(data for data, _ in pieces)
    assert b"".join(command for _, command in parted) == b"".join(c for _, c in pieces)


@given(BYTES)
def test_anything_is_taken(noise):
    TelnetDecoder().feed(noise)


def test_an_end_without_a_beginning_is_nothing():
    assert TelnetDecoder().feed(b"a\xff\xf0b") == (b"ab", b"")


@pytest.fixture
def command_socket():
    ours, theirs = socket.socketpair()
    with theirs:
        command_socket = rfc2217._CommandSocket(ours)
        yield command_socket, theirs
        command_socket.close()


def test_no_more_is_taken_than_is_read(command_socket, monkeypatch):
    monkeypatch.setattr(rfc2217, "_MAX_BUFFERED_BYTES", 10)
    command_socket, theirs = command_socket
    reader = threading.Thread(target=command_socket.recv, args=(1,))
    reader.start()
    theirs.sendall(b"0123456789")
    assert command_socket.read_data(10, 20) == b"0123456789"
    theirs.sendall(b"0123456789ab")
    assert command_socket.read_data(5, 20) == b"01234"
    assert command_socket.read_data(7, 20) == b"56789ab"
    theirs.close()
    reader.join(20)
    assert not reader.is_alive()


def test_who_waits_is_woken_at_the_end_and_gets_what_has_come(command_socket):
    command_socket, theirs = command_socket
    theirs.sendall(b"bye\xff\xf1")
    assert command_socket.recv(1) == b"\xff\xf1"
    threading.Timer(0.01, command_socket.mark_ended).start()
    assert command_socket.read_data(5, 20) == b"bye"
    with pytest.raises(serial.SerialException, match="closed the connection"):
        command_socket.read_data(1, 20)


def test_a_socket_that_the_server_has_reset_is_closed(command_socket):
    """Pyserial gives up closing when `shutdown` fails."""
    socket_, theirs = command_socket
    theirs.close()
    socket_._inner.shutdown(socket.SHUT_RDWR)
    socket_._inner.close()
    socket_.shutdown(socket.SHUT_RDWR)
    assert socket_._ended

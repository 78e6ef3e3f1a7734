"""Ways out: what is refused, and receivers that are not there."""

import errno
import os
import socket
import threading

import pytest
from light_receivers import TcpReceiver, UdpReceiver

import voxdisplay as vd
from voxdisplay.sinks import hosts, outputs
from voxdisplay.sinks.outputs import SerialOutput, TcpOutput, UdpOutput


def packets(*contents):
    return [memoryview(content) for content in contents]


def udp(host="127.0.0.1", number=9, **settings):
    settings = {"broadcast": False, "timeout_s": 2.0} | settings
    return UdpOutput("test://", host, number, **settings)


def test_datagrams_arrive_in_bursts():
    receiver, pauses = UdpReceiver(), []
    output = udp(number=receiver.number, sleep=pauses.append)
    sent = [bytes([number, 1]) for number in range(70)]
    output.send(packets(*sent))
    assert receiver.await_count(70) == sent
    assert len(pauses) == 2
    output.close()
    output.close()
    receiver.close()


@pytest.mark.parametrize("host", ["255.255.255.255", "127.255.255.255"])
def test_broadcast_is_refused_unless_asked_for(host):
    with pytest.raises(vd.OpenError, match="broadcast address") as refused:
        udp(host)
    assert "broadcast=yes" in refused.value.hint
    udp(host, broadcast=True).close()


@pytest.mark.parametrize("host", ["239.255.0.1", "ff02::1"])
def test_multicast_is_refused_unless_asked_for(host):
    with pytest.raises(vd.OpenError, match="multicast address") as refused:
        udp(host)
    assert "broadcast=yes" in refused.value.hint


def test_multicast_goes_to_the_group_of_each_packet():
    output = udp("239.255.0.1", 5568, broadcast=True, groups=["239.255.0.1", "239.255.0.2"])
    sent = []

    class Recorder:
        def sendto(self, packet, address):
            sent.append((bytes(packet), address))

        def close(self):
            pass

    output._socket.close()
    output._socket = Recorder()
    output.send(packets(b"a", b"b"))
    assert sent == [(b"a", ("239.255.0.1", 5568)), (b"b", ("239.255.0.2", 5568))]


def test_no_host_has_the_address_of_all():
    with pytest.raises(vd.OpenError, match=r"0\.0\.0\.0 is no receiver's address"):
        udp("0.0.0.0")  # noqa: S104 - refused


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as placeholder:
        placeholder.bind(("127.0.0.1", 0))
        return placeholder.getsockname()[1]


def test_a_host_on_which_nothing_listens():
    output = udp(number=free_port(socket.SOCK_DGRAM))
    with pytest.raises(vd.TransportClosed, match="nothing listens there"):
        output.send(packets(b"one"))
    output.close()


@pytest.mark.parametrize("open_output", [udp, lambda host: TcpOutput("t:", host, 9, timeout_s=5)])
def test_a_name_that_no_host_has(open_output, monkeypatch):
    def unknown(*_arguments, **_settings):
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(vd.OpenError, match=r"'cube\.invalid' is not known") as failure:
        open_output("cube.invalid")
    assert "name of the host" in failure.value.hint


def test_a_name_server_that_does_not_answer(monkeypatch):
    release = threading.Event()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_args, **_kw: release.wait() and [])
    with pytest.raises(vd.OpenError, match=r"not resolved in 0\.05 s"):
        hosts.resolve_host("t:", "cube", 1, socket.SOCK_DGRAM, 0.05)
    release.set()


def test_a_network_that_is_full_is_waited_for_and_then_an_error():
    waits = []
    output = udp(timeout_s=0.05, sleep=waits.append)
    output._socket.close()

    class Full:
        def send(self, _packet):
            raise OSError(errno.ENOBUFS, os.strerror(errno.ENOBUFS))

        def close(self):
            pass

    output._socket = Full()
    with pytest.raises(vd.TransportTimeout, match="took no more datagrams"):
        output.send(packets(b"one"))
    assert waits


def test_messages_go_one_by_one_and_the_end_waits():
    receiver, pauses = TcpReceiver(), []
    output = TcpOutput("t:", "127.0.0.1", receiver.number, timeout_s=2, sleep=pauses.append)
    output.send(packets(b"one", b"two"))
    assert receiver.await_bytes(6) == b"onetwo"
    output.close()
    output.close()
    assert receiver.ended.wait(20)
    assert pauses == [0.001, 0.05]
    receiver.close()


def test_nothing_accepts_the_connection():
    with pytest.raises(vd.OpenError, match="cannot be opened") as failure:
        TcpOutput("t:", "127.0.0.1", free_port(socket.SOCK_STREAM), timeout_s=2)
    assert "running there" in failure.value.hint


def test_a_receiver_that_hangs_up():
    server = socket.create_server(("127.0.0.1", 0))
    output = TcpOutput("t:", "127.0.0.1", server.getsockname()[1], timeout_s=2)
    client, _ = server.accept()
    output.send(packets(b"one"))
    client.close()
    with pytest.raises(vd.TransportClosed, match="is gone"):  # noqa: PT012 - the news may take a moment
        for _ in range(1000):
            output.send(packets(b"two"))
    output.close()
    server.close()


def test_a_receiver_that_does_not_read():
    server = socket.create_server(("127.0.0.1", 0))
    output = TcpOutput("t:", "127.0.0.1", server.getsockname()[1], timeout_s=0.1)
    with pytest.raises(vd.TransportTimeout, match="did not take a frame"):
        output.send(packets(bytes(1 << 26)))
    with pytest.raises(vd.TransportClosed):
        output.send(packets(b"half a message was sent"))
    server.close()


def test_a_board_is_heard_before_it_is_sent_to(monkeypatch):
    class Board:
        def __init__(self, device, *, baud, reset):
            events.append((device, baud, reset))
            self.greeting = [b"noise A", b"da\n", b""]

        def read(self, _timeout_s):
            events.append("read")
            return self.greeting.pop(0)

        def write(self, data, timeout_s):
            events.append((bytes(data), timeout_s))

        def drain(self, _timeout_s):
            events.append("drain")

        def close(self):
            events.append("close")

    events = []
    monkeypatch.setattr(outputs, "SerialTransport", Board)
    output = SerialOutput("tty", baud=100, reset=False, timeout_s=3, greeting=b"Ada\n")
    output.send(packets(b"0123456789"))
    output.close()
    assert events == [
        ("tty", 100, False), "read", "read", (b"0123456789", 4.0), "drain", "close",
    ]  # fmt: skip

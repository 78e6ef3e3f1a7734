"""Receivers of lighting protocols on 127.0.0.1, read byte by byte as their documents say."""

import contextlib
import socket
import threading
import time

DEADLINE_S = 20


class UdpReceiver:
    """Socket that keeps all datagrams."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(("127.0.0.1", 0))
        self.number = self.socket.getsockname()[1]
        self.datagrams = []
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()

    def _receive(self):
        with contextlib.suppress(OSError):
            while datagram := self.socket.recv(65536):
                self.datagrams.append(datagram)

    def await_count(self, count):
        """Wait for so many datagrams and return them."""
        deadline_s = time.monotonic() + DEADLINE_S
        while len(self.datagrams) < count and time.monotonic() < deadline_s:
            time.sleep(0.005)
        return list(self.datagrams)

    def close(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as waker:
            waker.sendto(b"", ("127.0.0.1", self.number))  # an empty one ends the thread
        self._thread.join(DEADLINE_S)
        self.socket.close()


class TcpReceiver:
    """Server that keeps what its clients send, one after the other."""

    def __init__(self, number=0):
        self.server = socket.create_server(("127.0.0.1", number))
        self.number = self.server.getsockname()[1]
        self.data = bytearray()
        self.ended = threading.Event()
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()

    def _receive(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self.server.accept()
                with client:
                    while data := client.recv(65536):
                        self.data += data
                self.ended.set()

    def await_bytes(self, count):
        """Wait for so many bytes and return all."""
        deadline_s = time.monotonic() + DEADLINE_S
        while len(self.data) < count and time.monotonic() < deadline_s:
            time.sleep(0.005)
        return bytes(self.data)

    def close(self):
        self.server.shutdown(socket.SHUT_RDWR)
        self.server.close()
        self._thread.join(DEADLINE_S)


def art_dmx(datagram):
    """Return universe and slots of an ArtDmx; None of another packet."""
    assert datagram[:8] == b"Art-Net\0"
    assert datagram[10:12] == bytes([0, 14])
    if datagram[8:10] != bytes([0x00, 0x50]):
        return None
    slots = datagram[18:]
    assert len(slots) == datagram[16] * 256 + datagram[17]
    assert len(slots) in range(2, 513, 2)
    return datagram[15] * 256 + datagram[14], slots


def sacn_data(datagram):
    """Return universe and slots of an sACN data packet; None of another packet."""
    assert datagram[4:16] == b"ASC-E1.17\0\0\0"
    if datagram[21] != 4:
        return None
    assert datagram[125] == 0, "START code"
    slots = datagram[126:]
    assert datagram[123] * 256 + datagram[124] == 1 + len(slots)
    return datagram[113] * 256 + datagram[114], slots


def ddp_bytes(datagrams):
    """Return the buffer that DDP packets fill, and whether the last one alone has PUSH."""
    memory = bytearray()
    for datagram in datagrams:
        offset = int.from_bytes(datagram[4:8], "big")
        data = datagram[10:]
        assert len(data) == int.from_bytes(datagram[8:10], "big")
        memory[offset : offset + len(data)] = data
    pushes = [datagram[0] & 1 for datagram in datagrams]
    return bytes(memory), pushes == [0] * (len(datagrams) - 1) + [1]


def dnrgb_bytes(datagrams):
    """Return the LEDs that WLED's DNRGB packets set."""
    memory = bytearray()
    for datagram in datagrams:
        assert datagram[0] == 4
        first = datagram[2] * 256 + datagram[3]
        memory[3 * first : 3 * first + len(datagram) - 4] = datagram[4:]
    return bytes(memory)


def opc_messages(stream):
    """Return channel and data of the messages in a stream."""
    messages = []
    while stream:
        assert stream[1] == 0
        size = stream[2] * 256 + stream[3]
        messages.append((stream[0], stream[4 : 4 + size]))
        stream = stream[4 + size :]
    return messages

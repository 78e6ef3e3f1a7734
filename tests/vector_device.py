"""Emulated device for the vectors of protocol.md: packets in, packets out, and its front page."""

from __future__ import annotations

import document

from firmware_sim import crc, sender
from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.receiver import Receiver
from voxdisplay.wire import spec

HELLO = bytes.fromhex("30 00 00 01 17 5A 00 00")


class VectorDevice:
    """An emulated device that is sent packets made by hand."""

    def __init__(self, grid, pixel_format, *, refresh=0, **config):
        self.device = Device(
            Config(grid=grid, pixel_format=pixel_format.lower(), refresh=refresh, **config)
        )
        self.bench = Bench(self.device)

    def send_raw(self, data):
        """Send bytes to the device; return header and payload of each packet that it sends."""
        self.device.receive(data)
        return document.off_wire(self.device.transmit())

    def send(self, packet):
        """Send a packet, given without its check value, to the device."""
        return self.send_raw(document.on_wire(packet))

    def open_session(self):
        (info,) = self.send(HELLO)
        assert info[0] == 0x90

    def tick(self):
        self.device.tick()
        return document.off_wire(self.device.transmit())

    def lit_voxels(self):
        """The front page's voxels that are not dark, with their pixels."""
        snapshot = self.bench.snapshot()
        nx, ny, _ = snapshot.grid
        size = document.pixel_bytes()[getattr(spec, f"FORMAT_{snapshot.pixel_format.upper()}")]
        lit, pixels = {}, snapshot.pixels  # put together when they are asked for
        for index in range(len(pixels) // size):
            pixel = pixels[index * size : (index + 1) * size]
            if any(pixel):
                lit[index % nx, index // nx % ny, index // nx // ny] = pixel
        return lit

    @staticmethod
    def cobs_encode(data):
        return sender.encode_segment(data)[:-1]

    @staticmethod
    def cobs_decode(segment):
        """Return what the receiver decodes from a segment to which a check value was added."""
        receiver = Receiver(70000)
        body = document.cobs_decode(segment)
        data = document.on_wire(body)
        receiver.read(data, 0)
        if len(data) > spec.LIMIT_MIN_SEGMENT:
            assert receiver.packet is not None
            return receiver.packet
        return body

    @staticmethod
    def crc(data):
        return crc.crc32(data)

    @staticmethod
    def segments(data):
        """Header and payload of the packets that the receiver finds."""
        receiver = Receiver(70000)
        found, at = [], 0
        while at < len(data):
            at = receiver.read(data, at)
            if receiver.packet is not None:
                found.append(receiver.packet)
        return found

    @staticmethod
    def wire(body):
        return sender.encode_packet(body[0] >> 4, body[0] & 15, body[1], body[2], body[3:])


EVERY_FORMAT = {"LINE", "BOX", "DOTS", "OCT", "ARC", "ARC2", "READ", "DIGEST", "SLABS"}
ONLY_INDEX8 = {"DIFF", "PALETTE"}
NOT_MONO1 = {"FADE", "VALUES"}


def features_of(vector, otherwise=None):
    """Names of the features of a vector's device, in lower case, as the device's Config has them.

    Without a line ``features``, ``otherwise``; or all that the format allows.
    """
    text = dict(vector.lines).get("features")
    if text is not None:
        names = set(text.split("|"))
    elif otherwise is not None:
        names = otherwise
    else:
        names = EVERY_FORMAT | (ONLY_INDEX8 if vector["format"] == "INDEX8" else set())
        names = names | (NOT_MONO1 if vector["format"] != "MONO1" else set())
    return frozenset(name.lower() for name in names)


def device_of_dialogue(vector):
    """The device that a ``dialogue`` vector describes."""
    facts = dict(vector.lines)
    return VectorDevice(
        vector.grid,
        facts["format"],
        boot=int(facts["boot"]),
        max_payload=int(facts["max_payload"]),
        rx_buffer=int(facts["rx_buffer"]),
        refresh=int(facts["refresh"]),
        features=features_of(vector, {"READ", "DIGEST"}),
        name=facts["name"].strip('"'),
        firmware=facts["firmware"].strip('"'),
        serial=facts["serial"].strip('"'),
    )


def hold_ops(vector):
    """Assert that the device draws what an ``ops`` vector says."""
    device = VectorDevice(vector.grid, vector["format"], features=features_of(vector))
    device.open_session()
    answers = device.send(bytes((0x15, 0, 0)) + vector.hex("ops"))
    assert [state_of(answer) for answer in answers] == ["ACK SHOWN"]
    assert device.lit_voxels() == vector.voxels()
    assert int.from_bytes(answers[0][16:20], "little") == vector.integer("digest")


def hold_refused(vector):
    """Assert that the device refuses what a ``refused`` vector says, and ends the session."""
    device = VectorDevice(vector.grid, vector["format"], features=features_of(vector))
    device.open_session()
    (answer,) = device.send(bytes((0x15, 0, 0)) + vector.hex("ops"))
    assert answer[0] == 0xB0
    assert answer[3] == getattr(spec, f"CODE_{vector['code']}")
    assert int.from_bytes(answer[6:8], "little") == vector.integer("offset")
    assert device.lit_voxels() == {}
    (after,) = device.send(bytes((0x40, 9, 0)))
    assert after[3] == spec.CODE_NO_SESSION


def hold_dialogue(vector):
    """Assert that the device answers as a ``dialogue`` vector says."""
    document.hold_dialogue(vector.lines, device_of_dialogue(vector))


def flags_of(text, group):
    """Read flags as the document writes them: ``CLEAR|COMMIT``, or ``-``."""
    names = [] if text == "-" else text.split("|")
    return sum(getattr(spec, f"{group}_{name}") for name in names)


def state_of(answer):
    """Return the flags of an ACK in words, for messages."""
    if answer[0] >> 4 != spec.TYPE_ACK:
        return answer.hex(" ")
    names = [
        name
        for name in ("SHOWN", "PENDING", "ASKED")
        if answer[0] & getattr(spec, f"ACK_FLAG_{name}")
    ]
    return " ".join(["ACK", *names])

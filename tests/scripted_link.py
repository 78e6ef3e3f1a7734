"""Link whose device is scripted: answers are written by hand."""

import dataclasses

from voxdisplay.link import FrameShown, Link, SessionOpened
from voxdisplay.wire import packet as packets
from voxdisplay.wire.packet_stream import PacketStream

SESSION, BOOT = 23063, 45063
INFO = packets.Info(
    major=1, session=SESSION, boot=BOOT, minor=0, format=2, nx=3, ny=5, nz=7, pages=2,
    max_payload=96, rx_buffer=512, refresh=0, features=0b110000000,
)  # fmt: skip


def ack(following=0, last=255, **fields):
    given = {"session": SESSION, "boot": BOOT, "received": 0, "credit": 512, "digest": 0}
    return packets.Ack(seq=following, last=last, **given | {"damaged": 0} | fields)


def transmit(link, now):
    """Packets that the link sends at a moment."""
    return list(PacketStream().feed(link.transmit(now)))


def receive(link, packet, now):
    return link.receive(packets.encode(packet), now)


def open_link(**info):
    link = Link(SESSION, 0.0)
    assert [type(packet) for packet in transmit(link, 0.0)] == [packets.Hello]
    given = dataclasses.replace(INFO, **info)
    assert receive(link, given, 0.0) == [SessionOpened(given)]
    return link


def show_frame(link, number=0, now=0.0):
    """Show a frame of one packet, the first of a session; return what stands for it."""
    ticket = link.present([b"\xa0"])
    transmit(link, now)
    assert receive(link, ack(1, 0, frame=number, flags=1), now) == [FrameShown(ticket, 0)]
    return link.displayed

"""Devices that break section 10: READ and PAGE."""

from __future__ import annotations

from broken_devices.mutant import Device, around, mutant
from firmware_sim import device, spec


def _read(patch, change):
    def read(old, self, packet, flags, seq, frame):
        packet, flags, seq, frame = change(self, packet, flags, seq, frame)
        old(self, packet, flags, seq, frame)

    around(patch, Device, "_read", read)


@mutant("10/back-page-pending", "10/ranges", "10/back-page", likely="off by")
def read_off_by_one(patch):
    old = device.encode_page

    def pack(page, pixel_format, start, count, room):
        shift = 1 if start + count < page.volume else 0
        return old(page, pixel_format, start + shift, count, room)

    patch.setattr(device, "encode_page", pack)


@mutant("10/page-fields")
def page_without_its_flag(patch):
    def _send(old, self, kind, flags, *rest):
        old(self, kind, 0 if kind == spec.TYPE_PAGE else flags, *rest)

    around(patch, Device, "_send", _send)


@mutant("10/page-fields")
def page_without_its_tag(patch):
    def _send(old, self, kind, flags, seq, *rest):
        old(self, kind, flags, 0 if kind == spec.TYPE_PAGE else seq, *rest)

    around(patch, Device, "_send", _send)


@mutant("10/back-page-pending", "10/back-page")
def back_reads_the_front(patch):
    old = device.encode_page
    patch.setattr(device, "encode_page", old)

    def read(inner, self, packet, flags, seq, frame):
        memory_ = self.memory
        back, memory_.back = memory_.back, memory_.front
        try:
            inner(self, packet, flags, seq, frame)
        finally:
            memory_.back = back

    around(patch, Device, "_read", read)


@mutant()
def page_count_of_the_read(patch):
    def _send(old, self, kind, flags, seq, frame, payload):
        if kind == spec.TYPE_PAGE:
            payload = payload[:5] + self.asked + payload[9:]
        old(self, kind, flags, seq, frame, payload)

    around(patch, Device, "_send", _send)

    def read(old, self, packet, *rest):
        self.asked = packet[8:12]
        old(self, packet, *rest)

    around(patch, Device, "_read", read)


@mutant("10/read-fields", "11/order-of-read")
def read_of_nothing_taken(patch):
    def change(self, packet, flags, seq, frame):
        if len(packet) == 12 and not any(packet[8:12]):
            packet = packet[:4] + bytes(4) + b"\1\0\0\0"
        return packet, flags, seq, frame

    _read(patch, change)


@mutant("10/read-outside")
def read_sum_overflows(patch):
    def change(self, packet, flags, seq, frame):
        start = int.from_bytes(packet[4:8], "little")
        count = int.from_bytes(packet[8:12], "little")
        if start + count > 0xFFFFFFFF and (start + count) & 0xFFFFFFFF <= 105:
            packet = packet[:4] + bytes(4) + b"\1\0\0\0"
        return packet, flags, seq, frame

    _read(patch, change)


@mutant("10/read-length", "11/order-of-read")
def longer_read_taken(patch):
    _read(patch, lambda self, packet, *rest: (packet[:12], *rest))


@mutant("10/read-refused", features=frozenset(("digest",)))
def read_answered_unannounced(patch):
    def init(old, self, config):
        old(self, config)
        self._features |= 1 << spec.FEATURE_READ

    around(patch, Device, "__init__", init)

"""Devices that break sections 3 and 4: delimiting and the packet format."""

from __future__ import annotations

from broken_devices.mutant import Device, Receiver, around, mutant
from firmware_sim import crc, device, receiver, sender, spec


@mutant(
    "3/shortest-damage",
    "3/bit-errors",
    "3/merged-packets",
    "3/resync",
    "9/last-at-first",
    "9/damage-answered",
    "9/damage-unanswered",
    "9/damage-stays",
    "12/noise",
    "12/mutated",
)
def crc_not_checked(patch):
    def end(old, self):
        old(self)
        whole = self.size >= spec.LIMIT_MIN_SEGMENT and not (self._left or self._too_long)
        if whole and self._length >= 7:
            self.packet = bytes(self._buffer[: self._length - 4])
            self.damaged = False

    around(patch, Receiver, "_end", end)


@mutant("3/short-segments", "3/bit-errors", "3/cut-packets", "12/noise")
def short_segments_counted(patch):
    patch.setattr(receiver.spec, "LIMIT_MIN_SEGMENT", 5)


@mutant("3/shortest-damage", spreads=True)
def segment_of_8_forgiven(patch):
    patch.setattr(receiver.spec, "LIMIT_MIN_SEGMENT", 9)


@mutant("3/empty-segments", "9/damage-unanswered", "9/damage-stays", "12/noise", "12/mutated")
def empty_segments_counted(patch):
    def end(old, self):
        old(self)
        if not self.size:
            self.damaged = True

    around(patch, Receiver, "_end", end)


@mutant("3/cobs-overrun", "3/bit-errors")
def cobs_overrun_forgiven(patch):
    def end(old, self):
        self._left = 0
        old(self)

    around(patch, Receiver, "_end", end)


@mutant(
    "11/overrun",
    "3/shortest-damage",
    "3/cobs-overrun",
    "3/bit-errors",
    "3/cut-packets",
    "3/merged-packets",
    "3/resync",
    "3/too-long",
    "9/damage-answered",
    "9/damage-unanswered",
    "12/noise",
    "12/mutated",
)
def damage_not_counted(patch):
    def damage(old, self):
        old(self)
        self.damaged -= 1

    around(patch, Device, "_count_damaged", damage)


@mutant("9/last-at-first", "9/damage-answered", "12/noise", "12/mutated")
def damage_not_answered(patch):
    def damage(_, self):
        self.damaged += 1

    around(patch, Device, "_count_damaged", damage)


@mutant("3/shortest-damage", "9/damage-answered", "3/resync", spreads=True)
def damage_ends_the_session(patch):
    def damage(old, self):
        old(self)
        self.session = None

    around(patch, Device, "_count_damaged", damage)


@mutant("3/longest-packet", "3/cobs-groups", "7.6/colors", "9.2/returned", "11/overrun")
def longest_packet_too_long(patch):
    around(patch, Receiver, "__init__", lambda old, self, longest: old(self, longest - 1))


@mutant("3/too-long")
def too_long_taken(patch):
    around(patch, Receiver, "__init__", lambda old, self, longest: old(self, longest + 1))


@mutant("10/dense-page", "4/answers-checked", "4/answers-length")
def answers_in_short_groups(patch):
    patch.setattr(sender, "_GROUP", 100)


@mutant(
    "5/front-page-stays",
    "10/back-page-pending",
    "10/whole-page",
    "10/ranges",
    "10/page-fields",
    "10/page-frame",
    "10/back-page",
    "10/dense-page",
    "4/answers-checked",
    "4/answers-length",
)
def answers_with_another_check_value(patch):
    def send(kind, flags, seq, frame, payload):
        packet = bytes((kind << 4 | flags, seq, frame)) + payload
        check = crc.crc32(packet) ^ (0 if kind != spec.TYPE_PAGE else 1)
        return sender.encode_segment(packet + check.to_bytes(4, "little"))

    patch.setattr(device, "encode_packet", send)


@mutant("3/answers-delimited")
def debugging_text_between(patch):
    def refuse(old, self, *args):
        self._out += b"refused\r\n\0"
        old(self, *args)

    around(patch, Device, "_send_error", refuse)


@mutant("4/reserved-types", "11/session-ends", "11/error-names-packet", "11/error-session")
def reserved_types_silent(patch):
    def answer(old, self, packet):
        if packet[0] >> 4 in {0, 12}:
            return
        old(self, packet)

    around(patch, Device, "_process", answer)


@mutant("6/waits-unchecked", "4/data-flags", "11/order-of-packet")
def reserved_data_flags_taken(patch):
    patch.setattr(device, "_DATA_FLAGS", 15)


@mutant("4/status-fields", "11/error-names-packet")
def status_fields_taken(patch):
    def status(old, self, packet, flags, seq, frame):
        old(self, packet, 0, seq, 0)

    around(patch, Device, "_status", status)


@mutant("4/read-fields", "11/order-of-read")
def read_reserved_taken(patch):
    def read(old, self, packet, flags, seq, frame):
        old(self, packet[:3] + b"\0" + packet[4:], flags, seq, frame)

    around(patch, Device, "_read", read)


@mutant("4/answers-reserved")
def reserved_flag_sent(patch):
    def _send(old, self, kind, flags, *rest):
        old(self, kind, flags | (8 if kind == spec.TYPE_ACK else 0), *rest)

    around(patch, Device, "_send", _send)


@mutant("3/any-pieces")
def pieces_are_packets(patch):
    around(
        patch, Device, "receive", lambda old, self, data: data.endswith(b"\0") and old(self, data)
    )


@mutant("4/answers-length", max_payload=64, name="a")
def page_too_long(patch):
    old = device.encode_page
    patch.setattr(device, "encode_page", lambda *args: old(*args[:-1], args[-1] + 20))


@mutant("4/answers-whole")
def unknown_answers(patch):
    def refuse(old, self, *args):
        self._send(12, 0, 0, 0, b"refused")
        old(self, *args)

    around(patch, Device, "_send_error", refuse)

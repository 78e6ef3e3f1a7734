"""Devices that break section 5: HELLO and INFO."""

from __future__ import annotations

import dataclasses

from broken_devices.mutant import Device, Session, around, mutant, on_hello
from firmware_sim import device, info, memory, spec
from firmware_sim.packet_error import PacketError
from firmware_sim.session import BackPage


def _announce(patch, **changes):
    old = info.make_announcement
    patch.setattr(
        device, "make_announcement", lambda *args: dataclasses.replace(old(*args), **changes)
    )


@mutant("5/info-fields", "9.2/returned")
def rx_buffer_too_small(patch):
    _announce(patch, credit=300)


@mutant("5/info-fields")
def unknown_feature(patch):
    _announce(patch, features=0x8000_0FFF)


@mutant("5/info-fields")
def features_of_a_later_minor(patch):
    _announce(patch, minor=0)


@mutant("5/info-fields")
def one_page(patch):
    patch.setattr(memory.Memory, "PAGES", 1)


@mutant("5/info-strings")
def name_no_utf8(patch):
    _announce(patch, strings=b"\x02\xff\xfe\x01x\x00")


@mutant("5/info-strings")
def strings_cut_off(patch):
    _announce(patch, strings=b"\x02ab\x01x")


@mutant("5/new-session", spreads=True)
def hello_keeps_the_session(patch):
    def change(self, packet, session):
        if session and self.session and packet[3] == 1:
            session.number = self.session.number
            self.session = session

    on_hello(patch, change)


@mutant("5/front-page-stays", "5/keep-in-new-session", "11/frame-dropped")
def hello_clears_the_front_page(patch):
    on_hello(patch, lambda self, packet, session: self.memory.front.clear())


@mutant("5/new-session", "5/front-page-stays", spreads=True)
def hello_keeps_shown(patch):
    def change(self, packet, session):
        if session and self.session is not session:
            self.session.shown = session.shown

    on_hello(patch, change)


@mutant("5/pending-dropped")
def hello_shows_what_was_pending(patch):
    def hello(old, self, packet):
        if self.pending:
            self.memory.swap()
        old(self, packet)

    around(patch, Device, "_hello", hello)


@mutant("5/other-major", "5/other-major-first")
def other_major_opens(patch):
    def hello(old, self, packet):
        old(self, packet[:3] + b"\1" + packet[4:])

    around(patch, Device, "_hello", hello)


@mutant("5/other-major", "5/other-major-first", "5/session-zero")
def other_major_unanswered(patch):
    def hello(old, self, packet):
        if len(packet) < 8 or packet[3] == 1:
            old(self, packet)

    around(patch, Device, "_hello", hello)


@mutant("5/hello-ignored")
def longer_hello_refused(patch):
    def hello(old, self, packet):
        if len(packet) > 8:
            raise PacketError(spec.CODE_LENGTH, 0, "")
        old(self, packet)

    around(patch, Device, "_hello", hello)


@mutant("5/hello-ignored")
def hello_fields_checked(patch):
    def hello(old, self, packet):
        if packet[1] or packet[7:8] > b"\0":
            raise PacketError(spec.CODE_FIELD, 1, "")
        old(self, packet)

    around(patch, Device, "_hello", hello)


@mutant("5/hello-short", "11/refused-hello", "11/order-of-packet")
def short_hello_taken(patch):
    around(patch, Device, "_hello", lambda old, self, packet: old(self, packet.ljust(8, b"\0")))


@mutant("5/session-zero", "11/refused-hello")
def session_zero_taken(patch):
    def hello(old, self, packet):
        try:
            old(self, packet)
        except PacketError as refusal:
            if refusal.code != spec.CODE_FIELD:
                raise
            self.session = Session(0)
            self._send(spec.TYPE_INFO, 0, 0, 0, self._announcement.payload(0))

    around(patch, Device, "_hello", hello)


@mutant("5/filling-dropped")
def hello_shows_what_was_begun(patch):
    def hello(old, self, packet):
        if self.session and self.session.state is BackPage.FILLING:
            self.memory.swap()
        old(self, packet)

    around(patch, Device, "_hello", hello)


@mutant("5/info-same")
def info_changes(patch):
    def hello(old, self, packet):
        credit = self._announcement.credit + 1
        self._announcement = dataclasses.replace(self._announcement, credit=credit)
        old(self, packet)

    around(patch, Device, "_hello", hello)

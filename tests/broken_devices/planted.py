"""Devices that behave well until something is under way: what waits, is lost, or is repeated."""

from __future__ import annotations

from broken_devices.mutant import Device, Session, around, mutant
from firmware_sim import device, spec
from firmware_sim.packet_error import PacketError
from firmware_sim.session import BackPage


def _credit(patch, left):
    """Grant in each ACK what ``left`` returns for the device."""

    def _send(old, self, kind, flags, seq, frame, payload):
        if kind == spec.TYPE_ACK:
            values = list(device._ACK.unpack(payload))
            values[4] = left(self)
            payload = device._ACK.pack(*values)
        old(self, kind, flags, seq, frame, payload)

    around(patch, Device, "_send", _send)


@mutant("9.2/answers-credit")
def credit_of_the_free_room(patch):
    _credit(patch, lambda self: self.free_bytes)


@mutant("9.2/answers-credit")
def credit_halved_while_pending(patch):
    _credit(patch, lambda self: self.config.rx_buffer // (2 if self.pending else 1))


@mutant("6/swaps-at-a-tick")
def swap_at_once_in_spite_of_the_tick(patch):
    def data(old, self, session, *args):
        old(self, session, *args)
        if self.pending:
            self._swap(session)
            self._acknowledge()

    around(patch, Device, "_data", data)


@mutant("5/front-page-stays")
def hello_clears_the_page_and_keeps_its_digest(patch):
    def hello(old, self, packet):
        old(self, packet)
        self.memory.front.stored.clear()

    around(patch, Device, "_hello", hello)


@mutant("6/waits-unchecked")
def reserved_flag_refused_while_pending(patch):
    def must_wait(old, self, seq, frame):
        waits = old(self, seq, frame)
        if waits and Session.flags & ~(spec.DATA_FLAG_CLEAR | spec.DATA_FLAG_COMMIT):
            raise PacketError(spec.CODE_FIELD, 0, "")
        return waits

    _refuse_while_pending(patch, must_wait)


@mutant("6/waits-unchecked")
def number_refused_while_pending(patch):
    def must_wait(old, self, seq, frame):
        waits = old(self, seq, frame)
        if waits and self._ahead(seq) >= spec.LIMIT_WINDOW:
            raise PacketError(spec.CODE_SEQUENCE, 1, "")
        return waits

    _refuse_while_pending(patch, must_wait)


def _refuse_while_pending(patch, must_wait):
    around(patch, Session, "must_wait", must_wait)

    def dispatch(old, self, packet):
        Session.flags = packet[0] & 15
        try:
            old(self, packet)
        except PacketError as refusal:
            self._send_error(packet[1], packet[2], refusal)
            self.session = None

    patch.setattr(Session, "flags", 0, raising=False)
    around(patch, Device, "_dispatch", dispatch)


@mutant(
    "6/next-waits",
    "6/waits-unchecked",
    "6/all-waits",
    "9.2/room-is-there",
    "9.2/zeros-between",
)
def status_overtakes_what_waits(patch):
    def receive(old, self, data):
        if self._deferred and data.startswith(b"\x03\x40"):
            self._acknowledge(tag=data[2])
            return
        old(self, data)

    around(patch, Device, "receive", receive)


@mutant("9.1/duplicate-while-pending")
def duplicate_of_another_frame_waits(patch):
    def must_wait(_, self, seq, frame):
        return self.state is BackPage.PENDING and frame != self._newest

    around(patch, Session, "must_wait", must_wait)


@mutant("11/overrun")
def lost_bytes_are_no_damage(patch):
    def store(old, self, data):
        damaged = self.damaged
        old(self, data)
        self.damaged = damaged

    around(patch, Device, "_store", store)


@mutant("9.2/zeros-between", "11/overrun")
def zeros_take_room(patch):
    def store(old, self, data):
        room = self.free_bytes
        old(self, data[:room])
        if len(data) > room and not self._overrun:
            old(self, bytes([1]) * self.config.rx_buffer)

    around(patch, Device, "_store", store)


@mutant("10/back-page-pending")
def back_page_of_a_pending_frame_is_dark(patch):
    def read(old, self, *args):
        back = self.memory.back
        if self.pending:
            self.memory.back = type(back)(back.volume, back.pixel_size)
        try:
            old(self, *args)
        finally:
            self.memory.back = back

    around(patch, Device, "_read", read)

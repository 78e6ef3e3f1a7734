"""Devices that break section 9: ACK, window and credit."""

from __future__ import annotations

from broken_devices.mutant import Device, Session, around, mutant, on_hello
from firmware_sim import device, spec
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.packet_error import PacketError
from firmware_sim.session import BackPage, DataAction


def _ack(patch, change):
    """Change the fields of each ACK: flags, seq, frame and the body's values."""

    def _send(old, self, kind, flags, seq, frame, payload):
        if kind == spec.TYPE_ACK:
            values = list(device._ACK.unpack(payload))
            flags, seq, frame = change(self, flags, seq, frame, values)
            payload = device._ACK.pack(*values)
        old(self, kind, flags, seq, frame, payload)

    around(patch, Device, "_send", _send)


@mutant(
    "6/only-whole",
    "6/next-while-missing",
    "6/other-while-missing",
    "6/out-of-order-next",
    "9/received",
    "9.1/window-edges",
    "9.1/duplicate-answered",
    "9.1/duplicate-unseen",
    "9.1/around-256",
    "9/answers-received",
)
def bitmap_shifted(patch):
    def change(self, flags, seq, frame, values):
        values[3] = values[3] << 1 & 0xFFFFFFFF
        return flags, seq, frame

    _ack(patch, change)


@mutant(
    "6/next-while-missing",
    "6/other-while-missing",
    "6/first-while-missing",
    "9/received",
    "9.1/window-edges",
    "9.1/duplicate-answered",
    "9.1/around-256",
)
def last_is_next_minus_one(patch):
    def change(self, flags, seq, frame, values):
        if not flags & 4:
            values[0] = (seq - 1) % 256
        return flags, seq, frame

    _ack(patch, change)


@mutant("9/last-at-first")
def last_begins_at_0(patch):
    def init(old, self, number):
        old(self, number)
        self.last = 0

    around(patch, Session, "__init__", init)


@mutant("9/status")
def asked_missing(patch):
    _ack(patch, lambda self, flags, seq, frame, values: (flags & ~4, seq, frame))


@mutant("5/front-page-stays", "9/answers-frame")
def frame_without_shown(patch):
    def change(self, flags, seq, frame, values):
        return flags, seq, frame if flags & 1 else 7

    _ack(patch, change)


@mutant("9/answers-boot")
def other_boot_in_ack(patch):
    def change(self, flags, seq, frame, values):
        values[2] ^= 1
        return flags, seq, frame

    _ack(patch, change)


@mutant(
    "4/reserved-types",
    "4/status-fields",
    "4/read-fields",
    "5/hello-repeated",
    "5/new-session",
    "5/other-major",
    "5/hello-ignored",
    "5/hello-short",
    "5/session-zero",
    "9/status",
    "9/status-length",
    "9/data-answered",
    "11/overrun",
    "10/read-fields",
    "10/read-outside",
    "10/read-length",
    "11/session-ends",
    spreads=True,
)
def session_missing_in_ack(patch):
    def change(self, flags, seq, frame, values):
        values[1] = 0
        return flags, seq, frame

    _ack(patch, change)


@mutant("9/damage-unanswered", "9/damage-stays")
def damaged_begins_with_the_session(patch):
    on_hello(patch, lambda self, packet, session: setattr(self, "damaged", 0))


@mutant("9/silent-acks", max_silent_acks=8)
def too_many_silent_acks(patch):
    def data(old, self, *args):
        object.__setattr__(self.config, "max_silent_acks", 12)
        old(self, *args)

    around(patch, Device, "_data", data)


@mutant("9.1/duplicate-unseen", "9.1/applied-once")
def duplicates_applied(patch):
    def judge(old, self, seq, frame, flags):
        verdict = old(self, seq, frame, flags)
        self.again = verdict is DataAction.DUPLICATE
        return verdict

    around(patch, Session, "classify", judge)

    def data(old, self, session, packet, flags, seq, frame):
        old(self, session, packet, flags, seq, frame)
        if session.again and session.state is BackPage.FILLING:
            self._unpacker.draw(packet, self.memory.back)

    around(patch, Device, "_data", data)


@mutant("9.1/window-edges", "9.1/duplicate-answered", "9.1/duplicate-unseen", "9.1/around-256")
def duplicates_unanswered(patch):
    def data(old, self, session, packet, flags, seq, frame):
        if not session._is_duplicate(seq):
            old(self, session, packet, flags, seq, frame)

    around(patch, Device, "_data", data)


@mutant(
    "9.1/duplicate-while-pending",
    "9.1/window-edges",
    "9.1/duplicate-answered",
    "9.1/duplicate-unseen",
    "9.1/applied-once",
    "9.1/around-256",
)
def old_duplicates_refused(patch):
    def is_duplicate(old, self, seq):
        return self._ahead(seq) < 32 and old(self, seq)

    around(patch, Session, "_is_duplicate", is_duplicate)


@mutant("9/received", "9.1/window-edges", "9.1/around-256")
def window_of_31(patch):
    def judge(old, self, seq, frame, flags):
        if self._ahead(seq) == 31:
            raise PacketError(spec.CODE_SEQUENCE, 1, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "classify", judge)


@mutant("9.1/window-edges", "9.1/around-256")
def window_of_33(patch):
    def judge(old, self, seq, frame, flags):
        return DataAction.DROP if self._ahead(seq) == 32 else old(self, seq, frame, flags)

    around(patch, Session, "classify", judge)


@mutant("9.1/around-256")
def window_ends_at_255(patch):
    def ahead(_, self, seq):
        return seq - self.next if seq >= self.next else 255

    around(patch, Session, "_ahead", ahead)


@mutant(
    "9.2/answers-credit", "9.2/returned", "9.2/not-withdrawn", likely="not what is left of a total"
)
def credit_never_returned(patch):
    def change(self, flags, seq, frame, values):
        self.spent = getattr(self, "spent", 0) + 20
        values[4] = max(values[4] - self.spent, 0)
        return flags, seq, frame

    _ack(patch, change)


@mutant("9.2/room-is-there", "9.2/zeros-between", lies=frozenset(("credit",)))
def credit_of_twice_the_ring(patch):
    del patch


@mutant("9.2/answers-credit", "9.2/not-withdrawn", likely="whatever of it has arrived")
def credit_of_what_is_free(patch):
    def take(old, self, data, at):
        self.left = len(data)
        return old(self, data, at)

    around(patch, Device, "_take", take)

    def change(self, flags, seq, frame, values):
        if not flags & 4:
            values[4] = max(values[4] - getattr(self, "left", 0), 0)
        return flags, seq, frame

    _ack(patch, change)


def _idle(patch, lapse):
    """Do something to a device when bytes come after a second without any."""

    def receive(old, self, data):
        now = self._clock()
        if now - getattr(self, "heard_s", now) > 1:
            lapse(self.device)
        self.heard_s = now
        old(self, data)

    around(patch, DeviceOnLine, "receive", receive)


@mutant("9.2/answers-credit", "9.2/does-not-lapse", likely="must not expire")
def credit_lapses(patch):
    _idle(patch, lambda self: setattr(self, "lapsed", 20))

    def change(self, flags, seq, frame, values):
        values[4] -= getattr(self, "lapsed", 0)
        return flags, seq, frame

    _ack(patch, change)


@mutant("9.2/does-not-lapse", likely="must not expire")
def session_lapses(patch):
    _idle(patch, lambda self: setattr(self, "session", None))


@mutant("9/status-length", "11/order-of-packet")
def longer_status_taken(patch):
    def status(old, self, packet, *rest):
        old(self, packet[:3], *rest)

    around(patch, Device, "_status", status)


@mutant("9/answers-pending", spreads=True, refresh=0)
def pending_although_at_once(patch):
    _ack(patch, lambda self, flags, seq, frame, values: (flags | 2, seq, frame))


@mutant("9/each-status")
def status_in_a_hurry_unanswered(patch):
    def status(old, self, packet, flags, seq, frame):
        if seq != 2:
            old(self, packet, flags, seq, frame)

    around(patch, Device, "_status", status)

"""Devices that break section 6: DATA, frames and pages."""

from __future__ import annotations

from broken_devices.mutant import Device, Page, Session, around, mutant
from firmware_sim import device, memory, spec
from firmware_sim.packet_error import PacketError
from firmware_sim.session import BackPage, DataAction


@mutant("6/only-by-commit", "6/given-up", "6/many-packets", spreads=True)
def swap_without_commit(patch):
    def mark(old, self, seq, flags):
        old(self, seq, flags)
        if not self.received:
            self.state = BackPage.PENDING

    around(patch, Session, "mark_received", mark)


@mutant("6/only-whole", "6/two-commits", "9.1/out-of-order")
def swap_of_what_is_not_whole(patch):
    def mark(old, self, seq, flags):
        old(self, seq, flags)
        if self._commit is not None:
            self.state = BackPage.PENDING

    around(patch, Session, "mark_received", mark)


@mutant("6/two-commits")
def highest_commit_counts(patch):
    def mark(old, self, seq, flags):
        if self._commit is not None:
            flags &= ~spec.DATA_FLAG_COMMIT
        old(self, seq, flags)

    around(patch, Session, "mark_received", mark)


@mutant("6/keep", "5/keep-in-new-session", "8/kept", spreads=True)
def keep_starts_dark(patch):
    around(patch, memory.Memory, "begin_frame", lambda old, self, dark: old(self, True))


@mutant("6/clear", "7/move", spreads=True)
def clear_does_not_clear(patch):
    around(patch, memory.Memory, "begin_frame", lambda old, self, dark: old(self, False))


@mutant("6/keep", "5/keep-in-new-session", spreads=True)
def keep_is_the_page_before_last(patch):
    around(patch, memory.Memory, "begin_frame", lambda old, self, dark: dark and old(self, True))


@mutant("6/given-up", "8/given-up")
def given_up_frame_stays(patch):
    def begin(old, self, frame, flags):
        given_up = self.state is BackPage.FILLING
        old(self, frame, flags)
        self.given_up = given_up

    around(patch, Session, "begin_frame", begin)

    def data(old, self, session, packet, flags, seq, frame):
        around_memory = self.memory.begin_frame
        session.given_up = False
        self.memory.begin_frame = lambda dark: None if session.given_up else around_memory(dark)
        try:
            old(self, session, packet, flags, seq, frame)
        finally:
            self.memory.begin_frame = around_memory

    around(patch, Device, "_data", data)


@mutant("6/swap-reported", "6/waits-unchecked")
def swap_not_reported(patch):
    def tick(_, self, count=1):
        if self.session and self.session.tick(count):
            self._swap(self.session)
            if self._deferred:
                packet, self._deferred, self._deferred_bytes = self._deferred, b"", 0
                self._dispatch(packet)
                self._drain()

    around(patch, Device, "tick", tick)


@mutant("6/one-ack-at-once", refresh=0)
def two_acks_at_once(patch):
    def swap(old, self, session):
        old(self, session)
        self._acknowledge()

    around(patch, Device, "_swap", swap)


@mutant("6/pending")
def pending_not_said(patch):
    patch.setattr(device.spec, "ACK_FLAG_PENDING", 0)


@mutant(
    "9.1/duplicate-while-pending",
    "6/next-waits",
    "6/waits-unchecked",
    "6/all-waits",
    "9.2/room-is-there",
)
def next_does_not_wait(patch):
    patch.setattr(Session, "must_wait", lambda *_: False)

    def judge(old, self, seq, frame, flags):
        if self.state is BackPage.PENDING:
            self.state = BackPage.EMPTY
        return old(self, seq, frame, flags)

    around(patch, Session, "classify", judge)


@mutant("6/waits-unchecked")
def next_is_checked_while_pending(patch):
    def must_wait(old, self, seq, frame):
        if old(self, seq, frame) and frame != (self._newest + 1) % 256:
            raise PacketError(spec.CODE_FRAME, 2, "")
        return old(self, seq, frame)

    around(patch, Session, "must_wait", must_wait)

    def dispatch(old, self, packet):
        try:
            old(self, packet)
        except PacketError as refusal:
            self._send_error(packet[1], packet[2], refusal)
            self.session = None

    around(patch, Device, "_dispatch", dispatch)


@mutant("6/all-waits")
def hello_overtakes_what_waits(patch):
    def take(old, self, data, at):
        at = old(self, data, at)
        hello = data[at:].rfind(b"\x02\x30")
        if self._deferred and hello >= 0:
            self._deferred = b""
            return old(self, data, at + hello)
        return at

    around(patch, Device, "_take", take)


@mutant("6/first-id", "6/next-id", "6/waits-unchecked", "11/order-of-packet")
def any_id_begins(patch):
    def judge(old, self, seq, frame, flags):
        verdict = None
        try:
            verdict = old(self, seq, frame, flags)
        except PacketError as refusal:
            if refusal.code != spec.CODE_FRAME or frame == self._newest:
                raise
            verdict = DataAction.BEGIN
        return verdict

    around(patch, Session, "classify", judge)


@mutant("6/next-while-missing", "6/other-while-missing", "6/first-while-missing")
def dropped_is_marked_received(patch):
    def judge(old, self, seq, frame, flags):
        verdict = old(self, seq, frame, flags)
        if verdict is DataAction.DROP:
            self.received |= 1 << self._ahead(seq) >> 1
        return verdict

    around(patch, Session, "classify", judge)


@mutant("6/next-while-missing", "6/other-while-missing", "6/first-while-missing")
def dropped_is_refused(patch):
    def judge(old, self, seq, frame, flags):
        verdict = old(self, seq, frame, flags)
        if verdict is DataAction.DROP:
            raise PacketError(spec.CODE_FRAME, 2, "")
        return verdict

    around(patch, Session, "classify", judge)


@mutant(
    "6/next-while-missing",
    "6/other-while-missing",
    "6/first-while-missing",
    "9.1/duplicate-unseen",
    "11/order-of-packet",
)
def dropped_ops_are_looked_at(patch):
    def data(old, self, session, packet, flags, seq, frame):
        self._unpacker.draw(packet, Page(self.config.shape.volume, self.config.pixels.size))
        old(self, session, packet, flags, seq, frame)

    around(patch, Device, "_data", data)


@mutant("6/clear-flag-differs", "11/order-of-packet")
def clear_flag_not_compared(patch):
    def check_own(old, self, seq, flags):
        old(self, seq, flags & ~1 | self._clear)

    around(patch, Session, "_check_same_frame", check_own)


@mutant("6/behind-commit")
def behind_commit_taken(patch):
    def check_own(old, self, seq, flags):
        commit, self._commit = self._commit, None
        old(self, seq, flags)
        self._commit = commit

    around(patch, Session, "_check_same_frame", check_own)


@mutant("6/after-display", "11/order-of-packet")
def shown_frame_is_drawn_on(patch):
    def check_own(old, self, seq, flags):
        if self.state is not BackPage.EMPTY or self.shown is None:
            old(self, seq, flags)

    around(patch, Session, "_check_same_frame", check_own)


@mutant("6/given-up", "11/order-of-packet")
def clear_before_id(patch):
    def judge(old, self, seq, frame, flags):
        begun = self.state is BackPage.FILLING
        if begun and not self._is_duplicate(seq) and bool(flags & 1) != self._clear:
            raise PacketError(spec.CODE_FRAME, 0, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "classify", judge)


@mutant(
    "6/only-whole",
    "6/begins-by-arrival",
    "6/behind-commit",
    "6/next-while-missing",
    "6/other-while-missing",
    "6/out-of-order-next",
    "6/two-commits",
    "9/received",
    "9.1/window-edges",
    "9.1/out-of-order",
)
def out_of_order_begin_dropped(patch):
    def judge(old, self, seq, frame, flags):
        verdict = old(self, seq, frame, flags)
        return DataAction.DROP if verdict is DataAction.BEGIN and self._ahead(seq) else verdict

    around(patch, Session, "classify", judge)


@mutant("6/empty-packets", spreads=True)
def empty_data_refused(patch):
    def data(old, self, session, packet, *rest):
        if len(packet) == 3:
            raise PacketError(spec.CODE_LENGTH, 0, "")
        old(self, session, packet, *rest)

    around(patch, Device, "_data", data)


@mutant("6/ids-wrap")
def ids_wrap_at_255(patch):
    def judge(old, self, seq, frame, flags):
        if frame == 255 and self._newest == 254 and self.shown is None:
            raise PacketError(spec.CODE_FRAME, 2, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "classify", judge)


@mutant("6/one-after-another", spreads=True)
def fifth_swap_shows_the_wrong_page(patch):
    def swap(old, self):
        self.count = getattr(self, "count", 0) + 1
        if self.count % 5:
            old(self)

    around(patch, memory.Memory, "swap", swap)


@mutant("6/own-while-pending")
def own_while_pending_dropped(patch):
    def judge(old, self, seq, frame, flags):
        if self.state is BackPage.PENDING and frame == self._newest:
            return DataAction.DROP
        return old(self, seq, frame, flags)

    around(patch, Session, "classify", judge)

"""Devices that break protocol.md in one place each, made of the emulator.

Each has the name of its fault, how to make it, and the checks that must notice: all of them, and
no other, may fail.
"""

from __future__ import annotations

import dataclasses
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field

from firmware_sim import (
    arc,
    bits,
    crc,
    device,
    info,
    memory,
    operands,
    receiver,
    sender,
    shapes,
    spec,
    unpack,
)
from firmware_sim import session as sessions
from firmware_sim.grid import Grid
from firmware_sim.refusal import Refusal
from firmware_sim.session import State, Verdict

Device, Session, Receiver = device.Device, sessions.Session, receiver.Receiver
Decoder, Operands, Page = unpack._Decoder, operands.Operands, memory.Page


@dataclass(frozen=True)
class Mutant:
    """A fault.

    ``make`` gets pytest's monkeypatch, ``config`` changes the device. ``fails`` are the checks that
    must notice. No other may, unless the fault ``spreads``: all that is drawn passes through it.
    ``likely`` is part of what the kit must suspect.
    """

    name: str
    make: Callable
    fails: tuple[str, ...]
    spreads: bool = False
    likely: str = ""
    config: dict = field(default_factory=dict)

    def __str__(self) -> str:
        return self.name


MUTANTS: list[Mutant] = []


def mutant(*fails: str, spreads: bool = False, likely: str = "", **config: object):
    def enlist(make: Callable) -> Callable:
        name = make.__name__.strip("_").replace("_", "-")
        MUTANTS.append(Mutant(name, make, fails, spreads, likely, config))
        return make

    return enlist


def around(patch, owner, name, wrapper):
    """Replace a method by wrapper(old, self, ...)."""
    old = getattr(owner, name)
    patch.setattr(owner, name, lambda *args, **more: wrapper(old, *args, **more))


# -- section 3 and 4


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
        whole = self.size >= spec.LIMIT_MIN_SEGMENT and not (self._left or self._bad)
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

    around(patch, Device, "_damage", damage)


@mutant("9/last-at-first", "9/damage-answered", "12/noise", "12/mutated")
def damage_not_answered(patch):
    def damage(_, self):
        self.damaged += 1

    around(patch, Device, "_damage", damage)


@mutant("3/shortest-damage", "9/damage-answered", "3/resync", spreads=True)
def damage_ends_the_session(patch):
    def damage(old, self):
        old(self)
        self.session = None

    around(patch, Device, "_damage", damage)


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
        return sender.encode(packet + check.to_bytes(4, "little"))

    patch.setattr(device, "send", send)


@mutant("3/answers-delimited")
def debugging_text_between(patch):
    def refuse(old, self, *args):
        self._out += b"refused\r\n\0"
        old(self, *args)

    around(patch, Device, "_refuse", refuse)


@mutant("4/reserved-types", "11/session-ends", "11/error-names-packet", "11/error-session")
def reserved_types_silent(patch):
    def answer(old, self, packet):
        if packet[0] >> 4 in {0, 12}:
            return
        old(self, packet)

    around(patch, Device, "_answer", answer)


@mutant("4/data-flags", "11/order-of-packet")
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


# -- section 5


def _announce(patch, **changes):
    old = info.announce
    patch.setattr(device, "announce", lambda *args: dataclasses.replace(old(*args), **changes))


@mutant("5/info-fields", "9.2/returned")
def rx_buffer_too_small(patch):
    _announce(patch, credit=300)


@mutant("5/info-fields")
def unknown_feature(patch):
    _announce(patch, features=0x3FF)


@mutant("5/info-fields")
def one_page(patch):
    patch.setattr(memory.Memory, "PAGES", 1)


@mutant("5/info-strings")
def name_no_utf8(patch):
    _announce(patch, strings=b"\x02\xff\xfe\x01x\x00")


@mutant("5/info-strings")
def strings_cut_off(patch):
    _announce(patch, strings=b"\x02ab\x01x")


def _hello(patch, change):
    def hello(old, self, packet):
        session = self.session
        old(self, packet)
        change(self, packet, session)

    around(patch, Device, "_hello", hello)


@mutant("5/new-session", spreads=True)
def hello_keeps_the_session(patch):
    def change(self, packet, session):
        if session and self.session and packet[3] == 1:
            session.number = self.session.number
            self.session = session

    _hello(patch, change)


@mutant("5/front-page-stays", "5/keep-in-new-session", "11/frame-dropped")
def hello_clears_the_front_page(patch):
    _hello(patch, lambda self, packet, session: self.memory.front.clear())


@mutant("5/new-session", "5/front-page-stays", spreads=True)
def hello_keeps_shown(patch):
    def change(self, packet, session):
        if session and self.session is not session:
            self.session.shown = session.shown

    _hello(patch, change)


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
            raise Refusal(spec.CODE_LENGTH, 0, "")
        old(self, packet)

    around(patch, Device, "_hello", hello)


@mutant("5/hello-ignored")
def hello_fields_checked(patch):
    def hello(old, self, packet):
        if packet[1] or packet[7:8] > b"\0":
            raise Refusal(spec.CODE_FIELD, 1, "")
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
        except Refusal as refusal:
            if refusal.code != spec.CODE_FIELD:
                raise
            self.session = Session(0)
            self._send(spec.TYPE_INFO, 0, 0, 0, self._announcement.payload(0))

    around(patch, Device, "_hello", hello)


# -- section 6


@mutant("6/only-by-commit", "6/given-up", "6/many-packets", spreads=True)
def swap_without_commit(patch):
    def mark(old, self, seq, flags):
        old(self, seq, flags)
        if not self.received:
            self.state = State.PENDING

    around(patch, Session, "mark", mark)


@mutant("6/only-whole", "6/two-commits", "9.1/out-of-order")
def swap_of_what_is_not_whole(patch):
    def mark(old, self, seq, flags):
        old(self, seq, flags)
        if self._commit is not None:
            self.state = State.PENDING

    around(patch, Session, "mark", mark)


@mutant("6/two-commits")
def highest_commit_counts(patch):
    def mark(old, self, seq, flags):
        if self._commit is not None:
            flags &= ~spec.DATA_FLAG_COMMIT
        old(self, seq, flags)

    around(patch, Session, "mark", mark)


@mutant("6/keep", "5/keep-in-new-session", "8/kept", spreads=True)
def keep_starts_dark(patch):
    around(patch, memory.Memory, "begin", lambda old, self, dark: old(self, True))


@mutant("6/clear", "7/move", spreads=True)
def clear_does_not_clear(patch):
    around(patch, memory.Memory, "begin", lambda old, self, dark: old(self, False))


@mutant("6/keep", "5/keep-in-new-session", spreads=True)
def keep_is_the_page_before_last(patch):
    around(patch, memory.Memory, "begin", lambda old, self, dark: dark and old(self, True))


@mutant("6/given-up", "8/given-up")
def given_up_frame_stays(patch):
    def begin(old, self, frame, flags):
        given_up = self.state is State.FILLING
        old(self, frame, flags)
        self.given_up = given_up

    around(patch, Session, "begin", begin)

    def data(old, self, session, packet, flags, seq, frame):
        around_memory = self.memory.begin
        session.given_up = False
        self.memory.begin = lambda dark: None if session.given_up else around_memory(dark)
        try:
            old(self, session, packet, flags, seq, frame)
        finally:
            self.memory.begin = around_memory

    around(patch, Device, "_data", data)


@mutant("6/swap-reported", "6/waits-unchecked")
def swap_not_reported(patch):
    def tick(_, self):
        if self.session and self.pending:
            self._swap(self.session)
            if self._waiting:
                packet, self._waiting, self._waiting_size = self._waiting, b"", 0
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


@mutant("6/next-waits", "6/waits-unchecked", "6/all-waits", "9.2/room-is-there")
def next_does_not_wait(patch):
    patch.setattr(Session, "must_wait", lambda *_: False)

    def judge(old, self, seq, frame, flags):
        if self.state is State.PENDING:
            self.state = State.EMPTY
        return old(self, seq, frame, flags)

    around(patch, Session, "judge", judge)


@mutant("6/waits-unchecked")
def next_is_checked_while_pending(patch):
    def must_wait(old, self, seq, frame):
        if old(self, seq, frame) and frame != (self._newest + 1) % 256:
            raise Refusal(spec.CODE_FRAME, 2, "")
        return old(self, seq, frame)

    around(patch, Session, "must_wait", must_wait)

    def dispatch(old, self, packet):
        try:
            old(self, packet)
        except Refusal as refusal:
            self._refuse(packet[1], packet[2], refusal)
            self.session = None

    around(patch, Device, "_dispatch", dispatch)


@mutant("6/all-waits")
def hello_overtakes_what_waits(patch):
    def take(old, self, data, at):
        at = old(self, data, at)
        hello = data[at:].rfind(b"\x02\x30")
        if self._waiting and hello >= 0:
            self._waiting = b""
            return old(self, data, at + hello)
        return at

    around(patch, Device, "_take", take)


@mutant("6/first-id", "6/next-id", "6/waits-unchecked", "11/order-of-packet")
def any_id_begins(patch):
    def judge(old, self, seq, frame, flags):
        verdict = None
        try:
            verdict = old(self, seq, frame, flags)
        except Refusal as refusal:
            if refusal.code != spec.CODE_FRAME or frame == self._newest:
                raise
            verdict = Verdict.BEGIN
        return verdict

    around(patch, Session, "judge", judge)


@mutant("6/next-while-missing", "6/other-while-missing", "6/first-while-missing")
def dropped_is_marked_received(patch):
    def judge(old, self, seq, frame, flags):
        verdict = old(self, seq, frame, flags)
        if verdict is Verdict.DROP:
            self.received |= 1 << self._ahead(seq) >> 1
        return verdict

    around(patch, Session, "judge", judge)


@mutant("6/next-while-missing", "6/other-while-missing", "6/first-while-missing")
def dropped_is_refused(patch):
    def judge(old, self, seq, frame, flags):
        verdict = old(self, seq, frame, flags)
        if verdict is Verdict.DROP:
            raise Refusal(spec.CODE_FRAME, 2, "")
        return verdict

    around(patch, Session, "judge", judge)


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

    around(patch, Session, "_check_own", check_own)


@mutant("6/behind-commit")
def behind_commit_taken(patch):
    def check_own(old, self, seq, flags):
        commit, self._commit = self._commit, None
        old(self, seq, flags)
        self._commit = commit

    around(patch, Session, "_check_own", check_own)


@mutant("6/after-display", "11/order-of-packet")
def shown_frame_is_drawn_on(patch):
    def check_own(old, self, seq, flags):
        if self.state is not State.EMPTY or self.shown is None:
            old(self, seq, flags)

    around(patch, Session, "_check_own", check_own)


@mutant("6/given-up", "11/order-of-packet")
def clear_before_id(patch):
    def judge(old, self, seq, frame, flags):
        begun = self.state is State.FILLING
        if begun and not self._is_duplicate(seq) and bool(flags & 1) != self._clear:
            raise Refusal(spec.CODE_FRAME, 0, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "judge", judge)


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
        return Verdict.DROP if verdict is Verdict.BEGIN and self._ahead(seq) else verdict

    around(patch, Session, "judge", judge)


# -- section 7


def _unpacked(patch, name, wrapper):
    """Change a method that is named in the table of ops."""
    around(patch, Decoder, name, wrapper)


@mutant(
    "2/scan-order",
    "7/move",
    "7.1/octants",
    "7.8/move-outside",
    spreads=True,
    likely="axes y and z are swapped",
)
def y_and_z_swapped(patch):
    def place(old, self):
        x, y, z = old(self)
        return x, z, y

    around(patch, Operands, "place", place)


@mutant("2/scan-order", "7/move", "7.1/octants", spreads=True)
def z_runs_fastest(patch):
    def init(old, self, nx, ny, nz):
        old(self, nx, ny, nz)
        object.__setattr__(self, "strides", (ny * nz, nz, 1))

    around(patch, Grid, "__init__", init)
    patch.setattr(Grid, "index", lambda self, x, y, z: z + self.nz * (y + self.ny * x))
    patch.setattr(
        Grid,
        "place",
        lambda self, i: (i // self.nz // self.ny, i // self.nz % self.ny, i % self.nz),
    )


@mutant(
    "7.1/octants",
    "7.1/from",
    "7.1/chain-lengths",
    "7.1/chain-cursor",
    "7.8/step-outside",
    likely="byte is n - 1",
)
def step_one_too_few(patch):
    def walk(old, self, octant, count, raw):
        if count == 1:
            self._check_cursor()
            self._page.plot(array("Q", [self._cursor]), self._pen)
            return
        crumbs = int.from_bytes(raw, "little") & (1 << 2 * count - 2) - 1
        old(self, octant, count - 1, crumbs.to_bytes(len(raw), "little")[: (count + 2) // 4])

    around(patch, Decoder, "_walk", walk)


@mutant(
    "7.1/octants",
    "7.1/from",
    "7.1/chain-lengths",
    "7.1/chain-cursor",
    "7.8/step-outside",
    likely="taken for rising",
)
def octant_signs(patch):
    around(patch, Grid, "steps", lambda old, self, octant: old(self, octant ^ 7))
    around(
        patch, Grid, "leaves", lambda old, self, i, octant, moves: old(self, i, octant ^ 7, moves)
    )


@mutant("7.1/octants", "7.1/from", likely="bit 0 is for axis main + 1")
def crumb_bits_swapped(patch):
    swapped = [bytes((0, 2, 1, 3)[c] for c in row) for row in unpack._CRUMBS]
    patch.setattr(unpack, "_CRUMBS", swapped)


@mutant("7.1/octants", "7.1/from", likely="lowest bits")
def crumbs_high_first(patch):
    patch.setattr(unpack, "_CRUMBS", [row[::-1] for row in unpack._CRUMBS])


@mutant(
    "7.1/octants",
    "7.1/from",
    "7.1/chain-lengths",
    "7.1/chain-cursor",
    likely="before its first step",
)
def chain_start_left_out(patch):
    def walk(old, self, octant, count, raw):
        first = self._cursor
        before = self._page.pixels[first : first + 1] if self._format.size == 1 else None
        old(self, octant, count, raw)
        if before is not None:
            self._page.put(first, bytes(before))

    around(patch, Decoder, "_walk", walk)


@mutant("7.1/chain-cursor", likely="stayed at the first")
def chain_cursor_stays(patch):
    def walk(old, self, octant, count, raw):
        first = self._cursor
        old(self, octant, count, raw)
        self._cursor = first

    around(patch, Decoder, "_walk", walk)


@mutant("7.8/step-outside")
def step_wraps_around(patch):
    def leaves(_, self, index, octant, moves):
        steps = self.steps(octant)
        end = index + moves[0] * steps[0]
        end += moves[1] * (steps[1] - steps[0]) + moves[2] * (steps[2] - steps[0])
        return not 0 <= end < self.volume

    around(patch, Grid, "leaves", leaves)


@mutant("7.2/counts", "7.8/past-the-end", spreads=True, likely="31 + k")
def long_count_from_31(patch):
    around(patch, Operands, "count", lambda old, self, c: old(self, c) - (c == 31))


@mutant("11/count-form", "11/first-op-first", "11/order-of-op")
def any_leb128_taken(patch):
    def count(_, self, operand):
        if operand < 31:
            return operand + 1
        total, shift = 0, 0
        while True:
            byte = self.byte()
            total |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return 32 + total

    around(patch, Operands, "count", count)


@mutant("11/count-form")
def leb128_asks_for_a_sixth_byte(patch):
    def count(old, self, operand):
        if operand == 31 and all(byte & 128 for byte in self._packet[self._at : self._at + 5]):
            self.take(6)
        return old(self, operand)

    around(patch, Operands, "count", count)


@mutant("7.2/literal-pen", "7.5/difference-pen", likely="left as it was")
def literal_leaves_pen(patch):
    def write(old, self, count, pixels):
        pen = self._pen
        old(self, count, pixels)
        self._pen = pen

    around(patch, Decoder, "_write", write)


@mutant(
    "7.2/counts",
    "7.2/to-the-end",
    "7.2/literal",
    "7.2/literal-pen",
    "8/sum",
    "10/whole-page",
    "10/ranges",
    "10/dense-page",
    "4/answers-length",
    pixel_format="mono1",
    likely="lowest bits",
)
def mono_high_bit_first(patch):
    patch.setattr(unpack, "_BITS", [row[::-1] for row in unpack._BITS])


@mutant("11/pixel", pixel_format="mono1")
def mono_pen_of_two(patch):
    def pen(old, self, low):
        value = self._in.take(1)
        self._pen = bytes((value[0] & 1,))

    _unpacked(patch, "pen", pen)


@mutant(
    "2.1/pixels",
    "7/each-packet-anew",
    "7/pen",
    "7/move",
    "7/later-counts",
    "7.4/brick-cursor",
    "7.7/arc-pieces",
    "7.7/arc-behind-ops",
    "8/one-voxel",
    "8/overwritten",
    spreads=True,
    pixel_format="rgb565",
    likely="lowest first",
)
def pixels_big_endian(patch):
    def pen(old, self, low):
        old(self, low)
        self._pen = self._pen[::-1]

    _unpacked(patch, "pen", pen)


@mutant("7/each-packet-anew", spreads=True, likely="pen is not reset")
def pen_not_reset(patch):
    def draw(_, self, packet, page):
        inner = operands.Operands(packet, self.grid.coordinate_size)
        decoder = Decoder(self, inner, page)
        decoder._pen = getattr(self, "pen", decoder._pen)
        while (op := inner.op()) is not None:
            if self.ops[op] is None:
                raise inner.refusal(spec.CODE_OP, "")
            self.ops[op](decoder, op & 31)
        self.pen = decoder._pen

    around(patch, unpack.Unpacker, "draw", draw)


@mutant("7/each-packet-anew", spreads=True, likely="cursor is not reset")
def cursor_not_reset(patch):
    def draw(_, self, packet, page):
        inner = operands.Operands(packet, self.grid.coordinate_size)
        decoder = Decoder(self, inner, page)
        decoder._cursor = getattr(page, "cursor", 0)
        while (op := inner.op()) is not None:
            if self.ops[op] is None:
                raise inner.refusal(spec.CODE_OP, "")
            self.ops[op](decoder, op & 31)
        page.cursor = decoder._cursor

    around(patch, unpack.Unpacker, "draw", draw)

    def clear(old, self):
        self.cursor = 0
        old(self)

    around(patch, Page, "clear", clear)


@mutant("11/padding")
def end_padding_taken(patch):
    _unpacked(patch, "end", lambda old, self, low: self._in.rest())


@mutant("11/padding", "11/difference-padding", "11/order-of-op")
def unused_bits_taken(patch):
    def small(_, self, count, bits_):
        raw = self.take((count * bits_ + 7) // 8)
        used = count * bits_ % 8
        return raw[:-1] + bytes((raw[-1] & (1 << used) - 1,)) if used else raw

    around(patch, Operands, "small", small)


@mutant(
    "6/waits-unchecked",
    "11/session-ends",
    "11/error-session",
    "11/reserved-ops",
    "11/first-op-first",
)
def reserved_ops_skipped(patch):
    def ops(old, features):
        table = old(features)
        table[0x1F] = table[0x07] = lambda decoder, low: None
        return table

    around(patch, unpack, "_ops", ops)


@mutant("7.8/past-the-end", "11/first-op-first")
def run_past_the_end_is_cut(patch):
    def room(_, self, count):
        if self._cursor >= self._grid.volume:
            raise self._outside("")
        return min(count, self._grid.volume - self._cursor)

    around(patch, Decoder, "_room", room)


@mutant("7.3/lines", "7.3/line-ties", "7.3/shape-cursor", likely="rounded down")
def line_ties_down(patch):
    def line(grid, start, target):
        begin = grid.place(start)
        d = [b - a for a, b in zip(begin, target, strict=True)]
        n = max(map(abs, d))
        places = [
            [a - (n - 2 * k * da) // (2 * n) for a, da in zip(begin, d, strict=True)]
            for k in range(n + 1 if n else 0)
        ] or [begin]
        return array("Q", [grid.index(*place) for place in places])

    patch.setattr(unpack, "line", line)


@mutant("7.3/lines", "7.3/line-ties", "7.3/line-of-one")
def line_without_its_end(patch):
    old = shapes.line
    patch.setattr(unpack, "line", lambda *args: old(*args)[:-1])


@mutant("7.3/shape-cursor", "7.3/boxes", likely="left out")
def box_without_its_end(patch):
    old = shapes.box

    def box(grid, start, target):
        corners = list(zip(grid.place(start), target, strict=True))
        low = [min(pair) for pair in corners]
        high = [max(min(pair), max(pair) - 1) for pair in corners]
        return old(grid, grid.index(*low), tuple(high))

    patch.setattr(unpack, "box", box)


@mutant("7.3/shape-cursor", "7.3/dots-cursor", likely="here it stayed")
def shape_cursor_stays(patch):
    def stay(old, self, low):
        before = self._cursor
        old(self, low)
        self._cursor = before

    for name in ("line", "box", "dots"):
        _unpacked(patch, name, stay)


@mutant("7.3/dots", "7.3/dots-cursor", "7.8/shapes-outside")
def dots_one_too_few(patch):
    def places(old, self, count):
        axes = old(self, count)
        return tuple(axis[: max(1, count - 1)] for axis in axes)

    around(patch, Operands, "places", places)


@mutant("7.4/levels", "7.4/children", "7.4/full-nodes", likely="x and z were swapped")
def children_reversed(patch):
    def children(level, mask):
        half = 1 << level >> 1
        return tuple(
            half * shapes._place(c >> 2, c >> 1 & 1, c & 1) for c in range(8) if mask >> c & 1
        )

    table = [[children(level, mask) for mask in range(256)] for level in range(5)]
    table[1][0] = table[1][255]
    patch.setattr(shapes, "_CHILDREN", table)


@mutant("7.4/levels", "7.4/full-nodes", "7.8/bricks-outside", "11/order-of-op")
def full_node_is_empty(patch):
    table = [list(row) for row in shapes._CHILDREN]
    table[1][0] = ()
    patch.setattr(shapes, "_CHILDREN", table)
    patch.setattr(shapes, "_ROWS", [[] for _ in shapes._ROWS])


@mutant("7.4/brick-cursor", likely="moved to the brick")
def brick_moves_the_cursor(patch):
    def brick(old, self, level):
        at = self._in._at
        x, y, z = (axis << level for axis in self._in.place())
        self._in._at = at
        old(self, level)
        if self._grid.holds(x, y, z):
            self._cursor = self._grid.index(x, y, z)

    _unpacked(patch, "brick", brick)


@mutant("7.5/differences", "7.5/difference-pen", likely="lowest bits")
def nibbles_high_first(patch):
    patch.setattr(unpack, "_DIFFERENCES", [row[::-1] for row in unpack._DIFFERENCES])


@mutant("7.5/differences", "7.5/difference-pen", likely="two's complement")
def nibbles_unsigned(patch):
    table = [bytes((byte & 15, byte >> 4)) for byte in range(256)]
    patch.setattr(unpack, "_DIFFERENCES", table)


@mutant("7.6/palette-of-a-page")
def palette_not_copied(patch):
    def copy(old, self, other):
        old(self, other)
        self._digest -= self._color_terms(slice(0, 768))
        self.palette[:] = memory.DEFAULT_PALETTE

    around(patch, Page, "copy", copy)


@mutant(
    "7.6/colors",
    "7.6/palette-of-a-page",
    "8/dark",
    "8/one-voxel",
    "8/sum",
    "8/overwritten",
    "8/erased",
    "8/kept",
    "8/of-the-front",
    "8/given-up",
    spreads=True,
)
def palette_not_cleared(patch):
    def clear(old, self):
        palette = getattr(self, "palette", None)
        old(self)
        if palette is not None:
            self.palette = palette
            self._digest = self._color_terms(slice(0, 768))

    around(patch, Page, "clear", clear)


@mutant("7.6/colors", "7.6/palette-of-a-page", likely="palette is not in the digest")
def palette_not_in_the_digest(patch):
    around(patch, Page, "_color_terms", lambda old, self, place: 0)


@mutant("7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-too-many", "7.7/arc-cut", "7.7/arc-long")
def arc_models_learn_slower(patch):
    patch.setattr(bits.spec, "ARC_ENOUGH", 8)


@mutant("7.7/arc-long", "7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-cut", "7.7/arc-too-many")
def arc_forgets_turns(patch):
    def turn(old, self, bits_):
        if self.way and not self.last:
            self.way = 0
        old(self, bits_)

    around(patch, arc._Axis, "turn", turn)


@mutant("7.7/arc-long", "7.7/arc-too-many", "7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-cut")
def arc_runs_too_long(patch):
    patch.setattr(arc.spec, "ARC_MAX_RUN", 7)


@mutant("7.7/arc-too-many")
def arc_padding_taken(patch):
    patch.setattr(bits.Bits, "done", property(lambda self: self._at >= len(self._data)))

    def step(old, *args):
        try:
            yield from old(*args)
        except Refusal as refusal:
            if refusal.code != spec.CODE_PADDING:
                raise

    around(patch, unpack, "arc", step)


# -- section 8


@mutant(
    "7.6/colors",
    "7.6/palette-of-a-page",
    "8/dark",
    "8/one-voxel",
    "8/sum",
    "8/overwritten",
    "8/erased",
    "8/kept",
    "8/of-the-front",
    "8/given-up",
    likely="adds dark voxels",
)
def digest_adds_dark_voxels(patch):
    def mix(index, value):
        h = (index * 0x9E3779B1 + value * 0x85EBCA77) & 0xFFFFFFFF
        h = (h ^ h >> 15) * 0x2C1B3C6D & 0xFFFFFFFF
        h = (h ^ h >> 12) * 0x297A2D39 & 0xFFFFFFFF
        return h ^ h >> 15

    def digest(self):
        right = old.fget(self)
        dark = sum(mix(i, 0) for i, pixel in enumerate(self.pixels) if not pixel)
        return (right + dark) & 0xFFFFFFFF

    old = Page.digest
    patch.setattr(Page, "digest", property(digest))
    patch.setattr(Page, "copy", lambda self, other: self.put(0, bytes(other.pixels)))


@mutant("8/overwritten", "8/erased")
def digest_forgets_to_take_out(patch):
    around(
        patch,
        Page,
        "_replaced",
        lambda old, self, i, before, now: old(self, i, bytes(len(before)), now),
    )


@mutant(
    "7.6/colors",
    "7.6/palette-of-a-page",
    "8/dark",
    "8/one-voxel",
    "8/sum",
    "8/overwritten",
    "8/erased",
    "8/kept",
    "8/of-the-front",
)
def digest_of_the_back_page(patch):
    patch.setattr(
        Device,
        "memory",
        property(lambda self: self._memory, lambda self, value: setattr(self, "_memory", value)),
        raising=False,
    )

    def acknowledge(old, self, tag=None):
        memory_ = self.memory
        memory_.front, memory_.back = memory_.back, memory_.front
        old(self, tag)
        memory_.front, memory_.back = memory_.back, memory_.front

    around(patch, Device, "_acknowledge", acknowledge)


@mutant("8/answers-digest", features=frozenset(("read",)))
def digest_without_the_feature(patch):
    def init(old, self, config):
        old(self, config)
        self._features |= 1 << spec.FEATURE_DIGEST

    around(patch, Device, "__init__", init)


# -- section 9


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
    _hello(patch, lambda self, packet, session: setattr(self, "damaged", 0))


@mutant("9/silent-acks", silent=8)
def too_many_silent_acks(patch):
    def data(old, self, *args):
        object.__setattr__(self.config, "silent", 12)
        old(self, *args)

    around(patch, Device, "_data", data)


@mutant("9.1/duplicate-unseen", "9.1/applied-once")
def duplicates_applied(patch):
    def judge(old, self, seq, frame, flags):
        verdict = old(self, seq, frame, flags)
        self.again = verdict is Verdict.DUPLICATE
        return verdict

    around(patch, Session, "judge", judge)

    def data(old, self, session, packet, flags, seq, frame):
        old(self, session, packet, flags, seq, frame)
        if session.again and session.state is State.FILLING:
            self._unpacker.draw(packet, self.memory.back)

    around(patch, Device, "_data", data)


@mutant("9.1/window-edges", "9.1/duplicate-answered", "9.1/duplicate-unseen", "9.1/around-256")
def duplicates_unanswered(patch):
    def data(old, self, session, packet, flags, seq, frame):
        if not session._is_duplicate(seq):
            old(self, session, packet, flags, seq, frame)

    around(patch, Device, "_data", data)


@mutant(
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
            raise Refusal(spec.CODE_SEQUENCE, 1, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "judge", judge)


@mutant("9.1/window-edges", "9.1/around-256")
def window_of_33(patch):
    def judge(old, self, seq, frame, flags):
        return Verdict.DROP if self._ahead(seq) == 32 else old(self, seq, frame, flags)

    around(patch, Session, "judge", judge)


@mutant("9.1/around-256")
def window_ends_at_255(patch):
    def ahead(_, self, seq):
        return seq - self.next if seq >= self.next else 255

    around(patch, Session, "_ahead", ahead)


@mutant("9.2/returned", "9.2/not-withdrawn", likely="not what is left of a total")
def credit_never_returned(patch):
    def change(self, flags, seq, frame, values):
        self.spent = getattr(self, "spent", 0) + 20
        values[4] = max(values[4] - self.spent, 0)
        return flags, seq, frame

    _ack(patch, change)


@mutant("9.2/room-is-there", "9.2/zeros-between", lies=frozenset(("credit",)))
def credit_of_twice_the_ring(patch):
    del patch


@mutant("9.2/not-withdrawn", likely="whatever of it has arrived")
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


# -- section 10


def _read(patch, change):
    def read(old, self, packet, flags, seq, frame):
        packet, flags, seq, frame = change(self, packet, flags, seq, frame)
        old(self, packet, flags, seq, frame)

    around(patch, Device, "_read", read)


@mutant("10/ranges", "10/back-page", likely="off by")
def read_off_by_one(patch):
    old = device.pack

    def pack(page, pixel_format, start, count, room):
        shift = 1 if start + count < page.volume else 0
        return old(page, pixel_format, start + shift, count, room)

    patch.setattr(device, "pack", pack)


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


@mutant("10/back-page")
def back_reads_the_front(patch):
    old = device.pack
    patch.setattr(device, "pack", old)

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


@mutant("9/status-length", "11/order-of-packet")
def longer_status_taken(patch):
    def status(old, self, packet, *rest):
        old(self, packet[:3], *rest)

    around(patch, Device, "_status", status)


# -- section 11


def _refused(patch, change):
    def refuse(old, self, seq, frame, refusal):
        old(self, *change(self, seq, frame, refusal))

    around(patch, Device, "_refuse", refuse)


@mutant(
    "4/read-fields",
    "5/session-zero",
    "6/waits-unchecked",
    "7.7/arc-cut",
    "7.7/arc-too-many",
    "7.7/arc-off-the-grid",
    "10/read-fields",
    "10/read-outside",
    "11/refused-hello",
    "11/reserved-ops",
    "11/count-form",
    "11/truncated",
    "11/padding",
    "11/difference-padding",
    "7.8/move-outside",
    "7.8/step-outside",
    "7.8/behind-the-end",
    "7.8/past-the-end",
    "7.8/shapes-outside",
    "7.8/bricks-outside",
    "7.8/colors-outside",
    "11/order-of-read",
    "11/first-op-first",
    "11/order-of-op",
    likely="header included",
)
def offset_from_the_payload(patch):
    def change(self, seq, frame, refusal):
        if refusal.offset >= 3:
            refusal = Refusal(refusal.code, refusal.offset - 3, refusal.text)
        return seq, frame, refusal

    _refused(patch, change)


@mutant("11/error-names-packet")
def error_without_names(patch):
    _refused(patch, lambda self, seq, frame, refusal: (seq, 0, refusal))


@mutant("11/overrun", "11/error-session")
def error_session_0(patch):
    def _send(old, self, kind, flags, seq, frame, payload):
        if kind == spec.TYPE_ERROR:
            payload = payload[:1] + b"\0\0" + payload[3:]
        old(self, kind, flags, seq, frame, payload)

    around(patch, Device, "_send", _send)


@mutant(
    "5/other-major-first",
    "9/damage-unanswered",
    "11/session-ends",
    "11/error-session",
    "11/refused-hello",
)
def refused_data_keeps_the_session(patch):
    def dispatch(old, self, packet):
        session = self.session
        old(self, packet)
        if self.session is None:
            self.session = session

    around(patch, Device, "_dispatch", dispatch)


@mutant(
    "4/reserved-types",
    "4/status-fields",
    "4/read-fields",
    "9/status-length",
    "10/read-fields",
    "10/read-outside",
    "10/read-length",
    "11/error-session",
    "11/order-of-read",
)
def refused_status_ends_the_session(patch):
    def dispatch(old, self, packet):
        refused = sum(self.refused.values())
        old(self, packet)
        if sum(self.refused.values()) > refused and packet[0] >> 4 != spec.TYPE_HELLO:
            self.session = None

    around(patch, Device, "_dispatch", dispatch)


@mutant("11/order-of-op")
def padding_after_outside(patch):
    def step(old, self, octant):
        self._check_cursor()
        old(self, octant)

    _unpacked(patch, "step", step)


@mutant("11/order-of-packet")
def frame_before_sequence(patch):
    def judge(old, self, seq, frame, flags):
        is_known = frame in {self._newest, (self._newest + 1) % 256} or self._is_duplicate(seq)
        if not is_known and self._ahead(seq) >= 32:
            raise Refusal(spec.CODE_FRAME, 2, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "judge", judge)


@mutant("11/answers-text")
def text_in_latin1(patch):
    def _send(old, self, kind, flags, seq, frame, payload):
        old(self, kind, flags, seq, frame, payload + (b"\xe4" if kind == spec.TYPE_ERROR else b""))

    around(patch, Device, "_send", _send)


@mutant("11/overrun")
def overrun_ends_the_session(patch):
    def store(old, self, data):
        before = self.refused.get(spec.CODE_OVERRUN, 0)
        old(self, data)
        if self.refused.get(spec.CODE_OVERRUN, 0) > before:
            self.disconnect()
            self.damaged += 0

    around(patch, Device, "_store", store)


@mutant("11/overrun")
def overrun_not_said(patch):
    _old = Device._refuse

    def refuse(old, self, seq, frame, refusal):
        if refusal.code != spec.CODE_OVERRUN:
            old(self, seq, frame, refusal)

    around(patch, Device, "_refuse", refuse)


# -- section 12


@mutant("3/too-long", "11/overrun", likely="crashed")
def restarts_on_long_noise(patch):
    def damage(old, self):
        old(self)
        if self._receiver.size > 200:
            self.power_cycle()

    around(patch, Device, "_damage", damage)


@mutant(
    "9.1/nothing-of-the-refused",
    "9.2/returned",
    "9.2/not-withdrawn",
    "9.2/room-is-there",
    "9.2/zeros-between",
    "11/overrun",
    "10/whole-page",
    "10/ranges",
    "10/page-fields",
    "10/page-frame",
    "10/back-page",
    "10/dense-page",
    "11/frame-dropped",
    "11/reserved-ops",
    "11/count-form",
    "11/truncated",
    "11/padding",
    "11/difference-padding",
    "7.8/move-outside",
    "7.8/step-outside",
    "7.8/behind-the-end",
    "7.8/past-the-end",
    "7.8/shapes-outside",
    "7.8/bricks-outside",
    "7.8/colors-outside",
    "11/order-of-packet",
    "11/first-op-first",
    "11/order-of-op",
    "11/flags-of-commit",
)
def dies_of_a_reserved_op(patch):
    def draw(old, self, packet, page):
        if packet[3:4] == b"\xa0" and packet[4:5] == b"\x1f":
            self.dead = True
        if getattr(self, "dead", False):
            raise Refusal(spec.CODE_OP, 0, "")
        old(self, packet, page)

    around(patch, unpack.Unpacker, "draw", draw)


@mutant(
    "3/shortest-damage",
    "3/cobs-overrun",
    "3/bit-errors",
    "3/cut-packets",
    "3/merged-packets",
    "3/resync",
    "3/too-long",
    "9/last-at-first",
    "9/damage-answered",
    "9/damage-unanswered",
    "9/damage-stays",
    "12/noise",
    "12/mutated",
)
def half_a_packet_stays(patch):
    def begin(old, self):
        torn = getattr(self, "torn", False)
        old(self)
        self._bad = torn
        self.torn = False

    around(patch, Receiver, "_begin", begin)

    def end(old, self):
        old(self)
        self.torn = self.damaged

    around(patch, Receiver, "_end", end)


@mutant("10/read-refused", features=frozenset(("digest",)))
def read_answered_unannounced(patch):
    def init(old, self, config):
        old(self, config)
        self._features |= 1 << spec.FEATURE_READ

    around(patch, Device, "__init__", init)


@mutant("11/pixel-padding", "11/padding", "11/order-of-op", pixel_format="mono1")
def unused_bits_of_pixels_taken(patch):
    unused_bits_taken(patch)


@mutant("3/any-pieces")
def pieces_are_packets(patch):
    around(
        patch, Device, "receive", lambda old, self, data: data.endswith(b"\0") and old(self, data)
    )


@mutant("4/answers-length", max_payload=64, name="a")
def page_too_long(patch):
    old = device.pack
    patch.setattr(device, "pack", lambda *args: old(*args[:-1], args[-1] + 20))


@mutant("4/answers-whole")
def unknown_answers(patch):
    def refuse(old, self, *args):
        self._send(12, 0, 0, 0, b"refused")
        old(self, *args)

    around(patch, Device, "_refuse", refuse)


@mutant("5/filling-dropped")
def hello_shows_what_was_begun(patch):
    def hello(old, self, packet):
        if self.session and self.session.state is State.FILLING:
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


@mutant("6/empty-packets", spreads=True)
def empty_data_refused(patch):
    def data(old, self, session, packet, *rest):
        if len(packet) == 3:
            raise Refusal(spec.CODE_LENGTH, 0, "")
        old(self, session, packet, *rest)

    around(patch, Device, "_data", data)


@mutant("6/ids-wrap")
def ids_wrap_at_255(patch):
    def judge(old, self, seq, frame, flags):
        if frame == 255 and self._newest == 254 and self.shown is None:
            raise Refusal(spec.CODE_FRAME, 2, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "judge", judge)


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
        if self.state is State.PENDING and frame == self._newest:
            return Verdict.DROP
        return old(self, seq, frame, flags)

    around(patch, Session, "judge", judge)


@mutant("7.7/arc-dot", "7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-behind-ops")
def arc_start_left_out(patch):
    def pieces(old, *args):
        for pen, voxels in old(*args):
            yield pen, voxels[1:]

    around(patch, unpack, "arc", pieces)


@mutant("7.7/arc-empty")
def empty_arc_refused(patch):
    def pieces(old, operands_, *args):
        found = list(old(operands_, *args))
        if not found:
            raise operands_.refusal(spec.CODE_TRUNCATED, "")
        return found

    around(patch, unpack, "arc", pieces)


@mutant("7.7/arc-long")
def arc_runs_without_end(patch):
    patch.setattr(arc.spec, "ARC_MAX_RUN", 1 << 30)


@mutant("9/answers-pending", spreads=True, refresh=0)
def pending_although_at_once(patch):
    _ack(patch, lambda self, flags, seq, frame, values: (flags | 2, seq, frame))


@mutant("9/each-status")
def status_in_a_hurry_unanswered(patch):
    def status(old, self, packet, flags, seq, frame):
        if seq != 2:
            old(self, packet, flags, seq, frame)

    around(patch, Device, "_status", status)


@mutant("7/begins-at-0", spreads=True)
def pen_begins_at_1(patch):
    def init(old, self, *args):
        old(self, *args)
        self._pen = b"\1"

    around(patch, Decoder, "__init__", init)


@mutant("7/end", "3/cobs-groups")
def end_needs_padding(patch):
    def end(old, self, low):
        if len(self._in._packet) == self._in._at:
            raise self._in.refusal(spec.CODE_TRUNCATED, "")
        old(self, low)

    _unpacked(patch, "end", end)


# What is drawn at random finds what the others find: no fault is its own.
UNPROVEN = {"7/anything", "11/anything"}

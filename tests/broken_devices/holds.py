"""Devices that break section 7.12: frames that are held."""

from __future__ import annotations

from broken_devices.mutant import Decoder, Session, around, mutant, on_hello
from firmware_sim import config, op_decoder, spec
from firmware_sim.session import BackPage


@mutant("5/info-fields", refresh=0, features=("read", "digest", "hold"))
def holds_without_ticks(patch):
    patch.setattr(config, "_TICKING", frozenset())


@mutant("7.12/held", "7.12/longest-counts", "7.12/next-is-held-up")
def holds_are_ignored(patch):
    patch.setattr(Session, "hold", lambda *_: None)


@mutant("7.12/held", "7.12/longest-counts", "7.12/since-the-swap")
def holds_are_twice_as_long(patch):
    around(patch, Session, "hold", lambda old, self, ticks: old(self, 2 * ticks))


@mutant("7.12/longest-counts")
def last_hold_of_a_packet_counts(patch):
    def hold(self, _):
        self.hold_ticks = self._operands.byte()

    _replace(patch, hold)


@mutant("7.12/longest-counts")
def last_packet_with_a_hold_counts(patch):
    def hold(self, ticks):
        self._hold = ticks

    patch.setattr(Session, "hold", hold)


@mutant("7.12/since-the-swap")
def holds_add_up(patch):
    def hold(self, ticks):
        self._hold += ticks

    patch.setattr(Session, "hold", hold)


@mutant("7.12/since-the-swap", "7.12/first-is-not-held", "7.12/held", "7.12/longest-counts")
def holds_count_from_when_a_frame_is_whole(patch):
    def mark(old, self, seq, flags):
        before = self.state
        old(self, seq, flags)
        if self.state is BackPage.PENDING is not before and self._hold:
            self._since, self.is_fresh = 0, True

    def tick(old, self, count):
        fresh, self.is_fresh = self.is_fresh, False
        return old(self, 1 if fresh else count)  # those before are told of with this one

    patch.setattr(Session, "is_fresh", False, raising=False)
    around(patch, Session, "mark_received", mark)
    around(patch, Session, "tick", tick)


@mutant("7.12/hold-is-dropped", "7.12/one-frame-alone")
def holds_stay(patch):
    def begin(old, self, frame, flags):
        before = self._hold
        old(self, frame, flags)
        self._hold = before

    around(patch, Session, "begin_frame", begin)


@mutant("7.12/first-is-not-held")
def first_frame_is_held(patch):
    def hello(device, packet, session):
        device.session._since = 0

    on_hello(patch, hello)


@mutant("7.12/hello-drops-held")
def holds_outlive_their_session(patch):
    def hello(device, packet, session):
        if session and session._hold:
            device.session.begin_frame = lambda frame, flags: _begin(device.session, frame, flags)
            device.session._since = session._since

    def _begin(session, frame, flags):
        type(session).begin_frame(session, frame, flags)
        session._hold = spec.LIMIT_MAX_HOLD

    on_hello(patch, hello)


@mutant("7.12/hold-draws-nothing", spreads=True)
def hold_resets_the_pen(patch):
    def hold(self, _):
        self.hold_ticks = max(self.hold_ticks, self._operands.byte())
        self._set_pen(self._format.full)

    _replace(patch, hold)


@mutant("7.12/hold-draws-nothing", spreads=True)
def hold_resets_the_cursor(patch):
    def hold(self, _):
        self.hold_ticks = max(self.hold_ticks, self._operands.byte())
        self._set_cursor(0)

    _replace(patch, hold)


@mutant("7.12/hold-draws-no-fade", spreads=True)
def hold_ends_a_chain_of_a_fade(patch):
    def hold(self, _):
        self.hold_ticks = max(self.hold_ticks, self._operands.byte())
        self._written = False

    _replace(patch, hold)


def _replace(patch, hold):
    old, table = Decoder.hold, op_decoder._op_table

    def patched(features):
        return [hold if draw is old else draw for draw in table(features)]

    patch.setattr(op_decoder, "_op_table", patched)

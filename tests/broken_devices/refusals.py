"""Devices that break section 11: ERROR."""

from __future__ import annotations

from broken_devices.mutant import Device, Session, around, mutant, on_op
from firmware_sim import spec
from firmware_sim.packet_error import PacketError


def _refused(patch, change):
    def refuse(old, self, seq, frame, refusal):
        old(self, *change(self, seq, frame, refusal))

    around(patch, Device, "_send_error", refuse)


@mutant(
    "7.13/values-cut",
    "7.13/values-too-many-bytes",
    "7.13/values-too-many-cells",
    "7.13/values-off-the-grid",
    "7.13/values-no-pixel",
    "7.11/slabs-cut",
    "7.11/slabs-too-many-bytes",
    "7.11/slabs-too-many-cells",
    "7.11/slabs-off-the-grid",
    "7.10/arc2-fade-refused",
    "7.10/arc2-outside",
    "7.10/arc2-refused",
    "7.9/fade-refused",
    "7.9/ramp-refused",
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
            refusal = PacketError(refusal.code, refusal.offset - 3, refusal.text)
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
        refused = sum(self.errors_by_code.values())
        old(self, packet)
        if sum(self.errors_by_code.values()) > refused and packet[0] >> 4 != spec.TYPE_HELLO:
            self.session = None

    around(patch, Device, "_dispatch", dispatch)


@mutant("11/order-of-op")
def padding_after_outside(patch):
    def step(old, self, octant):
        self._check_cursor()
        old(self, octant)

    on_op(patch, "step", step)


@mutant("11/order-of-packet")
def frame_before_sequence(patch):
    def judge(old, self, seq, frame, flags):
        is_known = frame in {self._newest, (self._newest + 1) % 256} or self._is_duplicate(seq)
        if not is_known and self._ahead(seq) >= 32:
            raise PacketError(spec.CODE_FRAME, 2, "")
        return old(self, seq, frame, flags)

    around(patch, Session, "classify", judge)


@mutant("11/answers-text")
def text_in_latin1(patch):
    def _send(old, self, kind, flags, seq, frame, payload):
        old(self, kind, flags, seq, frame, payload + (b"\xe4" if kind == spec.TYPE_ERROR else b""))

    around(patch, Device, "_send", _send)


@mutant("11/overrun")
def overrun_ends_the_session(patch):
    def store(old, self, data):
        before = self.errors_by_code.get(spec.CODE_OVERRUN, 0)
        old(self, data)
        if self.errors_by_code.get(spec.CODE_OVERRUN, 0) > before:
            self.disconnect()
            self.damaged += 0

    around(patch, Device, "_store", store)


@mutant("11/overrun")
def overrun_not_said(patch):
    _old = Device._send_error

    def refuse(old, self, seq, frame, refusal):
        if refusal.code != spec.CODE_OVERRUN:
            old(self, seq, frame, refusal)

    around(patch, Device, "_send_error", refuse)

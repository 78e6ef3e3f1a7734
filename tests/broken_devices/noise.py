"""Devices that break section 12: any input."""

from __future__ import annotations

from broken_devices.mutant import Device, Receiver, around, mutant
from firmware_sim import op_decoder, spec
from firmware_sim.packet_error import PacketError


@mutant("3/too-long", "11/overrun", likely="crashed")
def restarts_on_long_noise(patch):
    def damage(old, self):
        old(self)
        if self._receiver.size > 200:
            self.power_cycle()

    around(patch, Device, "_count_damaged", damage)


@mutant(
    "10/back-page-pending",
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
    "4/answers-length",
    "9.2/does-not-lapse",
    "11/first-op-first",
    "11/order-of-op",
    "11/refused-commit",
)
def dies_of_a_reserved_op(patch):
    def draw(old, self, packet, page):
        if packet[3:4] == b"\xa0" and packet[4:5] == b"\x1f":
            self.dead = True
        if getattr(self, "dead", False):
            raise PacketError(spec.CODE_OP, 0, "")
        return old(self, packet, page)

    around(patch, op_decoder.OpDecoder, "draw", draw)


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
        self._too_long = torn
        self.torn = False

    around(patch, Receiver, "_begin", begin)

    def end(old, self):
        old(self)
        self.torn = self.damaged

    around(patch, Receiver, "_end", end)

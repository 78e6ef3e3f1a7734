"""Devices that break section 7.9: fades and ramps."""

from __future__ import annotations

from broken_devices.mutant import Decoder, around, mutant
from firmware_sim import fades, op_decoder, spec
from firmware_sim.packet_error import PacketError


@mutant(
    "7.9/fade-rounding",
    "7.9/fade-chains",
    "7.9/fade-cursor-set",
    "7.9/fade-goes-on",
    "7.9/fade-runs",
    "7.9/ramps",
    spreads=True,
)
def fade_rounds_down(patch):
    def color(self):
        here = self._stops[self._stop]
        there = self._stops[min(self._stop + 1, len(self._stops) - 1)]
        pairs = zip(here, there, strict=True)
        return bytes(a + self._rest * (b - a) // self._width for a, b in pairs)

    patch.setattr(fades.Blend, "color", property(color))


@mutant("7.9/fade-goes-on", spreads=True)
def fade_counts_again(patch):
    around(patch, fades.Fade, "pens", lambda old, self, voxels, **_: old(self, voxels, again=False))


@mutant("7.9/fade-cursor-set", spreads=True)
def fade_forgets_no_cursor(patch):
    def plot_row(self, voxels, end, *, again=False):
        self._written = self._written or (self._fade is not None and self._fade._last is not None)
        old(self, voxels, end, again=again and getattr(self, "_rows", 0) > 0)
        self._rows = getattr(self, "_rows", 0) + 1

    old = Decoder._plot_row
    patch.setattr(Decoder, "_plot_row", plot_row)


@mutant("7.9/fade-runs", spreads=True)
def fade_counts_runs(patch):
    def run(old, self, operand):
        fade = self._fade
        old(self, operand)
        if fade:
            list(fade.pens((0,), again=False))

    old = Decoder.run
    patch.setattr(Decoder, "run", lambda self, operand: run(old, self, operand))
    table = op_decoder._op_table

    def patched(features):
        return [Decoder.run if draw is old else draw for draw in table(features)]

    patch.setattr(op_decoder, "_op_table", patched)


@mutant("7.9/fade-past-its-end", "7.9/fade-chains", spreads=True)
def fade_begins_anew(patch):
    def advance(old, self):
        if not self._left:
            self._stop, self._rest, self._left = 0, 0, self._width
        else:
            old(self)

    around(patch, fades.Blend, "advance", advance)


@mutant("7.9/fade-ended", spreads=True)
def fade_survives_a_pen(patch):
    def set_pen(old, self, pixel):
        if not self._fade:
            old(self, pixel)

    around(patch, Decoder, "_set_pen", set_pen)


@mutant("7.9/ramps", spreads=True)
def ramp_without_its_last_entry(patch):
    old = fades.ramp
    patch.setattr(fades, "ramp", lambda colors, count: old(colors, count)[: 3 * (count - 1)])


def taken(patch, code, name):
    """Take what is refused with a code by one op, as if it were nothing."""

    def op(old, self, operand):
        try:
            old(self, operand)
        except PacketError as refusal:
            if refusal.code != code:
                raise
            self._operands.remaining()

    method = getattr(Decoder, name)
    table = op_decoder._op_table

    def patched(features):
        return [
            (lambda self, low: op(method, self, low)) if draw is method else draw
            for draw in table(features)
        ]

    patch.setattr(op_decoder, "_op_table", patched)


@mutant("7.9/fade-refused")
def fade_behind_its_end_taken(patch):
    taken(patch, spec.CODE_COUNT, "fade")


@mutant("7.9/ramp-refused")
def ramp_behind_the_palette_taken(patch):
    taken(patch, spec.CODE_OUTSIDE, "ramp")

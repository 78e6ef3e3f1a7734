"""Devices that break section 7.7: range-coded chains."""

from __future__ import annotations

from broken_devices.mutant import around, mutant
from firmware_sim import op_decoder, range_coded_chains, range_decoder, spec
from firmware_sim.packet_error import Refusal


@mutant("7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-too-many", "7.7/arc-cut", "7.7/arc-long")
def arc_models_learn_slower(patch):
    patch.setattr(range_decoder.spec, "ARC_ENOUGH", 8)


@mutant("7.7/arc-long", "7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-cut", "7.7/arc-too-many")
def arc_forgets_turns(patch):
    def turn(old, self, bits_):
        if self.way and not self.last:
            self.way = 0
        old(self, bits_)

    around(patch, range_coded_chains._Axis, "turn", turn)


@mutant("7.7/arc-long", "7.7/arc-too-many", "7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-cut")
def arc_runs_too_long(patch):
    patch.setattr(range_coded_chains.spec, "ARC_MAX_RUN", 7)


@mutant("7.7/arc-too-many")
def arc_padding_taken(patch):
    patch.setattr(range_decoder.Bits, "done", property(lambda self: self._at >= len(self._data)))

    def step(old, *args):
        try:
            yield from old(*args)
        except Refusal as refusal:
            if refusal.code != spec.CODE_PADDING:
                raise

    around(patch, op_decoder, "arc", step)


@mutant("7.7/arc-dot", "7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-behind-ops")
def arc_start_left_out(patch):
    def pieces(old, *args):
        for pen, voxels in old(*args):
            yield pen, voxels[1:]

    around(patch, op_decoder, "arc", pieces)


@mutant("7.7/arc-empty")
def empty_arc_refused(patch):
    def pieces(old, operands_, *args):
        found = list(old(operands_, *args))
        if not found:
            raise operands_.refusal(spec.CODE_TRUNCATED, "")
        return found

    around(patch, op_decoder, "arc", pieces)


@mutant("7.7/arc-long")
def arc_runs_without_end(patch):
    patch.setattr(range_coded_chains.spec, "ARC_MAX_RUN", 1 << 30)

"""Devices that break section 7.7: range-coded chains."""

from __future__ import annotations

from broken_devices.mutant import around, mutant
from firmware_sim import op_decoder, range_coded_chains, range_decoder, spec
from firmware_sim.packet_error import PacketError


@mutant(
    "7.10/arc2-fades",
    "7.10/arc2-pens",
    "7.10/arc2-starts",
    "7.7/arc-curves",
    "7.7/arc-pieces",
    "7.7/arc-too-many",
    "7.7/arc-cut",
    "7.7/arc-long",
)
def arc_models_learn_slower(patch):
    patch.setattr(range_decoder.spec, "ARC_ENOUGH", 8)


@mutant(
    "7.10/arc2-fades",
    "7.10/arc2-pens",
    "7.10/arc2-starts",
    "7.7/arc-long",
    "7.7/arc-curves",
    "7.7/arc-pieces",
    "7.7/arc-cut",
    "7.7/arc-too-many",
)
def arc_forgets_turns(patch):
    def turn(old, self, bits_):
        if self.direction and not self.last:
            self.direction = 0
        old(self, bits_)

    around(patch, range_coded_chains._Axis, "move", turn)


@mutant("7.7/arc-long", "7.7/arc-too-many", "7.7/arc-curves", "7.7/arc-pieces", "7.7/arc-cut")
def arc_runs_too_long(patch):
    patch.setattr(range_coded_chains.spec, "ARC_MAX_RUN", 7)


@mutant("7.10/arc2-refused", "7.7/arc-too-many")
def arc_padding_taken(patch):
    patch.setattr(
        range_decoder.RangeDecoder, "exhausted", property(lambda self: self._at >= len(self._data))
    )

    def step(old, *args, **how):
        try:
            yield from old(*args, **how)
        except PacketError as refusal:
            if refusal.code != spec.CODE_PADDING:
                raise

    around(patch, op_decoder, "decode_chains", step)


@mutant(
    "7.10/arc2-fade-before",
    "7.10/arc2-fades",
    "7.10/arc2-pens",
    "7.10/arc2-starts",
    "7.7/arc-dot",
    "7.7/arc-curves",
    "7.7/arc-pieces",
    "7.7/arc-behind-ops",
)
def arc_start_left_out(patch):
    def pieces(old, *args, **how):
        for pen, voxels in old(*args, **how):
            yield pen, voxels[1:]

    around(patch, op_decoder, "decode_chains", pieces)


@mutant("7.7/arc-empty")
def empty_arc_refused(patch):
    def pieces(old, operands_, *args, **how):
        found = list(old(operands_, *args, **how))
        if not found:
            raise operands_.error(spec.CODE_TRUNCATED, "")
        return found

    around(patch, op_decoder, "decode_chains", pieces)


@mutant("7.7/arc-long")
def arc_runs_without_end(patch):
    patch.setattr(range_coded_chains.spec, "ARC_MAX_RUN", 1 << 30)

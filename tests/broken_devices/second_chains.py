"""Devices that break section 7.10: range-coded chains with fades and near starts."""

from __future__ import annotations

from broken_devices.mutant import Decoder, around, mutant
from firmware_sim import fades, range_coded_chains, range_decoder, spec
from firmware_sim.packet_error import PacketError


@mutant("7.10/arc2-starts", "7.10/arc2-refused", spreads=True)
def arc2_starts_yxz(patch):
    def start(old, bits, operands, axes, latest):
        return old(bits, operands, [axes[1], axes[0], axes[2]], latest)

    around(patch, range_coded_chains, "_start", start)


@mutant("7.10/arc2-fades", spreads=True)
def arc2_fade_stands_still(patch):
    def pens(old, self, voxels, *, again):
        return ((voxel, self.pixel) for voxel in voxels)

    around(patch, fades.Fade, "pens", pens)


@mutant("7.10/arc2-fade-before")
def arc2_forgets_the_fade(patch):
    old = range_coded_chains.decode_chains

    def decode(operands, grid, pixel_format, pen, **how):
        return old(operands, grid, pixel_format, getattr(pen, "pixel", pen), **how)

    patch.setattr("firmware_sim.op_decoder.decode_chains", decode)


def without(patch, code):
    """Take an ARC2 that is refused with a code, as far as it is drawn."""

    def pieces(old, self, found):
        try:
            old(self, found)
        except PacketError as refusal:
            if refusal.code != code:
                raise

    around(patch, Decoder, "_draw_pieces", pieces)


@mutant("7.10/arc2-fade-refused")
def arc2_fade_behind_its_end_taken(patch):
    without(patch, spec.CODE_COUNT)


@mutant("7.10/arc2-outside", "7.7/arc-off-the-grid")
def arc2_outside_taken(patch):
    without(patch, spec.CODE_OUTSIDE)


@mutant("7.10/arc2-refused", "7.7/arc-too-many")
def arc2_padding_taken(patch):
    without(patch, spec.CODE_PADDING)


@mutant("7.10/arc2-pens", "7.10/arc2-fades", spreads=True)
def arc2_without_its_fade_bit(patch):
    def bit(old, self, model):
        return 0 if model == spec.ARC2_FADE else old(self, model)

    around(patch, range_decoder.RangeDecoder, "bit", bit)

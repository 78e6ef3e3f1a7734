"""Devices that break section 7.13: range-coded pixels."""

from __future__ import annotations

from broken_devices.mutant import around, mutant
from firmware_sim import op_decoder, range_coded_values, spec
from firmware_sim.packet_error import PacketError
from firmware_sim.range_coded_values import _Values

ROUGH, SMOOTH = "7.13/values-rough", "7.13/values-smooth"
COPIES, WEIGHTED, BOXES = "7.13/values-copies", "7.13/values-weighted", "7.13/values-boxes"


@mutant(SMOOTH, ROUGH, WEIGHTED, spreads=True)
def values_models_learn_slower(patch):
    patch.setattr(range_coded_values.spec, "VALUES_PACE", 3)


@mutant(COPIES, spreads=True)
def values_copies_forget_the_one_before(patch):
    def copy(old, self, *near):
        self._missed = 0
        return old(self, *near)

    around(patch, _Values, "_copy", copy)


@mutant(COPIES, spreads=True)
def values_copies_leave_the_error(patch):
    def pixel(old, self, *place):
        errors = self._errors
        found = old(self, *place)
        if self._copies and not self._missed:
            self._errors = errors
        return found

    around(patch, _Values, "_pixel", pixel)


@mutant(WEIGHTED, BOXES, spreads=True)
def values_ignore_weights(patch):
    def predict(old, self, *known):
        weights, self._weights = self._weights, []
        try:
            return old(self, *known)
        finally:
            self._weights = weights

    around(patch, _Values, "_predict", predict)


@mutant(SMOOTH, ROUGH, spreads=True)
def values_predict_by_a_row_alone(patch):
    def predict(old, self, levels, last):
        return old(self, [levels[0], *levels[1:]] if self._weights else [*levels[:2], None], last)

    around(patch, _Values, "_predict", predict)


@mutant(BOXES)
def values_go_on_from_the_box_before(patch):
    def begin_box(old, self, slab):
        last = self._last
        old(self, slab)
        self._last = last or self._last

    around(patch, _Values, "begin_box", begin_box)


@mutant("7.13/values-levels", ROUGH, spreads=True)
def values_of_large_residuals_are_cut(patch):
    def residual(old, self, *models):
        return max(-99, min(99, old(self, *models)))

    around(patch, _Values, "_residual", residual)


@mutant("7.13/values-dot", spreads=True)
def values_begin_at_0(patch):
    def begin_box(old, self, slab):
        old(self, slab)
        self._last = tuple(0 for _ in self._last)

    around(patch, _Values, "begin_box", begin_box)


def _around_values(patch, wrapper):
    """Replace the decoder of VALUES by wrapper(old, operands, ...)."""
    around(patch, op_decoder, "decode_values", wrapper)


def _taken(patch, code):
    """Take a VALUES as drawn where it is to be refused with a code."""

    def values(old, *args):
        try:
            yield from old(*args)
        except PacketError as refusal:
            if refusal.code != code:
                raise

    _around_values(patch, values)


@mutant("7.13/values-too-many-bytes")
def values_padding_taken(patch):
    _taken(patch, spec.CODE_PADDING)


@mutant("7.13/values-cut")
def values_cut_taken(patch):
    _taken(patch, spec.CODE_TRUNCATED)


@mutant("7.13/values-no-pixel")
def values_that_are_no_pixels_taken(patch):
    _taken(patch, spec.CODE_PIXEL)


@mutant("7.13/values-too-many-cells", "7.13/values-off-the-grid")
def values_outside_taken(patch):
    _taken(patch, spec.CODE_OUTSIDE)


@mutant("7.13/values-off-the-grid")
def values_refuse_a_pixel_before_a_voxel(patch):
    def values(old, operands_, *args):
        try:
            yield from old(operands_, *args)
        except PacketError as refusal:
            if refusal.code != spec.CODE_OUTSIDE or "(" not in str(refusal):
                raise
            raise operands_.error(spec.CODE_PIXEL, "") from refusal

    _around_values(patch, values)


@mutant("7.13/values-empty")
def empty_values_refused(patch):
    def values(old, operands_, *args):
        found = list(old(operands_, *args))
        if not found:
            raise operands_.error(spec.CODE_TRUNCATED, "")
        return found

    _around_values(patch, values)


@mutant("7.13/values-wide", BOXES, SMOOTH, spreads=True)
def values_have_boxes_of_another_width(patch):
    patch.setattr(range_coded_values.spec, "VALUES_SIDE_BITS", spec.SLABS_SIDE_BITS)

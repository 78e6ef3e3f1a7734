"""Devices that break section 7.11: range-coded slabs."""

from __future__ import annotations

from broken_devices.mutant import around, mutant
from firmware_sim import op_decoder, range_coded_slabs, spec
from firmware_sim.packet_error import PacketError
from firmware_sim.range_coded_slabs import _Box

SHELLS = ("7.11/slabs-surfaces", "7.11/slabs-boxes")
DRAWN = (*SHELLS, "7.11/slabs-solids")


@mutant(*DRAWN, spreads=True)
def slabs_models_learn_slower(patch):
    patch.setattr(range_coded_slabs.spec, "SLABS_PACE", 2)


@mutant(*DRAWN, spreads=True)
def slabs_models_go_on_counting(patch):
    patch.setattr(range_coded_slabs.spec, "SLABS_ENOUGH", 9)


@mutant(*SHELLS, spreads=True)
def slabs_forget_the_slab_before(patch):
    def slab(old, self, slices):
        self._states = self._no_cells()
        return old(self, slices)

    around(patch, _Box, "slab", slab)


@mutant("7.11/slabs-boxes", "7.13/values-boxes")
def slabs_go_on_from_the_box_before(patch):
    def boxes(old, self, *args):
        old(self, *args)
        before, boxes.box = boxes.box, self
        if before and before._bits is self._bits and len(before._below) == len(self._below):
            self._below = before._below

    boxes.box = None
    around(patch, _Box, "__init__", boxes)


def _taken(patch, code):
    """Take a SLABS as drawn where it is to be refused with a code."""

    def slabs(old, *args):
        try:
            yield from old(*args)
        except PacketError as refusal:
            if refusal.code != code:
                raise

    around(patch, op_decoder, "decode_slabs", slabs)


@mutant("7.11/slabs-too-many-bytes")
def slabs_padding_taken(patch):
    _taken(patch, spec.CODE_PADDING)


@mutant("7.11/slabs-cut")
def slabs_cut_taken(patch):
    _taken(patch, spec.CODE_TRUNCATED)


@mutant("7.11/slabs-empty")
def empty_slabs_refused(patch):
    def slabs(old, operands_, *args):
        found = list(old(operands_, *args))
        if not found:
            raise operands_.error(spec.CODE_TRUNCATED, "")
        return found

    around(patch, op_decoder, "decode_slabs", slabs)


@mutant("7.11/slabs-too-many-cells", "7.13/values-too-many-cells")
def slabs_without_a_limit_of_cells(patch):
    patch.setattr(range_coded_slabs, "_cell_limit", lambda _: 1 << 40)


@mutant(*DRAWN, "7.11/slabs-too-many-cells", "7.11/slabs-wide", spreads=True)
def slabs_limited_to_one_layer(patch):
    patch.setattr(range_coded_slabs, "_cell_limit", lambda cells: cells[0] * cells[1])


@mutant("7.11/slabs-off-the-grid", "7.13/values-off-the-grid")
def slabs_are_clipped_at_the_grid(patch):
    def add(old, self, x, y, group, voxels):
        for place in range(4):
            inside = self._grid.contains(self._x + x + place, self._y + y, self._z)
            group &= ~(0 if inside else 1 << place)
        if group:
            old(self, x, y, group, voxels)

    around(patch, _Box, "_add", add)


@mutant("7.11/slabs-dot", *DRAWN, spreads=True)
def slabs_end_a_slice_too_early(patch):
    def slab(old, self, slices):
        self._z += 1
        return old(self, slices)

    around(patch, _Box, "slab", slab)

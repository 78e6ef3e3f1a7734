"""The bit-by-bit trace of range-coded chains in protocol.md, on the emulator's decoder."""

import re

import document
import pytest

from firmware_sim import range_coded_chains, spec
from firmware_sim.grid import Grid
from firmware_sim.memory import FORMATS
from firmware_sim.operands import Operands
from firmware_sim.range_decoder import RangeDecoder

TRACES = re.findall(r"```trace (\S+)\n.*\n((?:.+\n)+?)```", document.TEXT)
FIRST_OF_MODELS = {"COUNT", "LONE", "TURN", "MAIN", "HISTORY", "RUNS"}


def model_number(name):
    base, _, offset = name.partition(" + ")
    assert bool(offset) == (base in FIRST_OF_MODELS)
    return getattr(spec, f"ARC_{base}") + int(offset or 0)


class TracingDecoder(RangeDecoder):
    """Range decoder that notes models, range, code, bound and value of every bit."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.models = []
        type(self).trace = []

    def _decode(self, bound):
        state = (self._range, self._code, bound)
        value = super()._decode(bound)
        self.trace.append((self.models, *state, value))
        self.models = []
        return value

    def bit(self, model):
        self.models = [model]
        return super().bit(model)

    def mixed_bit(self, one, other):
        self.models = [one, other]
        return super().mixed_bit(one, other)


@pytest.mark.parametrize(("name", "lines"), TRACES)
def test_each_bit_is_decoded_as_the_trace_says(name, lines, monkeypatch):
    (vector,) = (vector for vector in document.vectors("ops") if vector.name == name)
    monkeypatch.setattr(range_coded_chains, "RangeDecoder", TracingDecoder)
    operands = Operands(bytes(3) + vector.hex("ops"), 1)
    operands.op()
    grid = Grid(*vector.grid)
    pixel_format = FORMATS[vector["format"].lower()]
    for _ in range_coded_chains.decode_chains(operands, grid, pixel_format, pixel_format.full):
        pass
    for number, line in enumerate(lines.splitlines()):
        bit, models, *state, value = re.split(r"\s{2,}", line.strip())
        assert int(bit) == number + 1
        expected = [] if models == "plain" else [model_number(n) for n in models.split(", ")]
        assert TracingDecoder.trace[number] == (
            expected, *(int(word, 16) for word in state), int(value)
        )  # fmt: skip


def test_there_is_a_trace():
    assert TRACES

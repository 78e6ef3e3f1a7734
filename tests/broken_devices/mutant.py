"""Broken devices: a part of the emulator is replaced by a faulty one.

Knows no section of protocol.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from firmware_sim import device, memory, op_decoder, operands, receiver
from firmware_sim import session as sessions

Device, Session, Receiver = device.Device, sessions.Session, receiver.Receiver
Decoder, Operands, Page = op_decoder._PacketDecoder, operands.Operands, memory.Page


@dataclass(frozen=True)
class Mutant:
    """A fault.

    ``make`` takes pytest's monkeypatch; ``config`` is for the device. ``fails`` are the checks that
    must fail. No others may, unless the fault ``spreads`` because all drawing passes through it.
    ``likely`` must be part of the likely cause that the kit reports.
    """

    name: str
    make: Callable
    fails: tuple[str, ...]
    spreads: bool = False
    likely: str = ""
    config: dict = field(default_factory=dict)

    def __str__(self) -> str:
        return self.name


MUTANTS: list[Mutant] = []


def mutant(*fails: str, spreads: bool = False, likely: str = "", **config: object):
    def register(make: Callable) -> Callable:
        name = make.__name__.strip("_").replace("_", "-")
        MUTANTS.append(Mutant(name, make, fails, spreads, likely, config))
        return make

    return register


def around(patch, owner, name, wrapper):
    """Replace a method by wrapper(old, self, ...)."""
    old = getattr(owner, name)
    patch.setattr(owner, name, lambda *args, **more: wrapper(old, *args, **more))


def on_hello(patch, change):
    """Change what a device is after HELLO: change(device, packet, session before)."""

    def hello(old, self, packet):
        session = self.session
        old(self, packet)
        change(self, packet, session)

    around(patch, Device, "_hello", hello)


def on_op(patch, name, wrapper):
    """Change a method that is named in the table of ops."""
    around(patch, Decoder, name, wrapper)

"""Does a device keep to protocol.md? A kit that asks it, sentence by sentence.

It is a third reading of the document, beside the driver's and the emulator's, and written to be
read by whoever has built a device and sees a check fail::

    catalogue   what a check is
    checks/     the checks, by section
    probe       the hands that they have: show, look, read back
    dialogue    what the hands are made of: send, hear, ask, demand
    run         one after the other, and what came of each
    packets  device  page  decoder  arc     packets, INFO, pages and ops, in their simplest form
    mistakes    decoders that misread one rule each, to name what is probably wrong

The kit must be able to say wrong things, so it does not use ``voxdisplay.link``; and what it
expects must not come from what it judges, so it uses none of the driver's coders: of
``voxdisplay.wire`` it takes the literals alone.
"""

from voxdisplay.conformance.catalogue import CHECKS, Check
from voxdisplay.conformance.run import Result, Verdict, run_checks

__all__ = ["CHECKS", "Check", "Result", "Verdict", "run_checks"]

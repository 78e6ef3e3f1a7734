"""Conformance test kit: checks a device against protocol.md, requirement by requirement.

It is an independent third implementation of the document, besides the driver and the emulator. It
is meant to be read by whoever has built a device and sees a check fail::

    catalogue             registry of checks, and their preconditions
    checks/               the checks, by section of protocol.md
    run, report           execution of the checks, and presentation of the results
    probe, dialogue       what a check can do: draw and read back; send, receive and require
    packets, ops          packets and ops as bytes, valid or not
    announced_device      what a device announces in INFO
    response_reader       parsing and well-formedness rules of responses
    credit_limit          what the device has granted, across all checks
    reference_decoder, reference_page, range_coded_chains
                          section 7 and 8 in their simplest form: what ops must draw
    device_bugs           decoders that each misread one rule, to name the likely cause
    handshake_diagnosis   likely causes of a HELLO without response
    saved_page            the picture before the checks, restored after them

The kit must be able to send invalid packets, so it does not use ``voxdisplay.link``. What it
expects must not come from the driver, so it uses none of its encoders: of ``voxdisplay.wire`` it
imports the literals alone.
"""

from voxdisplay.conformance.catalogue import CHECKS, Check
from voxdisplay.conformance.run import Result, Verdict, run_checks

__all__ = ["CHECKS", "Check", "Result", "Verdict", "run_checks"]

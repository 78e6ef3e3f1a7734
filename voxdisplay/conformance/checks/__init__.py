"""The checks, a module for some sections each; in the order in which they are made."""

from voxdisplay.conformance.checks import (  # noqa: F401, I001 - the order is that of the checks
    delimiting,
    kinds,
    greeting,
    frames,
    waiting,
    drawing,
    shapes,
    bricks,
    arcs,
    digests,
    acks,
    window,
    credit,
    reading,
    outside,
    refusals,
    malformed,
    answers,
)

"""The checks, one module per topic, imported in the order in which they run."""

from voxdisplay.conformance.checks import (  # noqa: F401, I001 - the order is that of the checks
    delimiting,
    packet_types,
    handshake,
    frames,
    pending_swap,
    drawing,
    shapes,
    voxel_sets,
    fades,
    range_coded_chains,
    second_chains,
    digests,
    acks,
    window,
    credit,
    readback,
    out_of_bounds,
    refusals,
    malformed,
    all_responses,
)

"""Section 8: the digest is that of the front page, whatever has been written."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, feature, voxels
from voxdisplay.conformance.probe import Probe


@check("8", "dark", "a dark page has the digest 0", feature("DIGEST"))
def dark(probe: Probe) -> None:
    probe.show(b"", exactly=True)


@check("8", "one-voxel", "the digest of one voxel is mix(index, value)", feature("DIGEST"))
def one_voxel(probe: Probe) -> None:
    said = probe.said
    for index in sorted({0, 1 % said.voxels, said.voxels // 2, said.voxels - 1}):
        probe.show(ops.dot(said, index, ops.some_value(said, probe.rng)), exactly=True)


@check("8", "sum", "the digest of a page is the sum over its voxels", feature("DIGEST"), voxels(2))
def sum_(probe: Probe) -> None:
    said, rng = probe.said, probe.rng
    most = min(said.voxels, 300, (said.max_payload - 8) // said.pixel_bytes)
    for _ in range(4):
        values = [ops.some_value(said, rng) * rng.randrange(2) for _ in range(most)]
        before = ops.skip(rng.randrange(said.voxels - most + 1))
        probe.show(before + ops.literal(said, values), exactly=True)


@check(
    "8", "overwritten", "an overwritten pixel takes its term out of the digest", feature("DIGEST")
)
def overwritten(probe: Probe) -> None:
    said = probe.said
    back = ops.move(said, (0, 0, 0))
    probe.show(ops.run() + back + ops.pen(said, 1) + ops.run(), exactly=True)
    probe.show(ops.run() + back + ops.run() + back + ops.run(), exactly=True)
    probe.show(ops.pen(said, 1) + ops.run(), clear=False, exactly=True)


@check(
    "8", "erased", "a pixel that becomes dark takes its term out of the digest", feature("DIGEST")
)
def erased(probe: Probe) -> None:
    said = probe.said
    back = ops.move(said, (0, 0, 0))
    probe.show(ops.run() + back + ops.pen(said, 0) + ops.run(), exactly=True)
    probe.show(ops.run(), exactly=True)
    probe.show(ops.literal(said, [0]), clear=False, exactly=True)


@check("8", "kept", "a copied page has the digest of its original", feature("DIGEST"), voxels(3))
def kept(probe: Probe) -> None:
    said = probe.said
    probe.show(ops.dot(said, 0), exactly=True)
    probe.show(b"", clear=False, exactly=True)
    probe.show(ops.dot(said, 2), clear=False, exactly=True)


@check(
    "8", "of-the-front", "the digest is that of the front page, not of the back", feature("DIGEST")
)
def of_the_front(probe: Probe) -> None:
    ack = probe.show(ops.dot(probe.said, 0), exactly=True)
    probe.draw(ops.dot(probe.said, probe.said.voxels - 1, 0))
    probe.sync()
    probe.demand_ack(
        probe.state, "what is drawn into the back page is not on display", digest=ack.digest
    )


@check(
    "8", "given-up", "a frame given up leaves nothing in the digest", feature("DIGEST"), voxels(2)
)
def given_up(probe: Probe) -> None:
    probe.show(ops.dot(probe.said, 0), exactly=True)
    probe.draw(ops.dot(probe.said, 1), clear=False)
    probe.frame += 1
    probe.show(b"", clear=False, exactly=True)

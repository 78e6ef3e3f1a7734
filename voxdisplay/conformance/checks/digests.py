"""Checks of section 8: the digest of the front page."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, feature, min_voxels
from voxdisplay.conformance.probe import Probe


@check("8", "dark", "a dark page has the digest 0", feature("DIGEST"))
def dark(probe: Probe) -> None:
    probe.show(b"", exactly=True)


@check("8", "one-voxel", "the digest of one voxel is mix(index, value)", feature("DIGEST"))
def one_voxel(probe: Probe) -> None:
    device = probe.device
    for index in sorted(
        {0, 1 % device.voxel_count, device.voxel_count // 2, device.voxel_count - 1}
    ):
        probe.show(
            ops.single_voxel(device, index, ops.random_pixel(device, probe.rng)), exactly=True
        )


@check(
    "8", "sum", "the digest of a page is the sum over its voxels", feature("DIGEST"), min_voxels(2)
)
def sum_(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    most = min(device.voxel_count, 300, (device.max_payload - 8) // device.pixel_bytes)
    for _ in range(4):
        values = [ops.random_pixel(device, rng) * rng.randrange(2) for _ in range(most)]
        before = ops.skip(rng.randrange(device.voxel_count - most + 1))
        probe.show(before + ops.literal(device, values), exactly=True)


@check(
    "8", "overwritten", "overwriting a pixel removes its term from the digest", feature("DIGEST")
)
def overwritten(probe: Probe) -> None:
    device = probe.device
    back = ops.move(device, (0, 0, 0))
    probe.show(ops.run() + back + ops.pen(device, 1) + ops.run(), exactly=True)
    probe.show(ops.run() + back + ops.run() + back + ops.run(), exactly=True)
    probe.show(ops.pen(device, 1) + ops.run(), clear=False, exactly=True)


@check(
    "8", "erased", "a pixel that becomes dark removes its term from the digest", feature("DIGEST")
)
def erased(probe: Probe) -> None:
    device = probe.device
    back = ops.move(device, (0, 0, 0))
    probe.show(ops.run() + back + ops.pen(device, 0) + ops.run(), exactly=True)
    probe.show(ops.run(), exactly=True)
    probe.show(ops.literal(device, [0]), clear=False, exactly=True)


@check(
    "8", "kept", "a copied page has the digest of its original", feature("DIGEST"), min_voxels(3)
)
def kept(probe: Probe) -> None:
    device = probe.device
    probe.show(ops.single_voxel(device, 0), exactly=True)
    probe.show(b"", clear=False, exactly=True)
    probe.show(ops.single_voxel(device, 2), clear=False, exactly=True)


@check(
    "8", "of-the-front", "the digest is that of the front page, not of the back", feature("DIGEST")
)
def of_the_front(probe: Probe) -> None:
    ack = probe.show(ops.single_voxel(probe.device, 0), exactly=True)
    probe.draw(ops.single_voxel(probe.device, probe.device.voxel_count - 1, 0))
    probe.poll_status()
    probe.require_ack(
        probe.state, "what is drawn into the back page is not on display", digest=ack.digest
    )


@check(
    "8",
    "given-up",
    "an abandoned frame leaves nothing in the digest",
    feature("DIGEST"),
    min_voxels(2),
)
def given_up(probe: Probe) -> None:
    probe.show(ops.single_voxel(probe.device, 0), exactly=True)
    probe.draw(ops.single_voxel(probe.device, 1), clear=False)
    probe.frame += 1
    probe.show(b"", clear=False, exactly=True)

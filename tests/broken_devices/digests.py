"""Devices that break section 8: the digest."""

from __future__ import annotations

from broken_devices.mutant import Device, Page, around, mutant
from firmware_sim import spec

EVERY_DIGEST = (
    "7.6/colors",
    "7.6/palette-of-a-page",
    "8/dark",
    "8/one-voxel",
    "8/sum",
    "8/overwritten",
    "8/erased",
    "8/kept",
    "8/of-the-front",
)


@mutant(
    "7.9/ramps",
    *EVERY_DIGEST,
    "8/given-up",
    likely="adds dark voxels",
)
def digest_adds_dark_voxels(patch):
    def mix(index, value):
        h = (index * 0x9E3779B1 + value * 0x85EBCA77) & 0xFFFFFFFF
        h = (h ^ h >> 15) * 0x2C1B3C6D & 0xFFFFFFFF
        h = (h ^ h >> 12) * 0x297A2D39 & 0xFFFFFFFF
        return h ^ h >> 15

    def digest(self):
        right = old.fget(self)
        dark = sum(mix(i, 0) for i, pixel in enumerate(self.pixels) if not pixel)
        return (right + dark) & 0xFFFFFFFF

    old = Page.digest
    patch.setattr(Page, "digest", property(digest))
    patch.setattr(Page, "copy_from", lambda self, other: self.put(0, other.pixels))


@mutant("8/overwritten", "8/erased")
def digest_forgets_to_take_out(patch):
    around(
        patch,
        Page,
        "_log_pixels",
        lambda old, self, before, now: old(self, bytes(len(before)), now),
    )


@mutant(
    "7.9/ramps",
    *EVERY_DIGEST,
)
def digest_of_the_back_page(patch):
    patch.setattr(
        Device,
        "memory",
        property(lambda self: self._memory, lambda self, value: setattr(self, "_memory", value)),
        raising=False,
    )

    def acknowledge(old, self, tag=None):
        memory_ = self.memory
        memory_.front, memory_.back = memory_.back, memory_.front
        old(self, tag)
        memory_.front, memory_.back = memory_.back, memory_.front

    around(patch, Device, "_acknowledge", acknowledge)


@mutant("8/answers-digest", features=frozenset(("read",)))
def digest_without_the_feature(patch):
    def init(old, self, config):
        old(self, config)
        self._features |= 1 << spec.FEATURE_DIGEST

    around(patch, Device, "__init__", init)

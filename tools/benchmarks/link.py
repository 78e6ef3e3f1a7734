"""Benchmark of the encoders: bytes on the wire beside other codings, and encoding speed.

Other codings of the same pictures: runs in scan order (a count byte for dark voxels and one for lit
ones, LEB128 above 127, and the pixel), the same through LZ4 and through zstandard at level 19, and
the bare page. Those not installed are left out. Voxels count as often as they are drawn; for sets,
and for all but the driver's coding, as often as they are lit.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec

import numpy as np

import voxdisplay as vd
from benchmarks.pictures import SEED, Picture, beziers, phantom, pictures, radii
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.frame import Frame
from voxdisplay.link import Link
from voxdisplay.wire import chains, packet, spans, voxel_sets
from voxdisplay.wire.op_encoding import EncoderConfig

PAYLOAD = 1024
FEATURES = ("line", "box", "dots", "oct", "diff")
# Features of the columns from ARC on; VALUES stands beside SLABS, as both belong to sets.
RANGE_CODED = (("arc",), ("fade",), ("fade", "arc", "arc2"), ("slabs",), ("slabs", "values"))
# Bytes a second that a link carries: a UART sends ten bits for a byte; USB as measured by others.
RATES = {
    "115.2k": 11_520,
    "921.6k": 92_160,
    "3M": 300_000,
    "12M": 1_200_000,
    "USB FS": 1_000_000,
    "USB HS": 35_000_000,
}


# ------------------------------------------------------------------------------ other codings


def raster_runs(picture: Picture) -> bytes:
    """Encode runs in scan order: count of dark voxels, count of equal lit ones, their pixel."""
    frame = picture.frame
    values = frame.format.values(frame.array())
    runs = spans.page_runs(values)
    out = bytearray()
    mono = frame.format.value == "mono1"
    size = frame.format.bytes
    before = 0
    for start, length, value in zip(
        runs.start.tolist(), runs.length.tolist(), runs.value.tolist(), strict=True
    ):
        if value:
            for count in (start - before, length):
                rest = count
                while rest >= 0x80:
                    out.append(rest & 0x7F | 0x80)
                    rest >>= 7
                out.append(rest)
            before = start + length
            if not mono:
                out += value.to_bytes(size, "little")
    return bytes(out)


def others(picture: Picture) -> dict[str, int | None]:
    """Return the sizes of the other codings in bytes; None where one is not installed."""
    runs = raster_runs(picture)
    found: dict[str, int | None] = {"runs": len(runs), "+LZ4": None, "+zstd-19": None}
    if find_spec("lz4"):
        import lz4.block  # noqa: PLC0415 - need not be installed

        found["+LZ4"] = len(lz4.block.compress(runs, store_size=False))
    if find_spec("zstandard"):
        import zstandard  # noqa: PLC0415 - need not be installed

        found["+zstd-19"] = len(zstandard.ZstdCompressor(level=19).compress(runs))
    grid, pixel = picture.frame.grid, picture.frame.format
    bits = 1 if pixel.value == "mono1" else 8 * pixel.bytes
    found["raw"] = grid.voxels * bits // 8
    return found


# ---------------------------------------------------------------------------------- the table


def work_s(work: Callable[[], object], repeats: int) -> float:
    """Return the median processor time of some work in seconds."""
    seconds = []
    for _ in range(repeats):
        began_s = time.process_time()
        work()
        seconds.append(time.process_time() - began_s)
    return statistics.median(seconds)


def on_wire(payloads: Sequence[bytes]) -> int:
    """Return the size of a frame on the wire in bytes."""
    return sum(len(packet.encode(packet.Data(ops=ops))) for ops in payloads or [b""])


def features_for(frame: Frame) -> tuple[str, ...]:
    """Return the features of version 1.0, but for ARC, that a frame may use."""
    indexed = frame.format.value in {"index8", "mono1"}
    features = FEATURES if indexed else tuple(name for name in FEATURES if name != "diff")
    return (*features, "palette") if frame.has_own_palette else features


def bench_link(repeats: int, *, quick: bool = False) -> None:
    """Print what frames cost on the wire, and how fast they are coded and framed."""
    head = f"{'picture':<24}{'voxels':>9}{'bytes':>9}{'bit/vox':>8}{'target':>7}"
    head += "".join(f"{name:>7}" for name in ("ARC", "FADE", "ARC2", "SLABS", "VALUES"))
    head += "".join(f"{name:>9}" for name in ("runs", "+LZ4", "+zstd-19", "raw"))
    head += f"{'share':>7}{'code ms':>8}{'MB/s':>7}"
    print(f"bits a voxel by coding; frames a second by link\n{head}", end="")
    print("".join(f"{name:>8}" for name in RATES))
    for picture in pictures(quick=quick):
        frame = picture.frame
        features = features_for(frame)
        payloads = frame.payloads(PAYLOAD, features)
        code_s = work_s(
            lambda frame=frame, features=features: frame.payloads(PAYLOAD, features), repeats
        )
        ops, wire = sum(map(len, payloads)), on_wire(payloads)
        bits = ops * 8 / picture.voxels
        lit = picture.voxels if frame.format.value == "index8" else len(frame.lit()[0])
        line = f"{picture.name:<24}{picture.voxels:9d}{ops:9d}{bits:8.2f}"
        line += f"{picture.target:7.1f}" if picture.target else f"{'-':>7}"
        # Range-coded, as on a slow line; where that is longer, it is not done.
        for more in RANGE_CODED:
            if "values" in more and frame.format.value == "mono1":
                line += f"{'-':>7}"
                continue
            coded = sum(map(len, frame.payloads(PAYLOAD, (*features, *more))))
            line += f"{coded * 8 / picture.voxels:7.2f}" if coded < ops else f"{'-':>7}"
        for size in others(picture).values():
            line += f"{'-':>9}" if size is None else f"{size * 8 / lit:9.2f}"
        line += f"{ops / wire:7.4f}{code_s * 1e3:8.2f}{ops / code_s / 1e6:7.2f}"
        for rate in RATES.values():
            line += f"{rate / wire:8.2f}" if rate / wire < 1000 else f"{rate / wire:8.0f}"
        print(line, flush=True)
    bench_speeds(repeats, 32 if quick else 128)


def bench_speeds(repeats: int, side: int) -> None:
    """Print the speed of each stage by itself, beside memcpy."""
    grid = vd.Frame((side, side, side), "mono1").grid
    bits = sum(1 << bit for bit in range(4))
    mono = EncoderConfig(grid, vd.Frame((1, 1, 1), "mono1").format, PAYLOAD, bits)
    dense = EncoderConfig(grid, vd.Frame((1, 1, 1), "index8").format, PAYLOAD, 1 << 4)
    voxels = np.concatenate(
        [s.voxels for s in vd.voxelize_many(beziers(side, 10 * side, side / 2))]
    )
    pens = np.ones(len(voxels), dtype=np.int64)
    shell = np.flatnonzero(abs(radii(side)[0] - side * 0.455) < 0.5)
    head = phantom(side).reshape(-1).astype(np.uint32)
    noise = np.random.default_rng(SEED).integers(0, 256, 1 << 20, dtype=np.uint8).tobytes()
    payloads = [noise[at : at + PAYLOAD] for at in range(0, len(noise), PAYLOAD)]
    page = b"".join(b"\xdf\xe0\x07" + noise[at : at + 1024] for at in range(0, len(noise), 1024))
    print(f"\n{'stage':<40}{'seconds':>10}")
    rates = [
        ("STEP, Beziers", lambda: chains.encode_chains(voxels, pens, mono), len(voxels), "voxels"),
        ("OCT, sphere shell", lambda: voxel_sets.encode_set_payloads(shell, shell * 0 + 1, mono),
         len(shell), "voxels"),
        ("SKIP/RUN/LIT/DIFF, head", lambda: spans.encode_spans(head, dense), len(head), "voxels"),
        ("reading back: LIT of a PAGE",
         lambda: spans.decode_spans(page, len(noise), dense.format), len(noise), "voxels"),
        ("framing: pack, CRC, COBS", lambda: on_wire(payloads), len(noise), "bytes"),
        ("memcpy", lambda: bytearray(noise), len(noise), "bytes"),
    ]  # fmt: skip
    rows = [(name, work_s(work, repeats), amount, what) for name, work, amount, what in rates]
    coded = {
        "Beziers": (chains.encode_chains(voxels, pens, mono), len(voxels), mono),
        "sphere shell": (
            voxel_sets.encode_set_payloads(shell, shell * 0 + 1, mono),
            len(shell),
            mono,
        ),
        "head": (spans.encode_spans(head, dense), len(head), dense),
    }
    for name, (ops, amount, config) in coded.items():
        seconds = statistics.median(decode_s(ops, config) for _ in range(repeats))
        rows.append((f"the emulator's decoding: {name}", seconds, amount, "voxels"))
    for name, seconds, amount, what in rows:
        print(f"{name:<40}{seconds:10.5f}{amount / seconds / 1e6:10.2f} M {what}/s")


def decode_s(payloads: list[bytes], config: EncoderConfig) -> float:
    """Return the processor time of the emulator for a frame: delimiting, CRC, and drawing."""
    shape, pixel = tuple(config.grid), config.format.value
    device = Device(Config(grid=shape, pixel_format=pixel, refresh=0))
    link = Link(1, 0.0)
    seconds = 0.0
    ticket = None
    while ticket is None or link.backlog:
        if ticket is None and link.ready:
            ticket = link.present(payloads)
        sent = link.transmit(0.0)
        began_s = time.process_time()
        device.receive(sent)
        seconds += time.process_time() - began_s
        link.receive(device.transmit(), 0.0)
    return seconds

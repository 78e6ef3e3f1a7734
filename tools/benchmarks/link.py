"""Benchmark of the encoders: bytes on the wire beside other codings, and encoding speed.

Other codings of the same pictures: runs in scan order (a count byte for dark voxels and one for lit
ones, LEB128 above 127, and the pixel), the same through LZ4 and through zstandard at level 19, and
the bare page. Those not installed are left out. Voxels count as often as they are drawn; for sets,
and for all but the driver's coding, as often as they are lit.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray
from paper_tables import paper_curve

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.curves import Bezier, Curve, Helix, Lissajous, TorusKnot
from voxdisplay.frame import Frame
from voxdisplay.link import Link
from voxdisplay.wire import chains, packet, spans, voxel_sets
from voxdisplay.wire.op_encoding import EncoderConfig

SEED = 22
PAYLOAD = 1024
FEATURES = ("line", "box", "dots", "oct", "diff")
# Bytes a second that a link carries: a UART sends ten bits for a byte; USB as measured by others.
RATES = {
    "115.2k": 11_520,
    "921.6k": 92_160,
    "3M": 300_000,
    "12M": 1_200_000,
    "USB FS": 1_000_000,
    "USB HS": 35_000_000,
}


@dataclass(frozen=True)
class Picture:
    """A frame, its number of drawn voxels, and its target in bits per voxel."""

    name: str
    frame: Frame
    voxels: int
    target: float | None = None


# ------------------------------------------------------------------------------- the pictures


def of_curves(
    name: str, side: int, curves: Sequence[Curve], target: float | None, pixels: str = "mono1"
) -> Picture:
    """Return the picture of some curves."""
    return of_voxels(name, side, [s.voxels for s in vd.voxelize_many(curves)], target, pixels)


def of_voxels(
    name: str,
    side: int,
    drawn: Sequence[NDArray[np.integer]],
    target: float | None,
    pixels: str = "mono1",
    colors: Sequence[str] = ("white",),
) -> Picture:
    """Return the picture of voxel sequences in alternating colours."""
    frame = Frame((side, side, side), pixels)
    voxels = 0
    for number, each in enumerate(drawn):
        drawing = frame.draw(each, colors[number % len(colors)])
        voxels += drawing.voxels - drawing.clipped
    return Picture(name, frame, voxels, target)


def of_array(name: str, array: NDArray[np.generic], pixels: str, target: float | None) -> Picture:
    """Return the picture of an array; all voxels count if pixels have many values."""
    frame = Frame(array.shape[::-1], pixels)  # type: ignore[arg-type] - three sides
    frame.set(array)
    dense = pixels != "mono1"
    return Picture(name, frame, array.size if dense else len(frame.lit()[0]), target)


def gradients(name: str, side: int, curve: Curve, colors: Sequence[str]) -> Iterator[Picture]:
    """Return the pictures of a curve along which colours are spread, in each format.

    INDEX8 has a palette of its own.
    """
    sequence = vd.voxelize(curve)
    for pixels in ("rgb888", "rgb565", "index8"):
        frame = Frame((side, side, side), pixels, own_palette=pixels == "index8")
        drawing = frame.draw(sequence, list(colors))
        yield Picture(f"{name} {pixels}", frame, drawing.voxels - drawing.clipped)


def digital_line(start: NDArray[np.int64], end: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the straight line between two voxels, every coordinate rounded, halves up."""
    way = end - start
    length = max(1, int(np.abs(way).max()))
    k = np.arange(np.abs(way).max() + 1)[:, None]
    return start + (2 * k * way + length) // (2 * length)


def lines(side: int, count: int) -> list[NDArray[np.int64]]:
    """Return random segments between the centres of voxels."""
    ends = np.random.default_rng(SEED).integers(0, side, (count, 2, 3))
    return [digital_line(*pair) for pair in ends]


def beziers(side: int, count: int, spread: float) -> list[Curve]:
    """Return random cubic Beziers; control points are ``spread`` apart at most on each axis."""
    rng = np.random.default_rng(SEED)
    start = rng.uniform(0, side, (count, 1, 3))
    steps = rng.uniform(-spread, spread, (count, 4, 3))
    points = (start + np.cumsum(steps, axis=1)).clip(0.5, side - 0.5)
    return [Bezier(each) for each in points]


def knots(side: int) -> list[Curve]:
    """Return three torus knots that fill a cube."""
    middle = (side / 2,) * 3
    return [TorusKnot(p, q, middle, side * 0.3, side * 0.14) for p, q in ((2, 3), (3, 5), (5, 8))]


def waves(side: int) -> list[Curve]:
    """Return six Lissajous curves that fill a cube."""
    middle, reach = (side / 2,) * 3, (side * 0.45,) * 3
    ratios = [(1, 2, 3), (2, 3, 5), (3, 4, 5), (3, 5, 7), (1, 3, 4), (4, 5, 7)]
    return [Lissajous(middle, reach, ratio, (0.3, 0, 0.9)) for ratio in ratios]


def helices(side: int) -> list[Curve]:
    """Return six helices of different pitch."""
    return [
        Helix((side / 2, side / 2, 3), side * (0.1 + 0.06 * n), side * 0.9 / (n + 2), n + 2)
        for n in range(6)
    ]


def radii(side: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the distance of each voxel's centre from the cube's, and that from the z axis."""
    z, y, x = np.mgrid[:side, :side, :side] + 0.5 - side / 2
    flat = np.hypot(x, y)
    return np.hypot(flat, z), np.hypot(flat - side * 0.3, z)


def bumpy(side: int) -> NDArray[np.bool_]:
    """Return the voxels of a solid without symmetry that have a neighbour outside: its surface."""
    rng = np.random.default_rng(SEED)
    z, y, x = np.mgrid[:side, :side, :side] + 0.5 - side / 2
    radius = np.sqrt(x * x + y * y + z * z)
    bumps = np.zeros_like(radius)
    for _ in range(12):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        cosine = (x * direction[0] + y * direction[1] + z * direction[2]) / (radius + 1e-9)
        bumps += rng.uniform(-0.03, 0.03) * np.cos(
            rng.integers(2, 9) * np.arccos(cosine.clip(-1, 1))
        )
    solid = radius < side * (0.4 + bumps)
    inner = solid
    for axis in range(3):
        inner = inner & np.roll(inner, 1, axis) & np.roll(inner, -1, axis)
    return solid & ~inner


def phantom(side: int) -> NDArray[np.uint8]:
    """Return the head phantom of Shepp and Logan in 8 bits, with scanner noise in the head.

    Ellipsoids after Kak and Slaney, "Principles of Computerized Tomographic Imaging", table 3.1, in
    the usual continuation to three dimensions; contrasts raised so that they can be seen.
    """
    ellipsoids = [
        (200, 0.69, 0.92, 0.81, 0, 0, 0, 0),
        (-130, 0.6624, 0.874, 0.78, 0, -0.0184, 0, 0),
        (-30, 0.11, 0.31, 0.22, 0.22, 0, 0, -18),
        (-30, 0.16, 0.41, 0.28, -0.22, 0, 0, 18),
        (15, 0.21, 0.25, 0.41, 0, 0.35, -0.15, 0),
        (15, 0.046, 0.046, 0.05, 0, 0.1, 0.25, 0),
        (15, 0.046, 0.023, 0.05, -0.08, -0.605, 0, 0),
        (15, 0.023, 0.046, 0.02, 0.06, -0.605, 0, 0),
    ]
    z, y, x = (np.mgrid[:side, :side, :side] + 0.5) / side * 2 - 1
    density = np.zeros(x.shape)
    for value, a, b, c, x0, y0, z0, turn in ellipsoids:
        cosine, sine = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        u, v = (x - x0) * cosine + (y - y0) * sine, (y - y0) * cosine - (x - x0) * sine
        density[(u / a) ** 2 + (v / b) ** 2 + ((z - z0) / c) ** 2 <= 1] += value
    head = (x / 0.69) ** 2 + (y / 0.92) ** 2 + (z / 0.81) ** 2 <= 1
    noisy = density + np.random.default_rng(SEED).normal(0, 1.2, density.shape)
    return np.where(head, noisy.round().clip(1, 255), 0).astype(np.uint8)


def pictures(*, quick: bool) -> Iterator[Picture]:
    """Return the benchmark pictures; only a few if ``quick``."""
    yield of_curves("paper R=40 w=4", 128, [paper_curve(40, 4)], 2.8)
    if quick:
        yield of_voxels("20 segments 64", 64, lines(64, 20), None)
        yield of_array(
            "sphere shell 32", (abs(radii(32)[0] - 14) < 0.5).astype("u1"), "mono1", None
        )
        yield of_array("head, 8 bit 16", phantom(16), "index8", None)
        return
    yield of_curves("paper R=40 w=2", 128, [paper_curve(40, 2)], 2.8)
    yield of_curves("paper R=80 w=4", 256, [paper_curve(80, 4)], 2.5)
    for side, target in ((128, 2.8), (256, 2.5)):
        yield of_curves(f"torus knots {side}", side, knots(side), target)
        yield of_curves(f"Lissajous {side}", side, waves(side), target)
        yield of_curves(f"helices {side}", side, helices(side), None)
        yield of_curves(f"1000 Beziers {side}", side, beziers(side, 1000, side / 2), 3.5)
        yield of_voxels(
            f"1000 segments {side}", side, lines(side, 1000), 1.0 if side < 256 else 0.5
        )
        far, ring = radii(side)
        shells = {
            "sphere shell": abs(far - side * 0.455) < 0.5,
            "torus shell": abs(ring - side * 0.12) < 0.5,
            "bumpy shell": bumpy(side),
        }
        for name, shell in shells.items():
            yield of_array(f"{name} {side}", shell.astype("u1"), "mono1", 3.6)
        yield of_array(f"ball {side}", (far < side * 0.4).astype("u1"), "mono1", 0.3)
    yield of_curves("1000 short Beziers 128", 128, beziers(128, 1000, 7), None)
    sequences = [s.voxels for s in vd.voxelize_many(beziers(128, 1000, 64))]
    colors = ["orange", "lime", "#0af", "red", "yellow", "magenta", "cyan", "white"]
    yield of_voxels("1000 Beziers 8 colours", 128, sequences, None, "index8", colors)
    rainbow = ["red", "yellow", "lime", "cyan", "blue", "magenta", "red"]
    yield from gradients("rainbow trefoil", 128, TorusKnot(2, 3, (64,) * 3, 40, 15), rainbow)
    yield from gradients("rainbow Lissajous", 128, waves(128)[3], rainbow[:-1])
    yield from gradients("two-colour paper", 128, paper_curve(40, 4), ["blue", "orange"])
    dots = np.random.default_rng(SEED).integers(0, 128, (2000, 3))
    yield of_voxels("2000 lone voxels", 128, [dots], None)
    for side in (64, 128):
        yield of_array(f"head, 8 bit {side}", phantom(side), "index8", 1.5 if side > 64 else None)


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
    head += "".join(f"{name:>7}" for name in ("ARC", "FADE", "ARC2"))
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
        for more in (("arc",), ("fade",), ("fade", "arc", "arc2")):
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

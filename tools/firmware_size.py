"""What the reference device in C costs on a Cortex-M0+: code, RAM, stack, and cycles a voxel.

``python tools/firmware_size.py`` prints two tables in Markdown; ``--write`` puts them into
firmware/README.md. Code and RAM are those of the core, compiled for size and linked without what
nothing calls; the stack is bounded by the compiler's frames along the call graph. Cycles are those
of a Cortex-M0+ without wait states: each instruction that an emulator executes costs what the
processor's manual says. Needs arm-none-eabi-gcc, qemu-system-arm and make.
"""

from __future__ import annotations

import argparse
import functools
import math
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from voxdisplay.conformance import (
    ops,
    packets,
    range_coded_chains,
    range_coded_slabs,
    second_chains,
)
from voxdisplay.conformance.announced_device import FORMATS, AnnouncedDevice, Voxel

ROOT = Path(__file__).resolve().parents[1]
FIRMWARE = ROOT / "firmware"
README = FIRMWARE / "README.md"
TRIPLE = "arm-none-eabi-"
ENTRIES = ("vxd_start", "vxd_receive", "vxd_poll", "vxd_tick", "vxd_disconnect")
VERSION_1_0 = ("LINE", "BOX", "DOTS", "OCT", "DIFF", "ARC", "PALETTE", "READ", "DIGEST")
FEATURES = (*VERSION_1_0, "FADE", "ARC2", "SLABS", "HOLD")
PAYLOAD, RING, SIDE = 1024, 2048, 32


def run(*words: str | Path, cwd: Path | None = None) -> str:
    """Run a program; return what it prints."""
    done = subprocess.run([*map(str, words)], cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{words[0]} failed:\n{done.stderr}")
    return done.stdout


@functools.cache
def flags() -> list[str]:
    """Options of the compiler for a Cortex-M0+, from the Makefile."""
    return run("make", "-s", "-C", FIRMWARE, "m0-flags").split()


def macros(features: Sequence[str], pixel_format: str = "INDEX8") -> list[str]:
    """Macros of the core for a set of features."""
    sides = [f"-DVXD_N{axis}={SIDE}" for axis in "XYZ"]
    sizes = [f"-DVXD_MAX_PAYLOAD={PAYLOAD}", f"-DVXD_RING={RING}"]
    chosen = [f"-DVXD_{name}={int(name in features)}" for name in FEATURES]
    # Without features nothing is in a hurry: no table for the check value.
    table = [f"-DVXD_CRC_TABLE={int(bool(features))}"]
    return [*sides, *sizes, *chosen, *table, f"-DVXD_FORMAT=VXD_{pixel_format}"]


# -- code, RAM and stack


@dataclass(frozen=True)
class Cost:
    """Bytes of the core: code with its constants, RAM without ring, payload and pages, stack."""

    code: int
    ram: int
    stack: int


@functools.cache
def cost_of(features: tuple[str, ...], pixel_format: str = "INDEX8") -> Cost:
    """Compile and link the core with some features; return what it takes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for source in sorted((FIRMWARE / "core").glob("*.c")):
            words = [*flags(), *macros(features, pixel_format), "-fcallgraph-info=su"]
            run(TRIPLE + "gcc", *words, "-I", FIRMWARE / "core", "-c", source, cwd=folder)
        roots = [f"-Wl,-u,{entry}" for entry in ENTRIES]
        words = ["-nostdlib", "-r", "-Wl,--gc-sections", "-Wl,-e,vxd_poll", *roots]
        run(TRIPLE + "gcc", *words, *folder.glob("*.o"), "-o", folder / "core.elf")
        sizes = run(TRIPLE + "size", folder / "core.elf").splitlines()[1].split()
        graph = "".join(path.read_text() for path in folder.glob("*.ci"))
    return Cost(int(sizes[0]), int(sizes[2]) - RING - PAYLOAD, deepest_stack(graph))


def deepest_stack(graph: str) -> int:
    """Return the most bytes of stack from any entry of the core, without the maker's functions."""
    frames = {
        title: int(size)
        for title, size in re.findall(
            r'node: \{ title: "([^"]+)" label: "[^"]*\\n(\d+) bytes', graph
        )
    }
    by_name = {title.split(":")[-1]: title for title in frames}
    calls: dict[str, set[str]] = {title: set() for title in frames}
    for caller, callee in re.findall(
        r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', graph
    ):
        name = callee.split(":")[-1]
        if name in by_name:
            calls[caller].add(callee if callee in frames else by_name[name])

    def depth(title: str, above: tuple[str, ...]) -> int:
        if title in above:
            sys.exit(f"{title} calls itself: no bound for the stack")
        inner = [depth(callee, (*above, title)) for callee in calls[title]]
        return frames[title] + max(inner, default=0)

    return max(depth(by_name[entry], ()) for entry in ENTRIES)


# -- cycles


@dataclass(frozen=True)
class Sample:
    """A payload whose cycles are counted, and the features that it needs."""

    name: str
    payload: bytes
    features: tuple[str, ...] = ()
    pixel_format: str = "INDEX8"


def device(pixel_format: str) -> AnnouncedDevice:
    """Return the device that is measured."""
    number = next(value for value, name in FORMATS.items() if name == pixel_format)
    return AnnouncedDevice(number, SIDE, SIDE, SIDE, max_payload=PAYLOAD)


def curve(turns: float, count: int) -> tuple[Voxel, ...]:
    """Return the voxels of a rising circle, each beside the one before."""
    found: list[Voxel] = []
    for i in range(40 * count):
        t = i / (40 * count)
        angle = 2 * math.pi * turns * t
        place = (
            round(15.5 + 12 * math.cos(angle)),
            round(15.5 + 12 * math.sin(angle)),
            round(2 + 27 * t),
        )
        if not found or place != found[-1]:
            found.append(place)
    return tuple(found)


def ball(*, hollow: bool) -> set[Voxel]:
    """Return the voxels of a ball, or of its shell."""
    inner = 11.5 if hollow else 0
    return {
        (x, y, z)
        for x in range(SIDE)
        for y in range(SIDE)
        for z in range(SIDE)
        if inner <= math.dist((x, y, z), (15.7, 15.2, 15.5)) < 12.5
    }


def chains(pixel_format: str, count: int) -> bytes:
    """Return chains in all octants."""
    rng = random.Random(5)
    shape = device(pixel_format)
    found = b""
    for octant in range(count):
        chosen = ops.random_chain(shape, rng, octant % 24, SIDE - 1)
        if chosen is None:
            sys.exit("no chain fits the grid")
        found += ops.chain(shape, octant % 24, chosen[1], chosen[0])
    return found


def samples() -> Iterator[Sample]:
    """Yield what is measured."""
    rng = random.Random(7)
    plain, rgb = device("INDEX8"), device("RGB888")
    line = ops.line(plain, (0, 1, 2), (31, 20, 9))
    walk = curve(3, 100)
    shell = range_coded_slabs.Box((0, 0, 0), 8, 8, 8)
    fade = [bytes((255, 0, 0)), bytes((0, 255, 0)), bytes((9, 9, 255))]
    yield Sample("STEP, FROM", chains("INDEX8", 24))
    yield Sample("RUN", ops.run(3000))
    yield Sample("LIT", ops.literal(plain, [rng.randrange(256) for _ in range(900)]))
    yield Sample("LINE", line * 8, ("LINE",))
    yield Sample("BOX", ops.box(plain, (3, 3, 3), (17, 17, 17)), ("BOX",))
    dots = [ops.random_voxel(plain, rng) for _ in range(200)]
    yield Sample("DOTS", ops.dots(plain, dots), ("DOTS",))
    octs = b"".join(brick_of_the_shell(plain))
    yield Sample("OCT, a shell", octs, ("OCT",))
    yield Sample("DIFF", ops.differences([rng.randint(-8, 7) for _ in range(900)]), ("DIFF",))
    piece = range_coded_chains.Piece(walk)
    yield Sample("ARC", range_coded_chains.encode(plain, [piece]), ("ARC",))
    inked = second_chains.InkedPiece(walk)
    yield Sample("ARC2", second_chains.encode(plain, [inked]), ("ARC2",))
    begun = ops.fade(rgb, fade, 500, 0) + chains("RGB888", 24)
    yield Sample("FADE, by STEP", begun, ("FADE",), "RGB888")
    ink = second_chains.FadeInk(fade, len(walk), 0)
    faded = second_chains.encode(rgb, [second_chains.InkedPiece(walk, ink)])
    yield Sample("ARC2 with a fade", faded, ("ARC2",), "RGB888")
    for name, hollow in (("SLABS, a shell", True), ("SLABS, a ball", False)):
        op = range_coded_slabs.encode(plain, ball(hollow=hollow), [shell])
        yield Sample(name, op, ("SLABS",))
    yield Sample("RUN with DIGEST", ops.run(3000), ("DIGEST",))


def brick_of_the_shell(shape: AnnouncedDevice) -> Iterator[bytes]:
    """Yield the bricks of an eighth of a shell."""
    lit = ball(hollow=True)
    corner = {(x, y, z) for x, y, z in lit if max(x, y, z) < 16}
    yield ops.brick(shape, 4, (0, 0, 0), corner)


CYCLES = {"muls": 1, "bl": 3, "bx": 2, "blx": 2, "b": 2, "b.n": 2, "mrs": 3, "msr": 3}


def cycles_of(mnemonic: str, operands: str, *, taken: bool) -> int:
    """Return the cycles of an instruction on a Cortex-M0+ without wait states."""
    registers = len(re.findall(r"\b(?:r\d+|lr|pc|ip|sp|sl|fp)\b", operands))
    if mnemonic in {"push", "pop"}:
        return registers + (3 if "pc" in operands else 1)
    if mnemonic in {"ldmia", "stmia"}:
        return registers  # one of them is the base
    if mnemonic.startswith(("ldr", "str")):
        return 2
    if mnemonic.removesuffix(".n") in CONDITIONS:
        return 2 if taken else 1
    if mnemonic in {"mov", "add"} and operands.startswith("pc"):
        return 2
    return CYCLES.get(mnemonic, 1)


CONDITIONS = {f"b{c}" for c in ("eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls")} | {
    f"b{c}" for c in ("ge", "lt", "gt", "le")
}


@dataclass(frozen=True)
class Count:
    """Voxels that a payload wrote, with instructions and cycles from its first op to its last."""

    voxels: int
    instructions: int
    cycles: int


def count(sample: Sample) -> Count:
    """Run a payload on the core in an emulator; count what it takes."""
    greeting = packets.encode(packets.hello(1))
    data = packets.encode(packets.data(0, 0, sample.payload, flags=5))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.joinpath("wire.inc").write_text(",".join(map(str, b"\0" + greeting + data)))
        sources = [*sorted((FIRMWARE / "core").glob("*.c"))]
        ports = FIRMWARE / "ports"
        sources += [ports / "memory.c", ports / "bench" / "main.c"]
        words = [*flags(), *macros(sample.features, sample.pixel_format), "-nostdlib"]
        script = ports / "mps2-an385" / "board.ld"
        words += [
            "-I",
            str(FIRMWARE / "core"),
            "-I",
            name,
            "-I",
            str(ports / "cortex-m"),
            f"-L{ports / 'cortex-m'}",
        ]
        program = folder / "bench.elf"
        run(TRIPLE + "gcc", *words, "-T", script, *sources, "-lgcc", "-o", program, cwd=folder)
        listing = run(TRIPLE + "objdump", "-d", "--no-show-raw-insn", program)
        log = folder / "trace"
        emulator = ["qemu-system-arm", "-M", "mps2-an385", "-nographic", "-monitor", "none"]
        emulator += ["-serial", "none", "-semihosting", "-singlestep", "-d", "exec,nochain"]
        run(*emulator, "-D", log, "-kernel", program)
        with log.open() as lines:
            return count_trace(lines, listing)


def count_trace(lines: Iterator[str], listing: str) -> Count:
    """Count the instructions of a trace that ``apply_ops`` and what it calls execute."""
    code = {
        int(at, 16): (mnemonic, operands)
        for at, mnemonic, operands in re.findall(
            r"^ +([0-9a-f]+):\t(\S+)(?: *\t([^\n;@]*))?", listing, re.MULTILINE
        )
    }
    starts = {
        name: int(at, 16)
        for at, name in re.findall(r"^([0-9a-f]+) <(\w+)>:", listing, re.MULTILINE)
    }
    voxels = instructions = cycles = 0
    inside = False
    caller = before = 0
    previous: int | None = None
    for line in lines:
        at = int(line.split("/")[1], 16)
        if inside and at == caller:
            break
        if at == starts["apply_ops"] and not inside:
            inside, caller, previous = True, before + 4, None
        if inside:
            if previous is not None:
                mnemonic, operands = code[previous]
                cycles += cycles_of(mnemonic, operands, taken=at != previous + 2)
            instructions += 1
            voxels += at == starts["vxd_put"]
            previous = at
        before = at
    return Count(voxels, instructions, cycles)


# -- the tables


def tables() -> str:
    """Return both tables in Markdown."""
    lines = ["| core with | code | RAM | stack |", "| --- | --- | --- | --- |"]

    def row(name: str, cost: Cost) -> None:
        lines.append(f"| {name} | {cost.code} | {cost.ram} | {cost.stack} |")

    base = cost_of(())
    row("the ops that every device has", base)
    row("all features of version 1.0", cost_of(VERSION_1_0))
    row("all features", cost_of(FEATURES))
    lines += ["", "| feature | code | RAM |", "| --- | --- | --- |"]
    for name in FEATURES:
        cost = cost_of((name,))
        # The table for the check value is none of the feature's.
        lines.append(
            f"| {name} | {cost.code - base.code - table_of_the_crc()} | {cost.ram - base.ram} |"
        )
    both = cost_of(("ARC", "ARC2"))
    lines.append(
        f"| ARC and ARC2 | {both.code - base.code - table_of_the_crc()} | {both.ram - base.ram} |"
    )
    lines += [
        "",
        "| op | voxels | instructions a voxel | cycles a voxel |",
        "| --- | --- | --- | --- |",
    ]
    for sample in samples():
        found = count(sample)
        each = f"{found.instructions / found.voxels:.0f} | {found.cycles / found.voxels:.0f}"
        lines.append(f"| {sample.name} | {found.voxels} | {each} |")
    return "\n".join(lines)


@functools.cache
def table_of_the_crc() -> int:
    """Return how much larger the core is with a table for the check value."""
    return cost_of(("TABLE",)).code - cost_of(()).code


def main() -> None:
    """Print the tables, or write them into the README."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--write", action="store_true", help=f"into {README.relative_to(ROOT)}")
    made = tables()
    if parser.parse_args().write:
        begin, end = "<!-- made by tools/firmware_size.py -->\n", "<!-- end -->"
        head, _, rest = README.read_text().partition(begin)
        README.write_text(head + begin + made + "\n" + end + rest.partition(end)[2])
    else:
        print(made)


if __name__ == "__main__":
    main()

"""The reference device of ``firmware/``, compiled for one set-up and run as a process.

Knows protocol.md through `document`, and neither the driver nor the emulator.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Self

import document

FIRMWARE = Path(__file__).parents[1] / "firmware"
FEATURES = (
    *("line", "box", "dots", "oct", "diff", "arc", "palette", "read", "digest"),
    *("slabs", "fade", "arc2", "hold"),
)
ONLY_INDEX8 = {"diff", "palette"}
NOT_MONO1 = {"fade"}
FORMATS = ("mono1", "index8", "rgb565", "rgb888")
HELLO = bytes.fromhex("30 00 00 01 17 5A 00 00")
FLAGS = ("-std=c11", "-O1", "-g", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wshadow")
COMPILER = shutil.which("cc")

Grid = tuple[int, int, int]

_built: dict[tuple[str, ...], Path] = {}
_directory = tempfile.TemporaryDirectory(prefix="firmware-")


def all_features(pixel_format: str, *, ticks: bool = False) -> frozenset[str]:
    """Names of all features that a format allows, and HOLD only to a device with refresh ticks."""
    unfit = ONLY_INDEX8 if pixel_format != "index8" else set()
    unfit = unfit | (NOT_MONO1 if pixel_format == "mono1" else set())
    return frozenset(FEATURES) - unfit - (set() if ticks else {"hold"})


def build(
    grid: Grid,
    pixel_format: str,
    features: frozenset[str],
    *,
    max_payload: int = 1024,
    ring: int = 16384,
) -> Path:
    """Compile the device for the POSIX port, once per set-up; return its program."""
    options = [f"-DVXD_N{axis}={side}" for axis, side in zip("XYZ", grid, strict=True)]
    options += [f"-DVXD_{name.upper()}={int(name in features)}" for name in FEATURES]
    options.append(f"-DVXD_FORMAT=VXD_{pixel_format.upper()}")
    options += [f"-DVXD_MAX_PAYLOAD={max_payload}", f"-DVXD_RING={ring}"]
    key = tuple(options)
    if key not in _built:
        program = Path(_directory.name) / f"device-{len(_built)}"
        sources = [*(FIRMWARE / "core").glob("*.c"), FIRMWARE / "ports" / "memory.c"]
        sources.append(FIRMWARE / "ports" / "posix" / "main.c")
        # What a shell may ask for: -fsanitize=address,undefined.
        flags = [*FLAGS, *os.environ.get("FIRMWARE_CFLAGS", "").split()]
        subprocess.run(
            [str(COMPILER), *flags, f"-I{FIRMWARE / 'core'}", *options, *sources, "-o", program],
            check=True,
        )
        _built[key] = program
    return _built[key]


class ScriptedDevice:
    """The device without port and clock: packets in, packets out."""

    def __init__(self, program: Path, **identity: Any) -> None:
        words = [word for key, value in identity.items() for word in (f"--{key}", str(value))]
        self.process = subprocess.Popen(
            [str(program), "--script", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def _command(self, line: str) -> bytes:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        assert answer.endswith("\n"), "the device has ended"
        return bytes.fromhex(answer)

    def send_raw(self, data: bytes) -> list[bytes]:
        """Send bytes; return header and payload of each packet that comes back."""
        return document.off_wire(self._command("r " + data.hex()))

    def send(self, packet: bytes) -> list[bytes]:
        """Send a packet, given without its check value."""
        return self.send_raw(document.on_wire(packet))

    def tick(self) -> list[bytes]:
        return document.off_wire(self._command("t"))

    def disconnect(self) -> None:
        assert self._command("d") == b""

    def front_page(self) -> bytes:
        """The front page in scan order, each voxel with the bytes of its pixel."""
        return self._command("p")

    def lit_voxels(self, grid: Grid, pixel_format: str) -> dict[Grid, bytes]:
        size = (1, 1, 2, 3)[FORMATS.index(pixel_format)]
        nx, ny, _ = grid
        page = self.front_page()
        found = {}
        for index in range(len(page) // size):
            pixel = page[index * size : (index + 1) * size]
            if any(pixel):
                found[index % nx, index // nx % ny, index // nx // ny] = pixel
        return found

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.stdout.close()
        assert self.process.wait(10) == 0


def device_of(vector: document.Vector) -> ScriptedDevice:
    """Return the device that a vector describes."""
    facts = dict(vector.lines)
    pixel_format = vector["format"].lower()
    if "features" in facts:
        features = frozenset(facts["features"].lower().split("|"))
    elif vector.kind == "dialogue":
        features = frozenset({"read", "digest"})
    else:
        features = all_features(pixel_format)
    program = build(
        vector.grid,
        pixel_format,
        features,
        max_payload=int(facts.get("max_payload", 1024)),
        ring=int(facts.get("rx_buffer", 16384)),
    )
    identity = {
        key: facts[key].strip('"') for key in ("name", "firmware", "serial") if key in facts
    }
    refresh = int(facts.get("refresh", 0)) / 1000
    return ScriptedDevice(program, refresh=refresh, boot=facts.get("boot", 1), **identity)


class TerminalDevice:
    """The device on its own pseudo-terminal, with its own clock."""

    def __init__(self, program: Path, **identity: Any) -> None:
        words = [word for key, value in identity.items() for word in (f"--{key}", str(value))]
        self.process = subprocess.Popen(
            [str(program), *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        assert self.process.stdout is not None
        self.port = json.loads(self.process.stdout.readline())["port"]

    def __enter__(self) -> str:
        return self.port

    def __exit__(self, *_: object) -> None:
        assert self.process.stdout is not None
        assert self.process.poll() is None, "the device has ended"
        self.process.terminate()
        self.process.wait(10)
        self.process.stdout.close()

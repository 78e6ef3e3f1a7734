"""protocol.md as data: its tables of literals, its layouts and its vectors.

Shares no code with either side.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

TEXT = (Path(__file__).parents[1] / "protocol.md").read_text(encoding="utf-8")


def _tables(kind: str) -> dict[str, list[dict[str, str]]]:
    tables = {}
    for name, body in re.findall(rf"<!-- {kind}: (\w+) -->\n((?:\|.*\n)+)", TEXT):
        head, _, *rows = (
            [cell.strip() for cell in line.strip("|\n").split("|")] for line in body.splitlines()
        )
        tables[name] = [dict(zip(head, row, strict=True)) for row in rows]
    return tables


def literals() -> dict[str, int]:
    """All literals of the document: GROUP_NAME -> value."""
    return {
        f"{group}_{row['name']}": int(row["value"], 0)
        for group, rows in _tables("literals").items()
        for row in rows
    }


def layouts() -> dict[str, tuple[tuple[str, int, int], ...]]:
    """All layouts: NAME -> (field, offset, size) of the fields that have a fixed place."""
    return {
        name: tuple(
            (row["field"], int(row["offset"]), int(row["size"]))
            for row in rows
            if row["offset"].isdigit() and row["size"].isdigit()
        )
        for name, rows in _tables("layout").items()
    }


def pixel_bytes() -> dict[int, int]:
    """Bytes of a pixel of each format."""
    return {int(row["value"]): int(row["bytes"]) for row in _tables("literals")["FORMAT"]}


@dataclass(frozen=True)
class Vector:
    """One fenced block: its kind, its name, and its lines as (key, value)."""

    kind: str
    name: str
    lines: tuple[tuple[str, str], ...]

    def __getitem__(self, key: str) -> str:
        return dict(self.lines)[key]

    def hex(self, key: str) -> bytes:
        return hex_bytes(self[key])

    def integer(self, key: str) -> int:
        return int(self[key], 0)

    @property
    def grid(self) -> tuple[int, int, int]:
        x, y, z = map(int, self["grid"].split("x"))
        return x, y, z

    def voxels(self) -> dict[tuple[int, int, int], bytes]:
        """The lit voxels of an ``ops`` vector, with their pixels."""
        found = re.findall(r"(\d+),(\d+),(\d+)=(\w+)", self["voxels"])
        return {(int(x), int(y), int(z)): bytes.fromhex(pixel) for x, y, z, pixel in found}

    def __str__(self) -> str:
        return self.name


def hex_bytes(text: str) -> bytes:
    """Read hex as the document writes it: ``-`` is nothing, ``01..FE`` a range."""
    if text == "-":
        return b""
    out = bytearray()
    for word in text.split():
        low, _, high = word.partition("..")
        out += bytes(range(int(low, 16), int(high or low, 16) + 1))
    return bytes(out)


def vectors(kind: str) -> list[Vector]:
    """All vectors of a kind, in their order."""
    found = []
    blocks = re.findall(rf"```vector {kind}(?: ([\w-]+))?\n(.*?)```", TEXT, re.DOTALL)
    for number, (name, body) in enumerate(blocks):
        lines: list[tuple[str, str]] = []
        for line in body.splitlines():
            if line.startswith(" "):
                key, value = lines.pop()
                lines.append((key, f"{value} {line.strip()}"))
            else:
                key, _, value = line.partition(" ")
                lines.append((key, value.strip()))
        found.append(Vector(kind, name or f"{kind}-{number}", tuple(lines)))
    return found


def cobs_encode(data: bytes) -> bytes:
    """COBS-encode as section 3 says, in the simplest form."""
    out = bytearray()
    groups = data.split(b"\0")
    for group in groups:
        whole = len(group) // 254 * 254
        for at in range(0, whole, 254):
            out += b"\xff" + group[at : at + 254]
        out += bytes((len(group) - whole + 1,)) + group[whole:]
    ends_full = groups[-1] and len(groups[-1]) % 254 == 0
    return bytes(out[:-1] if ends_full else out)


def cobs_decode(segment: bytes) -> bytes:
    """Undo `encode_segment`."""
    out = bytearray()
    at = 0
    while at < len(segment):
        code = segment[at]
        out += segment[at + 1 : at + code]
        at += code
        if code < 255 and at < len(segment):
            out.append(0)
    return bytes(out)


def on_wire(body: bytes) -> bytes:
    """Return the wire form of header and payload."""
    return cobs_encode(body + zlib.crc32(body).to_bytes(4, "little")) + b"\0"


def off_wire(data: bytes) -> list[bytes]:
    """Return header and payload of each packet on the wire; check delimiting and CRC."""
    segments = data.split(b"\0")
    assert segments.pop() == b""
    packets = [cobs_decode(segment) for segment in segments]
    assert [cobs_encode(raw) for raw in packets] == segments
    assert all(zlib.crc32(raw[:-4]).to_bytes(4, "little") == raw[-4:] for raw in packets)
    return [raw[:-4] for raw in packets]


class Device(Protocol):
    """A device with which a dialogue is held: each call returns the packets that it answers."""

    def send(self, body: bytes) -> list[bytes]: ...
    def send_raw(self, data: bytes) -> list[bytes]: ...
    def tick(self) -> list[bytes]: ...


def hold_dialogue(lines: Iterable[tuple[str, str]], device: Device) -> None:
    """Send what the host sends in a dialogue; assert that the device answers as the document."""
    answers: list[bytes] = []
    lines = tuple(lines)
    format_ = dict(lines)["format"]
    for key, text in lines:
        if key in {"host", "raw", "tick"}:
            assert answers == [], "the device answered more than the document"
        if key == "host":
            answers = device.send(hex_bytes(text))
        elif key == "raw":
            answers = device.send_raw(hex_bytes(text))
        elif key == "tick":
            answers = device.tick()
        elif key == "device":
            meant = hex_bytes(text.removesuffix("*"))
            assert answers, "the device did not answer"
            got = answers.pop(0)
            assert (got[: len(meant)] if text.endswith("*") else got).hex(" ") == meant.hex(" ")
            if got[0] >> 4 == literals()["TYPE_ERROR"]:
                got[8:].decode()  # its text is UTF-8
        elif key == "page":
            fields, pixels = map(hex_bytes, text.split("="))
            assert answers, "the device did not answer"
            got = answers.pop(0)
            assert got[: len(fields)].hex(" ") == fields.hex(" ")
            drawn = page_pixels(got[len(fields) :], int.from_bytes(fields[8:], "little"), format_)
            assert drawn.hex(" ") == pixels.hex(" ")
    assert answers == []


def page_pixels(ops: bytes, count: int, format_: str) -> bytes:
    """Return what the ops of a PAGE draw: each pixel with all its bytes, MONO1 with one.

    Raises
    ------
    AssertionError
        If they do not cover exactly ``count`` voxels, or are others than section 10 allows.
    """
    mono = format_ == "MONO1"
    size = pixel_bytes()[literals()[f"FORMAT_{format_}"]]
    pen, at, out = b"\1" if mono else b"\xff" * size, 0, b""
    while at < len(ops) and ops[at]:
        op = ops[at]
        at += 1
        if op == 1:
            pen, at = ops[at : at + size], at + size
            continue
        number, shift, more = (op & 31) + 1, 0, op & 31 == 31
        while more:
            number += (ops[at] & 127) << shift
            more, shift, at = ops[at] > 127, shift + 7, at + 1
        assert op >> 5 in {4, 5, 6}
        if op >> 5 == 4:
            out += bytes(size * number)
        elif op >> 5 == 5:
            out += pen * number
        else:
            width = -(-number // 8) if mono else size * number
            run, at = ops[at : at + width], at + width
            out += bytes(run[i // 8] >> i % 8 & 1 for i in range(number)) if mono else run
            pen = out[-size:]
    assert not any(ops[at:])
    assert len(out) == size * count
    return out

"""Writes vectors.json: the vectors of protocol.md, for tests in any language.

Every number, hex run and list is spelled out there, and each device has its features by name, so
that a reader needs no parser but that of JSON. Run it after a change of a vector; a test compares
both files.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT, OUTPUT = ROOT / "protocol.md", ROOT / "vectors.json"
ABOUT = "The vectors of protocol.md, section 17, made by tools/vectors_json.py. Hex is lower case."
HEX_KEYS = {"decoded", "encoded", "bytes", "crc", "packet", "wire", "ops"}
OF_INDEX8, NOT_OF_MONO1, WITH_TICKS = {"DIFF", "PALETTE"}, {"FADE", "VALUES"}, "HOLD"  # section 5


def plain_hex(text: str) -> str:
    """Return hex without blanks: ``-`` is nothing, ``01..03`` is 010203."""
    out = bytearray()
    for word in text.replace("-", "").split():
        low, _, high = word.partition("..")
        out += bytes(range(int(low, 16), int(high or low, 16) + 1))
    return out.hex()


def parse_value(key: str, text: str) -> Any:
    """Return a line's value as JSON has it."""
    if key in HEX_KEYS:
        return plain_hex(text)
    if key == "grid":
        return [int(side) for side in text.split("x")]
    if key in {"flags", "features"}:
        return [] if text == "-" else text.split("|")
    if key == "voxels":
        found = re.findall(r"(\d+),(\d+),(\d+)=(\w+)", text)
        return [[int(x), int(y), int(z), pixel.lower()] for x, y, z, pixel in found]
    if text.startswith('"'):
        return text.strip('"')
    return int(text, 0) if text[:1].isdigit() else text


def parse_step(key: str, text: str) -> dict[str, Any]:
    """Return a line of a dialogue as JSON has it."""
    if key == "tick":
        return {"tick": True}
    if key == "page":
        fields, pixels = text.split("=")
        return {"page": plain_hex(fields), "pixels": plain_hex(pixels)}
    step: dict[str, Any] = {key: plain_hex(text.removesuffix("*"))}
    if text.endswith("*"):
        step["more"] = True
    return step


def parse_vector(kind: str, name: str, body: str, features: list[str]) -> dict[str, Any]:
    """Return one fenced block as JSON has it; ``features`` are all that there are."""
    vector: dict[str, Any] = {"kind": kind, "vector": name}
    for line in re.sub(r"\n +", " ", body).splitlines():
        key, _, text = line.partition(" ")
        if key in {"host", "raw", "tick", "device", "page"}:
            vector.setdefault("steps", []).append(parse_step(key, text.strip()))
        else:
            vector[key] = parse_value(key, text.strip())
    if kind == "dialogue":
        vector.setdefault("features", ["READ", "DIGEST"])
    elif kind in {"ops", "refused"}:
        format_ = vector["format"]
        hidden = {
            WITH_TICKS,
            *(() if format_ == "INDEX8" else OF_INDEX8),
            *(NOT_OF_MONO1 if format_ == "MONO1" else ()),
        }
        vector.setdefault("features", [each for each in features if each not in hidden])
    return vector


def collect(text: str) -> dict[str, Any]:
    """Return all vectors of the document's text, in their order."""
    table = re.search(r"<!-- literals: FEATURE -->\n((?:\|.*\n)+)", text)
    version = re.search(r"protocol, version (\S+)", text)
    if not (table and version):
        raise SystemExit(f"{DOCUMENT} has no title with a version, or no table of features")
    features = re.findall(r"^\| ([A-Z]\w+) \|", table[1], re.MULTILINE)
    counts: dict[str, int] = {}
    vectors = []
    for kind, name, body in re.findall(r"```vector (\w+)(?: ([\w-]+))?\n(.*?)```", text, re.DOTALL):
        number = counts[kind] = counts.get(kind, -1) + 1
        vectors.append(parse_vector(kind, name or f"{kind}-{number}", body, features))
    return {"about": ABOUT, "protocol": version[1], "vectors": vectors}


def as_text(found: dict[str, Any]) -> str:
    """Return the file's text: one vector, or one step of a dialogue, a line."""
    lines = []
    for vector in found["vectors"]:
        steps = vector.get("steps")
        rest = {key: value for key, value in vector.items() if key != "steps"}
        line = json.dumps(rest, ensure_ascii=False)
        if steps:
            inner = ",\n   ".join(map(json.dumps, steps))
            line = f'{line[:-1]}, "steps": [\n   {inner}]}}'
        lines.append(line)
    head = ",\n ".join(
        f"{json.dumps(key)}: {json.dumps(found[key])}" for key in ("about", "protocol")
    )
    return "{" + head + ',\n "vectors": [\n  ' + ",\n  ".join(lines) + "\n ]}\n"


def main() -> None:
    """Write the file."""
    found = collect(DOCUMENT.read_text(encoding="utf-8"))
    OUTPUT.write_text(as_text(found), encoding="utf-8", newline="\n")
    print(f"{len(found['vectors'])} vectors in {OUTPUT}")


if __name__ == "__main__":
    main()

"""What is a device of the protocol and what is not; and a bad line; and the picture file."""

import io
import math
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from simwire import Rig, data

from firmware_sim.bench import Bench, Snapshot
from firmware_sim.config import (
    Config,
    parse_features,
    parse_number,
    parse_refresh,
    parse_size,
)
from firmware_sim.faults import Line, parse_faults
from firmware_sim.memory import FORMATS
from firmware_sim.npy import npy_header, write_npy


def test_defaults() -> None:
    config = Config()
    assert str(config.shape) == "128x128x128"
    assert (config.pixel_format, config.max_payload, config.boot) == ("rgb888", 1024, None)
    assert (config.refresh, config.rx_buffer, config.silent) == (30_000, 16_384, 0)
    assert config.features == {"read", "digest"}


@pytest.mark.parametrize(
    ("settings", "remedy"),
    [
        ({"grid": (0, 1, 1)}, "from 1 to 65535"),
        ({"grid": (1, 1, 65_536)}, "from 1 to 65535"),
        ({"grid": (65_535, 32_769, 1)}, "2147483647 voxels or less"),
        ({"pixel_format": "rgb"}, "take one of mono1, index8, rgb565, rgb888"),
        ({"features": frozenset({"palette"})}, "palette: take of read, digest"),
        ({"refresh": -1}, "refresh is -1"),
        ({"refresh": 1 << 32}, "to 4294967295"),
        ({"max_payload": 63}, "from 64 to 65535"),
        ({"max_payload": 65_536}, "from 64 to 65535"),
        ({"rx_buffer": 1100}, "from 1101 to"),
        ({"boot": 65_536}, "from 0 to 65535"),
        ({"silent": 9}, "from 0 to 8"),
        ({"name": "é" * 128}, "bytes of the name is 256"),
        ({"name": "n" * 64, "max_payload": 64}, "max_payload of 99"),
    ],
)
def test_what_is_no_device_is_refused_with_the_remedy(
    settings: dict[str, object], remedy: str
) -> None:
    """`rx_buffer` MUST be large enough for 64 bytes and the longest packet on the wire."""
    with pytest.raises(ValueError, match=remedy):
        Config(**settings)


def test_the_smallest_and_the_largest_device() -> None:
    Config(rx_buffer=1101)
    Config((1, 1, 1), max_payload=64, rx_buffer=137, name="", boot=0)
    Config(max_payload=65_535, rx_buffer=65_866, name="n" * 255)


def test_values_are_read() -> None:
    assert parse_size("3x5X70") == (3, 5, 70)
    assert parse_refresh("29.97") == 29_970
    assert parse_refresh("0") == 0
    assert parse_number("0x10") == 16
    assert parse_features("") == frozenset()
    assert parse_features("READ,digest") == {"read", "digest"}


@pytest.mark.parametrize(
    ("parse", "text"),
    [
        (parse_size, "3x5"),
        (parse_size, "axbxc"),
        (parse_size, "-1x2x3"),
        (parse_refresh, "fast"),
        (parse_refresh, "nan"),
        (parse_refresh, "inf"),
        (parse_number, "12.5"),
        (parse_number, ""),
    ],
)
def test_what_cannot_be_read_is_a_value_error(parse: Callable[[str], object], text: str) -> None:
    with pytest.raises(ValueError, match="write"):
        parse(text)


# Faults


def test_faults_are_read() -> None:
    assert parse_faults("flip=1e-5,drop:0.5") == (("flip", 1e-5), ("drop", 0.5))
    assert parse_faults("") == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("flop=1", "'flop' is not known: did you mean flip"),
        ("zzz=1", "did you mean flip or drop"),
        ("flip", "write flip=RATE"),
        ("drop=2", "from 0 to 1"),
        ("flip=-1", "from 0 to 1"),
        ("flip=x", "write flip=RATE"),
        ("flip=nan", "from 0 to 1"),
    ],
)
def test_unknown_faults_are_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_faults(text)


@pytest.mark.parametrize("spec", ["flip=1e-3", "drop=1e-2", "drop=0.1,flip=0.01", "flip=1"])
def test_faults_do_not_depend_on_the_cutting(spec: str) -> None:
    rng = random.Random(1)
    stream = rng.randbytes(5000)
    whole = Line(parse_faults(spec), 7, "in").carry(stream)
    line = Line(parse_faults(spec), 7, "in")
    cut = b"".join(line.carry(stream[k : k + 13]) for k in range(0, 5000, 13))
    assert whole == cut != stream
    assert Line(parse_faults(spec), 7, "in").carry(stream) == whole
    if spec != "flip=1":
        assert Line(parse_faults(spec), 8, "in").carry(stream) != whole
        assert Line(parse_faults(spec), 7, "out").carry(stream) != whole


def test_faults_strike_at_their_rate() -> None:
    stream = bytes(100_000)
    flipped = Line((("flip", 1e-2),), 1, "in").carry(stream)
    assert math.isclose(int.from_bytes(flipped, "big").bit_count(), 8000, rel_tol=0.1)
    dropped = Line((("drop", 1e-1),), 1, "in").carry(stream)
    assert math.isclose(len(dropped), 90_000, rel_tol=0.02)
    assert Line((("flip", 1.0),), 1, "in").carry(b"\x0f") == b"\xf0"
    assert Line((("drop", 1.0),), 1, "in").carry(stream) == b""
    assert Line((("flip", 0.0), ("drop", 0.0)), 1, "in").carry(stream) == stream
    assert Line((("flip", 5e-324),), 1, "in").carry(stream) == stream


# The picture file


@pytest.mark.parametrize(
    ("name", "dtype", "channels"),
    [("mono1", "u1", ()), ("index8", "u1", ()), ("rgb565", "<u2", ()), ("rgb888", "u1", (3,))],
)
def test_numpy_reads_a_dump(
    tmp_path: Path, name: str, dtype: str, channels: tuple[int, ...]
) -> None:
    rig = Rig(3, 5, 7, pixel_format=name)
    size = FORMATS[name].size
    pixel = b"\x01" if name == "mono1" else b"\x11\x22\x33"[:size]
    rig.show(0, 0, b"\x02\x02\x03\x04\x01" + pixel + b"\xa0")
    path = tmp_path / "front.npy"
    path.write_bytes(b"older")
    write_npy(path, Bench(rig.device).snapshot())
    voxels = np.load(path)
    assert voxels.shape == (7, 5, 3, *channels)
    assert voxels.dtype == np.dtype(dtype)
    lit = voxels[4, 3, 2]
    assert lit.tobytes() == pixel
    assert np.count_nonzero(voxels) == np.count_nonzero(lit)
    assert list(tmp_path.iterdir()) == [path]


def test_the_header_is_aligned() -> None:
    for side in (1, 10, 100, 1000, 10_000):
        header = npy_header(Snapshot(b"", (side, 1, 1), "index8", None, 0, 0, 0))
        assert len(header) % 64 == 0
        assert header.endswith(b"\n")
        assert np.lib.format.read_magic(io.BytesIO(header)) == (1, 0)


def test_what_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    snapshot = Bench(Rig().device).snapshot()
    with pytest.raises(OSError, match="none"):
        write_npy(tmp_path / "none" / "front.npy", snapshot)
    (tmp_path / "dir").mkdir()
    with pytest.raises(OSError, match="dir"):
        write_npy(tmp_path / "dir", snapshot)
    assert [path.name for path in tmp_path.iterdir()] == ["dir"]


def test_on_swap_is_called_at_each_swap() -> None:
    rig = Rig()
    seen = []
    rig.device.on_swap = lambda: seen.append(rig.front[:1])
    rig.show(0, 0, b"\xa0")
    rig.ask(data(1, 1, b""))
    rig.show(2, 1, b"")
    assert seen == [b"\xff", b"\0"]
